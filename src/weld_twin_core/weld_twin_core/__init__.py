# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A welding robot's positional accuracy as arrays, without ROS, without files and without plots.

Everything that a program needs is a name of this package; ``import weld_twin_core as wt`` is
the only import. A name loads its module when it is used first, so the import itself is quick.

Units are SI: m, rad, s, N, N m, kg. Temperatures are in degC. Leading axes of an array are
samples. ``T_a_b`` maps coordinates in frame b to coordinates in frame a.

Examples
--------
>>> import numpy as np
>>> import weld_twin_core as wt
>>> robot = wt.load('ur5')
>>> pose = wt.forward(robot, np.zeros(6))
>>> print(pose[:3, 3].round(3), 'm')
[-0.817 -0.191 -0.005] m

"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = '0.1.0'

if TYPE_CHECKING:  # what tools see; at run time `__getattr__` finds the same by `_HOMES`
    from . import effects as effects
    from . import errors as errors
    from . import metrics as metrics
    from . import sensitivity as sensitivity
    from .arm import catalog as catalog
    from .arm import rotation as rotation
    from .arm.catalog import load as load
    from .arm.chain import forward as forward
    from .arm.chain import jacobian as jacobian
    from .arm.dynamics import gravity_torque as gravity_torque
    from .arm.robot import Robot as Robot
    from .diagnosis import Beliefs as Beliefs
    from .diagnosis import Diagnosis as Diagnosis
    from .diagnosis import diagnose as diagnose
    from .effects import Effect as Effect
    from .effects import MemoryEffect as MemoryEffect
    from .effects import Parameter as Parameter
    from .effects import Stage as Stage
    from .effects import View as View
    from .effects import effect_from_mapping as effect_from_mapping
    from .effects import effects_from_list as effects_from_list
    from .effects import register as register
    from .errors import DataError as DataError
    from .errors import ModelError as ModelError
    from .errors import PathError as PathError
    from .errors import ReachError as ReachError
    from .errors import TwinError as TwinError
    from .metrics import DeviationMetrics as DeviationMetrics
    from .metrics import deviation_metrics as deviation_metrics
    from .motion import paths as paths
    from .motion import profiles as profiles
    from .motion.inverse import solve as solve
    from .motion.inverse import solve_path as solve_path
    from .motion.paths import default_seam as default_seam
    from .motion.planned_motion import Plan as Plan
    from .motion.planned_motion import plan as plan
    from .recording import JointMotion as JointMotion
    from .recording import Measurements as Measurements
    from .recording import Recording as Recording
    from .recording import Signal as Signal
    from .twin.compensation import Compensation as Compensation
    from .twin.compensation import compensate as compensate
    from .twin.compensation import corrected as corrected
    from .twin.poses import Poses as Poses
    from .twin.stepping import LiveTwin as LiveTwin
    from .twin.twin import Twin as Twin

_ROOMS = {
    'catalog': 'arm.catalog',
    'effects': 'effects',
    'errors': 'errors',
    'metrics': 'metrics',
    'paths': 'motion.paths',
    'profiles': 'motion.profiles',
    'rotation': 'arm.rotation',
    'sensitivity': 'sensitivity',
}
"""Public names that are modules, and where each is."""
_HOMES = {
    'arm.catalog': ('load',),
    'arm.chain': ('forward', 'jacobian'),
    'arm.dynamics': ('gravity_torque',),
    'arm.robot': ('Robot',),
    'diagnosis': ('Beliefs', 'Diagnosis', 'diagnose'),
    'effects': ('Effect', 'MemoryEffect', 'Parameter', 'Stage', 'View', 'effect_from_mapping')
    + ('effects_from_list', 'register'),
    'errors': ('DataError', 'ModelError', 'PathError', 'ReachError', 'TwinError'),
    'metrics': ('DeviationMetrics', 'deviation_metrics'),
    'motion.inverse': ('solve', 'solve_path'),
    'motion.paths': ('default_seam',),
    'motion.planned_motion': ('Plan', 'plan'),
    'recording': ('JointMotion', 'Measurements', 'Recording', 'Signal'),
    'twin.compensation': ('Compensation', 'compensate', 'corrected'),
    'twin.poses': ('Poses',),
    'twin.stepping': ('LiveTwin',),
    'twin.twin': ('Twin',),
}
"""Every other public name, under the module that defines it."""
__all__ = sorted([*_ROOMS, *(name for names in _HOMES.values() for name in names)])


def __getattr__(name: str) -> Any:
    """Import what a public name stands for, when it is used first (PEP 562)."""
    if name in _ROOMS:
        result: Any = import_module(f'.{_ROOMS[name]}', __name__)
    else:
        home = next((module for module, names in _HOMES.items() if name in names), None)
        if home is None:
            raise AttributeError(
                f'weld_twin_core has no public name {name!r}; dir(weld_twin_core) lists them'
            )
        result = getattr(import_module(f'.{home}', __name__), name)
    globals()[name] = result
    return result


def __dir__() -> list[str]:
    """Return the public names."""
    return [*__all__, '__version__']
