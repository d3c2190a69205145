# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Corrections that are written down do the same again, and many trials at once are each alone."""

import json
from dataclasses import replace
from functools import partial
from itertools import islice

import numpy as np
import pytest
from measured_cells import anywhere, moving, recorded, stations

from weld_twin_core import ModelError, load
from weld_twin_core.diagnosis.algebra.problem import Model, Problem
from weld_twin_core.diagnosis.frames.alignment import TOGETHER
from weld_twin_core.diagnosis.soundness import mending
from weld_twin_core.diagnosis.soundness.mending import Given, as_entry, replayed
from weld_twin_core.diagnosis.soundness.snapshot import FRAMES, rough_models, snapshot
from weld_twin_core.diagnosis.soundness.suspicions import suspicions
from weld_twin_core.effects import JointOffset

TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
MADE = {
    'joints': {'matrix': np.eye(6)[[0, 1, 2, 4, 3, 5]], 'offset': np.arange(6.0)},
    'positions': {'factor': np.array([1.0, -1.0, 1e-3])},
    'orientations': {'way': 'w_first'},
    'robot': {'name': 'ur10'},
    'frames': {'frames': frozenset({'tool', 'base'})},
    'base': {'turn': TURN},
    'stamps': {'k': 0, 'late': 0.3, 'rate': 1e-4, 'middle': 5.0},
    'velocities': {'k': 0},
    'poses_inverted': {},
    'even_stamps': {'k': 0, 'first': 0.1, 'step': 0.02, 'lost': (5, 9), 'count': 100},
    'rows': {'k': 0, 'reading': [0, 2, 4], 'station': np.array([1, 2, 5]), 'count': 1200},
    'may_change': {'families': ('tool_pose',)},
}


def test_every_kind_is_tried_here():
    assert set(MADE) == set(mending.MENDS)


@pytest.mark.parametrize('kind', MADE)
def test_a_correction_that_was_written_down_does_the_same_again(kind, ur5, rng):
    recording = recorded(ur5, moving(ur5, rng), rng)
    given = Given((recording,), ur5, frozenset({'tool'}))
    mend = partial(mending.MENDS[kind], **MADE[kind])
    entry = json.loads(json.dumps(as_entry(mend)))
    once, again = mend(given), replayed([entry], given)
    assert once.align == again.align and once.robot.name == again.robot.name
    np.testing.assert_array_equal(once.robot.T_world_base, again.robot.T_world_base)
    one, other = once.recordings[0], again.recordings[0]
    for name in ('t', 'q'):
        np.testing.assert_array_equal(getattr(one.joints, name), getattr(other.joints, name))
    for name in ('t', 'position', 'rotation'):
        np.testing.assert_array_equal(getattr(one.measured, name), getattr(other.measured, name))
    assert (one.joints.qd is None) == (other.joints.qd is None)


def test_the_map_of_a_models_readings_does_what_its_corrections_do_one_after_the_other(ur5, rng):
    recording = recorded(ur5, moving(ur5, rng), rng)
    again = {'matrix': np.diag([1.0, -1.0, 1.0, 1.0, 0.5, 1.0]), 'offset': np.full(6, 0.2)}
    made = [*((kind, MADE[kind]) for kind in ('positions', 'joints', 'base')), ('joints', again)]
    entries = tuple(as_entry(partial(mending.MENDS[kind], **how)) for kind, how in made)
    matrix, offset = Model(ur5, (ur5.T_world_base,), mends=entries).reading_map()
    wanted = replayed(entries, Given((recording,), ur5)).recordings[0].joints.q
    np.testing.assert_allclose(recording.joints.q @ matrix.T + offset, wanted, atol=1e-12)


def test_clocks_are_of_one_recording_alone(ur5, rng):
    given = Given((recorded(ur5, moving(ur5, rng), rng),), ur5)
    entry = as_entry(partial(mending.stamps_as, k=1, late=0.3, rate=0.0, middle=0.0))
    assert replayed([entry], given, 0) is given
    t = replayed([entry], given, 1).recordings[0].joints.t
    np.testing.assert_allclose(t - given.recordings[0].joints.t, 0.3)


@pytest.mark.parametrize(
    'entry',
    [{'do': 'magic'}, {}, {'do': 'joints', 'matrix': [[1.0]], 'offset': [0.0]}, {'do': 'base'}],
)
def test_a_correction_that_does_not_fit_is_refused(entry, ur5, rng):
    with pytest.raises(ModelError, match='correction'):
        replayed([entry], Given((recorded(ur5, moving(ur5, rng), rng),), ur5))


def shot_of(robot, rng, points, count=1):
    """Return stations of an arm with wrong zeros that stands elsewhere, as a snapshot."""
    tool = anywhere(rng, 0.1)
    bent = [JointOffset(name, 2e-3 * rng.standard_normal()) for name in robot.joint_names]
    recordings = tuple(
        recorded(
            robot.with_frames(base=anywhere(rng, 2.0), tool=tool),
            stations(robot, rng, 30),
            rng,
            effects=bent,
            points=points,
        )
        for _ in range(count)
    )
    model = Model(robot, tuple(robot.T_world_base for _ in recordings))
    motions = [r.joints.q for r in recordings]
    return snapshot(Problem(recordings, FRAMES), model, motions)


@pytest.mark.parametrize('points', [False, True])
def test_many_trials_at_once_are_each_of_them_alone(points, rng):
    shot = shot_of(load('ur5'), rng, points)
    trials = [shot.mended(each.mend) for each in islice(suspicions(shot.robot), 0, None, 5)]
    assert len(trials) > TOGETHER
    for thorough in (False, True):
        together = rough_models(trials, thorough=thorough)
        for trial, model in zip(trials, together, strict=True):
            alone = rough_models([replace(trial)], thorough=thorough)[0]
            assert trial.gap(model) == pytest.approx(trial.gap(alone), rel=1e-6)
