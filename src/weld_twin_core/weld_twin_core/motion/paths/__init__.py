# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Weld seams in arc length, the torch on them, and seams from the mapping a path file holds.

Examples
--------
>>> import weld_twin_core as wt
>>> seam = wt.paths.Line([0.5, -0.1, 0.2], [0.5, 0.1, 0.2])
>>> print(round(seam.length, 6), 'm')
0.2 m

"""

from .bundled import KINDS, default_seam
from .seams import (
    Arc,
    Circle,
    Line,
    Path,
    Polyline,
    SeamFrames,
    Spline,
    Torch,
    Weave,
    from_mapping,
)

__all__ = ['KINDS', 'Arc', 'Circle', 'Line', 'Path', 'Polyline', 'SeamFrames', 'Spline', 'Torch']
__all__ += ['Weave', 'default_seam', 'from_mapping']
