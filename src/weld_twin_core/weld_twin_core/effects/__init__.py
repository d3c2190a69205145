# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The vocabulary of effects: one physical cause per file, one definition for every use.

Importing this package registers the bundled effects; user code adds its own with `register`.
"""

from . import (
    axis_parallelism,
    backlash,
    base_pose,
    cartesian_compliance,
    drift,
    gear_ratio,
    joint_compliance,
    joint_coupling,
    joint_offset,
    link_length,
    link_offset,
    link_twist,
    measurement_noise,
    measurement_scale,
    payload,
    quantization,
    servo_lag,
    setup_settling,
    setup_step,
    thermal_growth,
    time_delay,
    tool_pose,
    transmission_ripple,
    vibration,
)
from .effect import Effect, MemoryEffect
from .registry import REGISTRY, effect_from_mapping, effects_from_list, register
from .view import Parameter, Stage, View

__all__ = [
    'REGISTRY',
    'Effect',
    'MemoryEffect',
    'Parameter',
    'Stage',
    'View',
    'axis_parallelism',
    'backlash',
    'base_pose',
    'cartesian_compliance',
    'drift',
    'effect_from_mapping',
    'effects_from_list',
    'gear_ratio',
    'joint_compliance',
    'joint_coupling',
    'joint_offset',
    'link_length',
    'link_offset',
    'link_twist',
    'measurement_noise',
    'measurement_scale',
    'payload',
    'quantization',
    'register',
    'servo_lag',
    'setup_settling',
    'setup_step',
    'thermal_growth',
    'time_delay',
    'tool_pose',
    'transmission_ripple',
    'vibration',
]
