# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What an oracle that knows the plant is sure of, and what is said of arms off by a little."""

from dataclasses import replace

import numpy as np
import pytest

from weld_twin_lab.belief import oracle, trial
from weld_twin_lab.belief.judged import HALF, kept, there
from weld_twin_lab.belief.trial import EVERYWHERE, SEVERAL, diagnosed, drawn
from weld_twin_lab.blind.cause_sizes import site

pytest.importorskip('mujoco')


@pytest.fixture
def case():
    """One cause at stations: a twist, of a size that shows."""
    case = drawn(4401, 330, SEVERAL).case
    assert (case.lot.motion, case.lot.families) == ('stations', ('link_twist',))
    return case


def sure_of(case, times):
    """How sure the oracle is of the case's cause at so many times its size, against few others."""
    grown = replace(case, causes=[oracle.scaled(case.causes[0], times)])
    return oracle.of_one(grown, 0, SEVERAL, np.random.default_rng(1))


def test_what_shows_is_sure_and_what_does_not_is_shared(case, monkeypatch):
    monkeypatch.setattr(oracle, 'FAMILIES', ('link_twist', 'joint_offset', 'axis_parallelism'))
    monkeypatch.setattr(oracle, 'DRAWS', 1)
    monkeypatch.setattr(oracle, 'STRATA', ((1e-3, 1.0), (1.0, 100.0)))
    plain, faint = sure_of(case, 1.0), sure_of(case, 0.02)
    assert plain > 0.99
    assert faint > 0.99  # what differs by less than the noise predicts as well
    monkeypatch.setattr(oracle, 'AS_WELL', 0.0)
    assert sure_of(case, 0.02) < 0.2  # any of the others does as well


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


def test_small_errors_stand_at_every_joint_and_are_there_until_they_are_taken_out(seen):
    case, _ = seen
    joints = set(case.cell.robot.joint_names)
    for kind in ('joint_offset', 'link_length', 'link_twist', 'transmission_ripple'):
        assert {joint for name, joint in map(site, case.causes) if name == kind} == joints
    case, found = seen
    parts = there(case, found)
    assert len(parts) >= 3
    assert all(0.8 < part['name'] < 1.2 for part in parts[:3])
    case, found = seen
    kind = found.causes[0].name[0][0].effect
    rest = [cause for cause in case.causes if cause['effect'] != kind]
    assert there(replace(case, causes=rest), found)[0]['name'] < HALF


def test_a_row_keeps_a_statement_for_every_kind(tried_once):
    row = kept(tried_once[2])
    names = [right for kind, _, right, *_ in row['examples'] if kind == 'name of many']
    assert len(names) >= 3
    assert row['kind'] == EVERYWHERE
