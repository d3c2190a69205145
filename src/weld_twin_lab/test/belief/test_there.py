# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Arms that are off by a little everywhere: what is said of a kind of error is there, or is not."""

from dataclasses import replace

import pytest

from weld_twin_lab.belief import trial
from weld_twin_lab.belief.judged import HALF, kept, there
from weld_twin_lab.belief.trial import EVERYWHERE, diagnosed
from weld_twin_lab.blind.cause_sizes import site

pytest.importorskip('mujoco')
SEED, NUMBER = 900003, 2


@pytest.fixture(scope='module')
def tried_once():
    """Return an arm with errors everywhere, what is found of it, and the row of that."""
    told = []

    def noted(case, *recordings, **how):
        told.append((case, diagnosed(case, *recordings, **how)))
        return told[-1][1]

    with pytest.MonkeyPatch.context() as changed:
        changed.setattr(trial, 'diagnosed', noted)
        row = trial.tried(SEED, NUMBER, EVERYWHERE)
    ((case, found),) = told
    return case, found, row


@pytest.fixture
def seen(tried_once):
    return tried_once[:2]


def test_small_errors_stand_at_every_joint(seen):
    case, _ = seen
    joints = set(case.cell.robot.joint_names)
    for kind in ('joint_offset', 'link_length', 'link_twist', 'transmission_ripple'):
        assert {joint for name, joint in map(site, case.causes) if name == kind} == joints


def test_what_is_said_of_the_largest_kinds_is_there(seen):
    case, found = seen
    parts = there(case, found)
    assert len(parts) >= 3
    assert all(0.8 < part['name'] < 1.2 for part in parts[:3])


def test_nothing_of_a_kind_is_there_once_it_is_taken_out_of_the_arm(seen):
    case, found = seen
    kind = found.causes[0].name[0][0].effect
    rest = [cause for cause in case.causes if cause['effect'] != kind]
    assert there(replace(case, causes=rest), found)[0]['name'] < HALF


def test_a_row_keeps_a_statement_for_every_kind(tried_once):
    row = kept(tried_once[2])
    names = [right for kind, _, right, *_ in row['examples'] if kind == 'name of many']
    assert len(names) >= 3
    assert row['kind'] == EVERYWHERE
