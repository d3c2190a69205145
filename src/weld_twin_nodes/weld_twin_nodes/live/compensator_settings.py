# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of the compensator."""

from __future__ import annotations

import numpy as np

from weld_twin_core.twin.goal_correction import GoalLimits

from .cell_node import CellNode
from .input_settings import JOINT_SETTINGS
from .robot_settings import ROBOT_SETTINGS
from .settings import Setting

COMPENSATOR_SETTINGS = (
    Setting(
        'managed',
        True,
        'work only between the transitions activate and deactivate of a managed node; else at once',
    ),
    *ROBOT_SETTINGS,
    *JOINT_SETTINGS,
    Setting('model', '', 'diagnosis.json of this arm; ~/reload reads it again', live=True),
    Setting(
        'controller',
        'joint_trajectory_controller',
        'controller whose action follow_joint_trajectory corrected goals go to',
    ),
    Setting('apply', False, 'send what is corrected; else tell the correction alone', live=True),
    Setting(
        'on_refusal',
        'stop',
        'what becomes of poses that are refused: stop (nothing is sent) or pass; goals are rejected',
        live=True,
        choices=('stop', 'pass'),
    ),
    Setting('max_correction_m', 2e-3, 'longest way a pose may be moved [m]', 0.0, 0.1, live=True),
    Setting(
        'max_correction_rad',
        float(np.pi / 180.0),
        'largest turn a pose may be moved by [rad]',
        0.0,
        0.2,
        live=True,
    ),
    Setting('max_rate_m_s', 0.05, 'fastest change of that way [m/s]', 1e-6, 10.0, live=True),
    Setting('max_rate_rad_s', 0.2, 'fastest change of that turn [rad/s]', 1e-6, 100.0, live=True),
    Setting(
        'max_acceleration',
        20.0,
        'largest acceleration of a joint in what is corrected [rad/s^2, m/s^2]; the robot file may '
        'say less',
        1e-6,
        1e4,
        live=True,
    ),
    Setting(
        'max_model_age',
        0.0,
        'age of the model file above which nothing is corrected [s]; 0: any',
        0.0,
        1e10,
        live=True,
    ),
    Setting(
        'max_age',
        1.0,
        'age of the last joint state above which it is not known where the arm stands [s]',
        0.05,
        3600.0,
    ),
    Setting('audit', '', 'file that the audit line of every goal is added to; none when empty'),
)


def limits_of(node: CellNode) -> GoalLimits:
    """Return what a correction may do at most, by the parameters of a node."""
    names = ('correction_m', 'correction_rad', 'rate_m_s', 'rate_rad_s', 'acceleration')
    return GoalLimits(*(node.setting(f'max_{name}') for name in names))
