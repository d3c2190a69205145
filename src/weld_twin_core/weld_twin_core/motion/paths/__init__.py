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

from .arc import Arc, Circle
from .bundled import KINDS, default_seam
from .mapping import from_mapping
from .polyline import Line, Polyline
from .seam_path import Path, SeamFrames
from .spline import Spline
from .torch import Torch
from .weave import Weave

__all__ = ['KINDS', 'Arc', 'Circle', 'Line', 'Path', 'Polyline', 'SeamFrames', 'Spline', 'Torch']
__all__ += ['Weave', 'default_seam', 'from_mapping']
