# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Logs of the RTDE client of Universal Robots, with blanks between the columns."""

from ..formats import Format, form

_RTDE = (
    (r'^timestamp$', 'time [s]'),
    (r'^actual_q_(\d)$', r'actual_q_\1 [rad]'),
    (r'^target_q_(\d)$', r'target_q_\1 [rad]'),
)
form(Format('RTDE of Universal Robots', r'\A(?:\S+ )*actual_q_0 ', r'actual_q_0 ', _RTDE, ' '))
