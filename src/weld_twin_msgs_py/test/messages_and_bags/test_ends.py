# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A stream that begins late or ends early is named, and so is what the recorder lacked."""

from __future__ import annotations

import numpy as np
import pytest

from weld_twin_core.arm import catalog
from weld_twin_msgs_py.bags import BagWriter, bag_info, read_recording
from weld_twin_msgs_py.bags.ends import COMPLETENESS, Ends, never_recorded, uneven_ends
from weld_twin_msgs_py.messages.to_messages import bag_messages

SECOND = 1_000_000_000
ROBOT = catalog.load('ur5')


def ends(first, last, step=0.01):
    return Ends(*(round(value * SECOND) for value in (first, last, step)))


def test_streams_that_begin_and_end_within_four_steps_are_even():
    assert uneven_ends({'a': ends(0.0, 10.0), 'b': ends(0.039, 9.961)}) == ()
    assert uneven_ends({'a': ends(0.0, 10.0)}) == ()
    assert uneven_ends({}) == ()


def test_a_late_start_and_an_early_end_are_told_with_their_length():
    found = uneven_ends({'/fast': ends(0.0, 10.0), '/late': ends(1.9, 9.0)})
    assert found == (
        "'/late' begins 1.900 s later than '/fast'",
        "'/late' ends 1.000 s earlier than '/fast'",
    )


def test_a_slow_stream_may_begin_within_four_of_its_own_steps():
    streams = {'/joints': ends(0.0, 60.0), '/temperature': ends(30.0, 40.0, step=10.0)}
    assert uneven_ends(streams) == ()
    streams = {'/joints': ends(0.0, 60.0), '/temperature': ends(41.0, 51.0, step=10.0)}
    assert len(uneven_ends(streams)) == 1


@pytest.mark.parametrize(
    'noted', [{}, {'completeness': 7}, {'completeness': {'/a': 3, '/b': {'missing': 1}}}]
)
def test_what_no_recorder_noted_is_not_told(noted):
    assert never_recorded(noted) == ()


@pytest.fixture
def cut_bag(tmp_path):
    """Return a bag of ten seconds whose poses stop after six, as its recorder noted."""
    make = bag_messages()
    row = {'sent': 500, 'recorded': 301, 'missing': 199, 'where': 'at the end'}
    made = {COMPLETENESS: {'/measured/tool_pose': row, '/joint_states': {'missing': 0}}}
    with BagWriter(tmp_path / 'bag', provenance=made) as bag:
        for k in range(501):
            stamp = SECOND + k * 20_000_000
            q = np.full(ROBOT.n, 0.2 * np.sin(0.01 * k))
            bag.write('/joint_states', make.joint_state(stamp, ROBOT.joint_names, q))
            if k <= 300:
                position = np.array([0.4, 0.1, 0.3 + 1e-4 * k])
                bag.write('/measured/tool_pose', make.pose(stamp, position, np.eye(3)))
    return tmp_path / 'bag'


SENTENCES = (
    "'/measured/tool_pose' lacks 199 of the 500 messages sent, at the end",
    "'/measured/tool_pose' ends 4.000 s earlier than '/joint_states'",
)


def test_info_names_the_stream_that_was_cut(cut_bag):
    info = bag_info(cut_bag)
    assert info.incomplete == SENTENCES
    assert info.notes[:2] == SENTENCES
    assert info.usable


def test_a_recording_carries_what_is_missing_of_it(cut_bag):
    recording = read_recording(cut_bag, ROBOT)
    assert recording.incomplete == SENTENCES
    assert SENTENCES[0] in recording.notes
