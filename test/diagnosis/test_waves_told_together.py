# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Waves that no recording by itself can tell are found where all of them together can."""

from diagnosis_cells import recorded, sites

from weld_twin_core.arm.catalog import load
from weld_twin_core.diagnosis import diagnose


def test_a_fine_ripple_that_two_short_recordings_tell_together_is_named():
    # 24 stations over four radians tell waves up to 18 to a turn, twice as many up to 36.
    robot = load('ur5')
    ripple = {'effect': 'transmission_ripple', 'joint': 'elbow_joint'}
    ripple |= {'amplitude': 4e-4, 'order': 29, 'phase': 0.7}
    runs = [recorded(robot, [ripple], seed, static=24, name=f'run {seed}') for seed in (3, 4)]
    found = diagnose(runs, robot, experiment=False)
    assert sites(found) == [{('transmission_ripple', 'elbow_joint')}]
    assert found.effects[0].effect.order == 29
    assert found.status == 'identified'
