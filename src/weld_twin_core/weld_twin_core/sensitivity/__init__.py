# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which tolerance to tighten: local and global sensitivity, the tolerance stack, advice.

Examples
--------
How far is the tool off, at most, in 95 of 100 arms with the default tolerances?

>>> import numpy as np
>>> import weld_twin_core as wt
>>> robot = wt.load('ur5')
>>> study = wt.sensitivity.planned_study(robot, wt.default_seam(robot), 'smooth', points=50)
>>> tolerances = wt.sensitivity.default_tolerances(robot, ['joint_offset', 'link_length'])
>>> chance = wt.sensitivity.probabilities(1024, len(tolerances), seed=1)
>>> runs = wt.sensitivity.model(study, tolerances).at_probabilities(chance)
>>> print(f'{np.percentile(runs.max_m, 95) * 1e3:.1f} mm')
1.2 mm

"""

from .distribution import Distribution
from .evaluate import Model, draws_at, exact_deviations, model
from .local import LocalSensitivity, Posture, arc_weights, local_sensitivity, posture
from .morris import MorrisDesign, Screening, morris_screening
from .seam_study import (
    POINTS,
    Outcomes,
    Study,
    outcomes,
    planned_study,
    recorded_study,
    study_of_plan,
    with_known,
)
from .sobol import SobolDesign, SobolIndices, sobol_indices
from .stack import Probability, ToleranceStack, WeldTolerance, probabilities, tolerance_stack
from .sweep import (
    Sizes,
    Sweep,
    cumulative,
    default_values,
    end_of_linearity,
    scenario_deviations,
    spread_of_passes,
    sweep,
    together,
)
from .tolerance import (
    FAMILIES,
    Tolerance,
    default_tolerances,
    scaled,
    tolerances_from_list,
    with_draws,
)
from .trajectory_advice import (
    Placement,
    PlacementResult,
    ProfileResult,
    Room,
    advise,
    compare_profiles,
    expected_deviation,
    expected_rms,
)

__all__ = ['FAMILIES', 'POINTS', 'Distribution', 'LocalSensitivity', 'Model', 'MorrisDesign']
__all__ += ['Outcomes', 'Placement', 'PlacementResult', 'Posture', 'Probability', 'ProfileResult']
__all__ += ['Room', 'Screening', 'Sizes', 'SobolDesign', 'SobolIndices', 'Study', 'Sweep']
__all__ += ['Tolerance', 'ToleranceStack', 'WeldTolerance', 'advise', 'arc_weights']
__all__ += ['compare_profiles', 'cumulative', 'default_tolerances', 'default_values', 'draws_at']
__all__ += ['end_of_linearity', 'exact_deviations', 'expected_deviation', 'expected_rms']
__all__ += ['local_sensitivity', 'model', 'morris_screening', 'outcomes', 'planned_study']
__all__ += ['posture', 'probabilities', 'recorded_study', 'scaled', 'scenario_deviations']
__all__ += ['sobol_indices', 'spread_of_passes', 'study_of_plan', 'sweep', 'together']
__all__ += ['tolerance_stack', 'tolerances_from_list', 'with_draws', 'with_known']
