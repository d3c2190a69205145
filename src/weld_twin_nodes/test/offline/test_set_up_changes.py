# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a person changed in the cell for one recording reaches the diagnosis of several."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import weld_twin_core as wt
from weld_twin_core.errors import DataError
from weld_twin_nodes.offline.set_up_changes import set_up_change, with_changes

SPRING = wt.effects.JointCompliance('shoulder_lift_joint', compliance=1e-5)


@pytest.fixture(scope='module')
def ur5():
    return wt.load('ur5')


@pytest.fixture
def stations():
    q = np.array([0.2, -1.3, 1.5, -1.8, -1.5, 0.1]) + np.random.default_rng(4).uniform(
        -1, 1, (9, 6)
    )
    return wt.Recording('stations', wt.JointMotion(15.0 * np.arange(9), q, static=True))


@pytest.mark.parametrize('words', ['load=5', 'load=5,0.02,-0.01,0.15'])
def test_a_load_that_is_told_pulls_like_one_in_the_robot_file(ur5, stations, words):
    change = set_up_change(words)
    turned = ur5.with_frames(base=_frame([0.0, 0.0, 0.6], [1.0, 0.2, 0.0]))
    heavy = replace(
        turned, payload_mass=5.0, payload_com=np.array(change.numbers[1:] or (0, 0, 0))
    )
    (loaded,), may_change = with_changes([stations], {0: change}, turned)
    sagging = wt.Twin(turned, [SPRING]).poses(loaded)
    assert may_change == ()
    assert np.allclose(
        sagging.position, wt.Twin(heavy, [SPRING]).poses(stations).position, atol=1e-9
    )
    bare = wt.Twin(turned, [SPRING]).poses(stations)
    assert np.abs(bare.position - sagging.position).max() > 1e-5


def test_a_load_that_was_taken_off_leaves_what_is_still_there(ur5, stations):
    whole = replace(ur5, payload_mass=3.0)
    (lighter,), _ = with_changes([stations], {0: set_up_change('load=-1.25')}, whole)
    left = wt.Twin(replace(ur5, payload_mass=1.75), [SPRING]).poses(stations)
    assert np.allclose(left.position, wt.Twin(whole, [SPRING]).poses(lighter).position, atol=1e-9)


def test_forces_that_were_measured_hold_the_load_already(ur5, stations):
    pull = wt.Signal(stations.joints.t, np.ones((9, 6)))
    measured = replace(stations, wrench=pull)
    assert with_changes([measured], {0: set_up_change('load=5')}, ur5)[0][0].wrench is pull


def test_an_instrument_elsewhere_measures_in_the_frame_of_before(ur5, stations):
    seen = wt.Twin(ur5).poses(stations)
    turn = Rotation.from_rotvec([0.1, -0.4, 1.9]).as_matrix()
    elsewhere = stations.with_measured(
        wt.Measurements(
            stations.joints.t, seen.position @ turn.T + [1.5, 0.2, -0.3], turn @ seen.rotation
        )
    )
    out, may_change = with_changes([stations, elsewhere], {1: set_up_change('instrument')}, ur5)
    assert may_change == ('base_pose',)
    assert np.allclose(out[1].measured.position, seen.position, atol=1e-9)
    assert np.allclose(out[1].measured.rotation, seen.rotation, atol=1e-9)


def test_another_tool_may_differ_and_is_left_as_measured(ur5, stations):
    out, may_change = with_changes([stations, stations], {1: set_up_change('tool')}, ur5)
    assert may_change == ('tool_pose',) and out[1] is stations
    with pytest.raises(DataError, match='the first recording is what the others'):
        with_changes([stations, stations], {0: set_up_change('tool')}, ur5)


@pytest.mark.parametrize(
    'words', ['', 'load', 'load=', 'load=x', 'load=0', 'load=-2000', 'load=1,2', 'tool=0.2']
)
def test_other_words_are_refused(words):
    with pytest.raises(DataError, match=r'what was changed is|a load is given in kg'):
        set_up_change(words)


def _frame(rotvec, shift):
    frame = np.eye(4)
    frame[:3, :3] = Rotation.from_rotvec(rotvec).as_matrix()
    frame[:3, 3] = shift
    return frame
