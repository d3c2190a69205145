# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The vocabulary of effects: physical causes, each defined once for every use.

Importing this package registers the effects of every file in it; user code adds its own with
`register`.
Every effect is a frozen dataclass. Its fields are the parameters that the page of effects lists,
in SI units; effects of a joint or a link take the name of the joint first.

Examples
--------
>>> import weld_twin_core as wt
>>> play = wt.effects.Backlash('elbow_joint', width=5e-4)
>>> play.to_mapping()
{'effect': 'backlash', 'joint': 'elbow_joint', 'width': 0.0005}

"""

from importlib import import_module
from pkgutil import iter_modules

from .backlash import Backlash, LoadedPlay, Stiffening
from .bearings import BearingTilt, GuideBend, GuideTilt
from .compliance import AxisCompliance, CartesianCompliance, JointCompliance, PedestalTilt, ToolSag
from .curves import FrameCurve, JointCurve
from .dated import InstrumentKnock, JointSlip, SetupSettling, SetupStep, ToolSlip
from .effect import Effect, LinearEffect, MemoryEffect
from .gear_ratio import GearRatio, GearRatioByDirection, JointCoupling
from .geometry import (
    AxisParallelism,
    BasePose,
    JointOffset,
    LinkLength,
    LinkOffset,
    LinkTwist,
    RootPose,
    ToolPose,
)
from .instrument import ClockRate, Drift, MeasurementNoise, MeasurementScale, Refraction, TimeDelay
from .loads import HosePull, Payload
from .quantization import Quantization
from .registry import REGISTRY, effect_from_mapping, effects_from_list, register
from .rubbing import Friction, Hysteresis
from .servo_lag import ServoLag, Vibration
from .thermal import JointWarmUp, LinkWarmUp, ThermalGrowth
from .transmission_ripple import TransmissionRipple
from .view import Parameter, Plausible, Stage, View
from .wear import Wear

__all__ = ['REGISTRY', 'AxisCompliance', 'AxisParallelism', 'Backlash', 'BasePose', 'BearingTilt']
__all__ += ['CartesianCompliance', 'ClockRate', 'Drift', 'Effect', 'FrameCurve', 'Friction']
__all__ += ['GearRatio', 'GearRatioByDirection', 'GuideBend', 'GuideTilt', 'HosePull']
__all__ += ['Hysteresis', 'InstrumentKnock', 'JointCompliance', 'JointCoupling', 'JointCurve']
__all__ += ['JointOffset', 'JointSlip', 'LinearEffect', 'LinkLength', 'LinkOffset', 'LinkTwist']
__all__ += ['JointWarmUp', 'LinkWarmUp', 'LoadedPlay', 'MeasurementNoise', 'MeasurementScale']
__all__ += ['MemoryEffect', 'Parameter', 'Payload', 'PedestalTilt', 'Plausible', 'Quantization']
__all__ += ['Refraction', 'RootPose', 'ServoLag', 'SetupSettling', 'SetupStep', 'Stage']
__all__ += ['Stiffening', 'ThermalGrowth', 'TimeDelay', 'ToolPose', 'ToolSag', 'ToolSlip']
__all__ += ['TransmissionRipple', 'Vibration', 'View', 'Wear', 'effect_from_mapping']
__all__ += ['effects_from_list', 'register']

for _file in iter_modules(__path__):
    import_module(f'.{_file.name}', __name__)
_classes = {_kind.__name__: _kind for _kind in REGISTRY.values()}
globals().update(_classes)  # a line above tells editors of a class; without one it is here as well
__all__ += sorted(set(_classes) - set(__all__))
