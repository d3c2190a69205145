# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Goals of a trajectory controller: the robot's joints out of them, and corrected ones back."""

from types import SimpleNamespace

import numpy as np
import pytest

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.messages.goals import corrected_trajectory, read_goal


def trajectory(names=('track', 'left_b', 'left_a'), velocities=(), count=3):
    """Return two points, a second apart, of a track and two joints in another order."""
    points = [
        SimpleNamespace(
            positions=[0.5 + k, 0.1 + k, 0.2 + k][:count],
            velocities=list(velocities),
            accelerations=[],
            time_from_start=SimpleNamespace(sec=k, nanosec=900_000_000),
        )
        for k in range(2)
    ]
    return SimpleNamespace(joint_names=list(names), points=points)


@pytest.mark.parametrize('velocities', [(), (7.0, 8.0, 9.0)])
def test_corrected_joints_go_where_they_came_from_and_all_else_stays(velocities):
    given = trajectory(velocities=velocities)
    goal, columns = read_goal(given, ('a', 'b'))
    np.testing.assert_array_equal(goal.q, [[0.2, 0.1], [1.2, 1.1]])
    np.testing.assert_array_equal(goal.t, [0.9, 1.9])
    rates = np.array([[9.0, 8.0]] * 2) if velocities else None
    assert (goal.qd is None) is (rates is None) and goal.qdd is None
    moved = goal._replace(q=goal.q + [10.0, 20.0], qd=None if rates is None else rates + 1.0)
    made = corrected_trajectory(given, columns, moved, 0.25)
    assert [point.positions for point in made.points] == [[0.5, 20.1, 10.2], [1.5, 21.1, 11.2]]
    fast = [7.0, 9.0, 10.0] if velocities else []
    assert [(point.velocities, point.accelerations) for point in made.points] == [(fast, [])] * 2
    since = [(point.time_from_start.sec, point.time_from_start.nanosec) for point in made.points]
    assert since == [(1, 150_000_000), (2, 150_000_000)]
    assert given.points[0].positions == [0.5, 0.1, 0.2]


@pytest.mark.parametrize(
    ('given', 'said'),
    [
        (trajectory(count=2), 'every point of the goal must have 3 positions'),
        (trajectory(velocities=(1.0,)), 'has 3 velocities, or none has any'),
        (trajectory(('track', 'a', 'a')), "names joint 'a' twice"),
        (trajectory(('track', 'a', 'c')), "has no joint 'b'; it has track, a, c"),
    ],
)
def test_goals_that_cannot_be_corrected_are_refused(given, said):
    with pytest.raises(DataError, match=said):
        read_goal(given, ('a', 'b'))
