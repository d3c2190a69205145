# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The vocabulary of effects: one physical cause per file, one definition for every use.

Importing this package registers the effect of every file in it; user code adds its own with
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

from .axis_compliance import AxisCompliance as AxisCompliance
from .backlash import Backlash as Backlash
from .backlash import LoadedPlay as LoadedPlay
from .backlash import Stiffening as Stiffening
from .bearing_tilt import BearingTilt as BearingTilt
from .cartesian_compliance import CartesianCompliance as CartesianCompliance
from .clocks import ClockRate as ClockRate
from .clocks import TimeDelay as TimeDelay
from .curves import FrameCurve as FrameCurve
from .curves import JointCurve as JointCurve
from .dated import InstrumentKnock as InstrumentKnock
from .dated import JointSlip as JointSlip
from .dated import SetupSettling as SetupSettling
from .dated import SetupStep as SetupStep
from .dated import ToolSlip as ToolSlip
from .drift import Drift as Drift
from .effect import Effect as Effect
from .effect import LinearEffect as LinearEffect
from .effect import MemoryEffect as MemoryEffect
from .frame_errors import BasePose as BasePose
from .frame_errors import RootPose as RootPose
from .frame_errors import ToolPose as ToolPose
from .friction import Friction as Friction
from .gear_ratio import GearRatio as GearRatio
from .gear_ratio import GearRatioByDirection as GearRatioByDirection
from .geometry import AxisParallelism as AxisParallelism
from .geometry import JointOffset as JointOffset
from .geometry import LinkLength as LinkLength
from .geometry import LinkOffset as LinkOffset
from .geometry import LinkTwist as LinkTwist
from .guide import GuideBend as GuideBend
from .guide import GuideTilt as GuideTilt
from .hose_pull import HosePull as HosePull
from .hysteresis import Hysteresis as Hysteresis
from .joint_compliance import JointCompliance as JointCompliance
from .joint_coupling import JointCoupling as JointCoupling
from .measurement import MeasurementNoise as MeasurementNoise
from .measurement import MeasurementScale as MeasurementScale
from .payload import Payload as Payload
from .pedestal_tilt import PedestalTilt as PedestalTilt
from .quantization import Quantization as Quantization
from .refraction import Refraction as Refraction
from .registry import REGISTRY as REGISTRY
from .registry import effect_from_mapping as effect_from_mapping
from .registry import effects_from_list as effects_from_list
from .registry import register as register
from .servo_lag import ServoLag as ServoLag
from .thermal import LinkWarmUp as LinkWarmUp
from .thermal import ThermalGrowth as ThermalGrowth
from .tool_sag import ToolSag as ToolSag
from .transmission_ripple import TransmissionRipple as TransmissionRipple
from .vibration import Vibration as Vibration
from .view import Parameter as Parameter
from .view import Plausible as Plausible
from .view import Stage as Stage
from .view import View as View
from .wear import Wear as Wear

for _file in iter_modules(__path__):
    import_module(f'.{_file.name}', __name__)
_classes = {_kind.__name__: _kind for _kind in REGISTRY.values()}
globals().update(_classes)  # a line above tells editors of a class; without one it is here as well
__all__ = [
    *('REGISTRY', 'Effect', 'LinearEffect', 'MemoryEffect', 'Parameter', 'Plausible', 'Stage'),
    *('View', 'effect_from_mapping', 'effects_from_list', 'register', *sorted(_classes)),
]
