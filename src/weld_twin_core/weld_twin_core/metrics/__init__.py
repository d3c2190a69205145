# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How far the tool is off: deviation metrics in bulk and running, and those of ISO 9283.

Examples
--------
The tool is 0.3 mm and then 0.4 mm off along a seam of 100 mm.

>>> import weld_twin_core as wt
>>> nominal = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]
>>> actual = [[0.0, 0.0, 0.0003], [0.1, 0.0, 0.0004]]
>>> found = wt.metrics.deviation_metrics(actual, nominal)
>>> print(f'{found.max_m * 1e3:.1f} mm at most, D_norm {found.d_norm:.4f}')
0.4 mm at most, D_norm 0.0040

"""

from .deviation import (
    DeviationMetrics,
    RunningMetrics,
    deviation_metrics,
    normalized_deviation,
    orientation_error,
    root_mean_square,
)
from .iso9283 import (
    DriftPerformance,
    PathPerformance,
    PosePerformance,
    drift,
    multidirectional_variation,
    path_performance,
    pose_performance,
)

__all__ = ['DeviationMetrics', 'DriftPerformance', 'PathPerformance', 'PosePerformance']
__all__ += ['RunningMetrics', 'deviation_metrics', 'drift', 'multidirectional_variation']
__all__ += ['normalized_deviation', 'orientation_error', 'path_performance', 'pose_performance']
__all__ += ['root_mean_square']
