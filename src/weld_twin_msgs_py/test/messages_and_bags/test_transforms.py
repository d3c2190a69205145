# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames that `/tf` tells of: ways between them, at any time, and ways there are none."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.assembly.frames import NoTransform, NotYet, TransformTree
from weld_twin_msgs_py.messages.cdr import (
    Header,
    TFMessage,
    Time,
    Transform,
    TransformStamped,
    Xyz,
    Xyzw,
)

S = 1_000_000_000


def told(parent, child, position=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0), at=0.0):
    """Return a message with one transform; the oracle of the turn is scipy's."""
    q = Rotation.from_rotvec(turn).as_quat()
    stamp = Time(*divmod(round(at * S), S))
    where = Transform(Xyz(*position), Xyzw(*q))
    return TFMessage((TransformStamped(Header(stamp, parent), child, where),))


def matrix(position, turn):
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = Rotation.from_rotvec(turn).as_matrix(), position
    return out


A, TURN_A = (1.0, 2.0, 3.0), (0.3, -0.2, 0.9)
B, TURN_B = (-0.5, 0.1, 0.4), (-1.0, 0.4, 0.2)


@pytest.fixture
def tree():
    """A world with tracker and base_link, which has tool0."""
    out = TransformTree()
    out.take(told('world', 'tracker', A, TURN_A), static=True)
    out.take(told('/world', 'base_link', B, TURN_B), static=True)
    out.take(told('base_link', 'tool0', (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), 1.0))
    out.take(told('base_link', 'tool0', (0.0, 0.2, 1.0), (0.0, 0.0, 1.0), 2.0))
    return out


def test_the_way_between_siblings_goes_over_their_parent(tree):
    expected = np.linalg.inv(matrix(A, TURN_A)) @ matrix(B, TURN_B)
    np.testing.assert_allclose(tree.between('tracker', 'base_link', 0), expected, atol=1e-14)
    assert not tree.moves('tracker', 'base_link')
    assert tree.moves('tracker', 'tool0')
    np.testing.assert_array_equal(tree.between('tracker', 'tracker', 5), np.eye(4))


def test_between_two_places_a_frame_goes_straight_and_turns_evenly(tree):
    where = tree.between('base_link', 'tool0', round(1.25 * S))
    np.testing.assert_allclose(where, matrix((0.0, 0.05, 1.0), (0.0, 0.0, 0.25)), atol=1e-12)
    np.testing.assert_allclose(tree.between('base_link', 'tool0', S)[:3, 3], (0.0, 0.0, 1.0))


def test_what_is_not_told_yet_or_was_too_long_ago_is_no_place(tree):
    with pytest.raises(NotYet, match=r"last transform of 'tool0' in 'base_link' is 3 s older"):
        tree.between('world', 'tool0', 5 * S)
    with pytest.raises(NoTransform, match=r'is 0.5 s newer'):
        tree.between('world', 'tool0', S // 2)
    tree.take(told('base_link', 'tool0', at=3.5))
    with pytest.raises(NoTransform, match=r'have a hole of 1.5 s around'):
        tree.between('world', 'tool0', 3 * S)
    for k in range(4, 20):
        tree.take(told('base_link', 'tool0', at=float(k)))
    with pytest.raises(NoTransform, match='is 6 s newer'):
        tree.between('world', 'tool0', 3 * S)


def test_frames_that_nothing_joins_are_named(tree):
    with pytest.raises(NoTransform, match=r"from 'probe' to 'world' is not known: 'probe' is not"):
        tree.between('world', 'probe', 0)
    tree.take(told('island', 'palm'), static=True)
    with pytest.raises(NoTransform, match='nothing in /tf joins them'):
        tree.between('world', 'palm', 0)


def test_a_loop_is_refused_and_the_tree_stands(tree):
    with pytest.raises(
        DataError, match=r"'world' makes a loop: 'world' in 'tool0' in 'base_link'"
    ):
        tree.take(told('tool0', 'world', at=3.0))
    with pytest.raises(DataError, match='makes a loop'):
        tree.take(told('a', 'a'))
    assert tree.between('world', 'tracker', 0)[0, 3] == A[0]


@pytest.mark.parametrize('spoilt', [{'position': (0.0, np.nan, 0.0)}, {'turn': (np.inf,) * 3}])
def test_a_transform_that_is_none_is_refused(tree, spoilt):
    message = told('world', 'x', spoilt.get('position', (0.0, 0.0, 0.0)))
    if 'turn' in spoilt:
        each = message.transforms[0]
        each = each._replace(transform=each.transform._replace(rotation=Xyzw(0.0, 0.0, 0.0, 0.0)))
        message = TFMessage((each,))
    with pytest.raises(DataError, match="'x'"):
        tree.take(message)


def test_a_frame_may_get_another_parent_and_time_may_begin_anew(tree):
    tree.take(told('tracker', 'tool0', at=3.0))
    assert tree.parent('tool0') == 'tracker'
    tree.take(told('tracker', 'tool0', at=100.0))
    tree.take(told('tracker', 'tool0', (0.5, 0.0, 0.0), at=1.0))  # the clock went back
    assert tree.between('tracker', 'tool0', S)[0, 3] == 0.5
    tree.clear()
    assert tree.parent('tool0') == ''
    assert tree.parent('tracker') == 'world'
