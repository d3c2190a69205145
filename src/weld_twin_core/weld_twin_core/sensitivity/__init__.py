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

from .evaluate import Model, draws_at, model
from .indices import (
    MorrisDesign,
    Screening,
    SobolDesign,
    SobolIndices,
    morris_screening,
    sobol_indices,
)
from .local import LocalSensitivity, local_sensitivity
from .seam_study import (
    Outcomes,
    Study,
    ToleranceStack,
    WeldTolerance,
    planned_study,
    probabilities,
    recorded_study,
    study_of_plan,
    tolerance_stack,
)
from .sweep import Sweep, default_values, sweep
from .tolerance import Distribution, Tolerance, default_tolerances, scaled, tolerances_from_list
from .trajectory_advice import (
    PlacementResult,
    ProfileResult,
    Room,
    advise,
    compare_profiles,
    expected_deviation,
)

__all__ = ['Distribution', 'LocalSensitivity', 'Model', 'MorrisDesign', 'Outcomes']
__all__ += ['PlacementResult', 'ProfileResult', 'Room', 'Screening', 'SobolDesign', 'SobolIndices']
__all__ += ['Study', 'Sweep', 'Tolerance', 'ToleranceStack', 'WeldTolerance', 'advise']
__all__ += ['compare_profiles', 'default_tolerances', 'default_values', 'draws_at']
__all__ += ['expected_deviation', 'local_sensitivity', 'model', 'morris_screening']
__all__ += ['planned_study', 'probabilities', 'recorded_study', 'scaled', 'sobol_indices']
__all__ += ['study_of_plan', 'sweep', 'tolerance_stack', 'tolerances_from_list']
