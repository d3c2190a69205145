# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Entries of effects files for tests that hold for every effect, also for one that is new."""

from weld_twin_core.effects import REGISTRY

OF_CELLS = {'root_pose', 'guide_bend', 'guide_tilt'}
"""Effects of robots beside a positioner, or on a track; tested in test_cells."""

ENTRIES = {
    'base_pose': {'xyz': [1e-3, 2e-3, 0.0], 'rotvec': [1e-2, 0.2, 0.1]},
    'tool_pose': {'xyz': [1e-3, 2e-3, 0.1], 'rotvec': [1e-2, 0.2, 0.1]},
    'joint_curve': {'joint': 'j1', 'values': [1e-4, -2e-4, 4e-4], 'knots': [-1.0, 0.2, 1.5]},
    'frame_curve': {'xyz': [0.0, 1e-6] * 3, 'rotvec': [0.0, 1e-6] * 3, 'knots': [0.0, 4.0]},
    'transmission_ripple': {
        'joint': 'j1',
        'amplitude': [1e-4, 2e-4],
        'order': [3, 50],
        'phase': [0.3, 0.2],
    },
    'joint_coupling': {'joint': 'j3', 'source': 'j4', 'ratio': 1e-3},
    'gear_ratio_by_direction': {'joint': 'j2', 'difference': 1e-2, 'travel': 0.02},
    'hysteresis': {'joint': 'j2', 'amplitude': 1e-3, 'travel': 0.2},
    'friction': {'joint': 'j2', 'windup': 5e-3, 'asymmetry': -0.2, 'travel': 0.1, 'recovery': 1.5},
    'loaded_play': {'joint': 'j1', 'width': 1e-4, 'torque': 20.0},
    'stiffening': {'joint': 'j1', 'compliance': 1e-6, 'torque': 20.0},
    'bearing_tilt': {
        'joint': 'j1',
        'lean': [1e-3, 2e-3, 3e-3, -1e-3],
        'second': [1e-4, 2e-4, -3e-4, 1e-4],
    },
    'payload': {'mass': 2.0, 'com': [0.01, 0.02, 0.03]},
    'servo_lag': {'joint': 'j3', 'time_constant': 0.01},
    'link_warm_up': {'joint': 'j2', 'strain': 1e-3, 'warming_time': 20.0},
    'joint_warm_up': {'joint': 'j2', 'offset': 1e-3, 'warming_time': 20.0},
    'vibration': {'joint': 'j2', 'frequency': 4.0, 'damping': 0.05, 'gain': 0.3},
    'hose_pull': {'force': [10.0, -20.0, 30.0], 'stiffness': 40.0},
    'axis_compliance': {'joint': 'j3', 'compliance': 2e-6},
    'tool_sag': {'sag': [2e-5 * k for k in range(9)]},
    'refraction': {'warming': [1.0, -2.0, 3.0]},
}
"""By its name the entry of an effect that typical sizes do not do for."""


def bundled():
    """Return the effects of the package."""
    return [kind for kind in REGISTRY.values() if kind.__module__.startswith('weld_twin')]


def usual(without=()):
    """Return the entry of every effect of an arm: a special one, else with typical sizes on j1."""
    names = [kind for kind in bundled() if kind.name not in {*OF_CELLS, *without}]
    return {kind.name: ENTRIES.get(kind.name) or _typical(kind) for kind in names}


def _typical(kind):
    sizes = {
        p.name: p.typical if p.size < 2 else [p.typical * (k + 1) for k in range(p.size)]
        for p in kind.parameters
    }
    return sizes | ({'joint': 'j1'} if kind.of in ('joint', 'link') else {})
