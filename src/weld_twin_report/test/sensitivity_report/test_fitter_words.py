# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Tolerances in the words of a fitter, and gains worked out by hand."""

import pytest

from weld_twin_report.sensitivity_report.study_page import advised, parameter_words, sized

NORMAL = {'distribution': 'normal', 'mean': 0.0, 'std': 1e-3}
ROWS = [
    {'name': 'base_pose.rotvec[1]', 'unit': 'rad', 'tolerance': NORMAL, 'contribution_m': 3e-3},
    {
        'name': 'backlash.elbow_joint.width',
        'unit': 'rad',
        'tolerance': {'distribution': 'uniform', 'low': 0.0, 'high': 1e-3},
        'contribution_m': 4e-3,
    },
]


def test_what_gains_most_comes_first_with_what_is_then_left():
    play, base = advised(ROWS, 5)
    # Of 3 mm and 4 mm, 5 mm together, a fifth of the 4 mm leaves sqrt(9 + 0.64) mm.
    assert play.then_m == pytest.approx(3.10483e-3, rel=1e-5)
    assert play.gain_m == pytest.approx(1.89517e-3, rel=1e-5)
    assert play.instruction == 'preload or renew the gear of elbow_joint'
    assert base.instruction == 'square up the base about the y axis of the measuring frame'
    assert (base.now, base.wanted) == ('0.057° (1 mrad)', '0.011° (0.2 mrad)')


def test_names_are_words_with_an_axis():
    assert parameter_words('base_pose.xyz[2]') == 'base pose error, along z'
    assert parameter_words('joint_offset.joint_3.offset') == 'zero offset of joint_3'
    assert sized(5e-4, 'm') == '0.5 mm'
