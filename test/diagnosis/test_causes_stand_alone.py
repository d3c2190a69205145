# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Cells of the plant with several causes at once: each is told by itself, and nobody else is."""

import json
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from diagnosis_cells import SIGMA, all_but, recorded, sites, solved

from weld_twin_core import View, diagnose, load
from weld_twin_core.diagnosis.algebra.problem import Problem
from weld_twin_core.diagnosis.result import NAMING
from weld_twin_core.diagnosis.unseen.folds import posture_regions
from weld_twin_core.effects.gear_ratio import JointCoupling
from weld_twin_report.report.diagnosis_files import diagnosis_text

ARM = 'kuka_kr6_r900'
TRUE = (
    {'effect': 'backlash', 'joint': 'joint_a1', 'width': 7e-4},
    {'effect': 'link_length', 'joint': 'joint_a2', 'da': -5e-4},
    {'effect': 'link_twist', 'joint': 'joint_a3', 'dalpha': 9e-4},
    {'effect': 'joint_compliance', 'joint': 'joint_a2', 'compliance': 1.2e-5},
    {'effect': 'gear_ratio', 'joint': 'joint_a5', 'scale': 6e-4},
)
NOISE = float(np.sqrt(3.0)) * SIGMA


def cell(causes=TRUE, **options):
    """Return 60 stations all over the workspace, or what the options say."""
    return recorded(load(ARM), list(causes), **{'static': 60, **options})


@cache
def found(exclude=()):
    return diagnose([cell()], load(ARM), align='base,tool', exclude=exclude, experiment=False)


def holding(diagnosis):
    """Return which of the true causes are told, alone or in a set."""
    told = sites(diagnosis)
    return [any((c['effect'], c['joint']) in group for group in told) for c in TRUE]


def test_five_causes_at_once_are_all_named_and_nobody_else_is():
    told = found()
    assert told.status in NAMING and all(holding(told)), told.reasons
    assert len(told.effects) == len(TRUE)
    assert told.shrink.rms_after_m < 1.7 * NOISE
    guilty = {c['joint'] for c in TRUE}
    assert {cause.place[0][0] for cause in told.causes} <= guilty


def test_each_cause_says_which_effect_it_is_and_the_shares_make_a_whole():
    verdict = json.loads(diagnosis_text(found(), ()))
    told, left = verdict['verdict'], verdict['unexplained']
    causes = [cause for cause in told['causes'] if not cause['rest']]
    assert sorted(cause['effect'] for cause in causes) == list(range(len(TRUE)))
    for cause in causes:
        effect = told['effects'][cause['effect']]
        names = [(name['effect'], name['joint']) for name in cause['name']]
        assert (effect['effect'], effect['joint']) in names
        group = told['indistinguishable'][cause['effect']]
        assert (effect['effect'], effect['joint']) in [(s['effect'], s['joint']) for s in group]
        named = sum(name['probability'] for name in cause['name'])
        assert named <= cause['probability'] + 1e-9
    shares = sum(cause['share'] for cause in causes)
    assert shares + left['share'] + left['noise_share'] == pytest.approx(1.0)
    assert told['learned'] == told['confidence'] and told['sure'] in (True, False)


def test_with_a_family_taken_out_the_others_are_told_and_that_something_is_left():
    told = found(exclude=('link_twist',))
    held = [own for own, c in zip(holding(told), TRUE, strict=True) if c['effect'] != 'link_twist']
    assert sum(held) >= 3, sites(told)
    whole = told.as_dict()
    (rest,) = [c for c in whole['verdict']['causes'] if c['rest']] or [None]
    assert rest is None or rest['share'] == pytest.approx(whole['unexplained']['share'])
    assert told.status == 'unknown' or rest is not None or not told.sure


def test_short_recordings_with_bases_of_their_own_predict_each_other():
    few, others = (TRUE[0], TRUE[3]), all_but(*(cause['effect'] for cause in TRUE))
    parts = [
        cell(few, static=count, seed=seed, name=f'part {seed}')
        for seed, count in ((1, 16), (2, 5), (3, 20))
    ]
    told = diagnose(parts, load(ARM), align='base,tool', exclude=others, experiment=False)
    assert told.status in NAMING
    assert told.shrink.rms_after_m < 1.7 * NOISE


def test_no_part_left_out_takes_a_recording_with_it():
    parts = tuple(cell((), static=count, seed=count) for count in (16, 5, 20))
    problem = Problem(parts, frozenset({'base'}))
    starts = np.cumsum([0, *(r * m for r, m in zip(problem.rows, problem.samples, strict=True))])
    for labels in (problem.block_labels(8), posture_regions(problem)):
        for low, high in pairwise(starts):
            own = labels[low:high]
            assert np.bincount(own.astype(int)).max() <= 0.5 * own.size + problem.rows[0]
    alone = replace(problem, align=frozenset())
    assert len(set(alone.block_labels(8))) == 8


def test_the_place_of_a_cause_that_was_taken_out_is_where_its_formula_fits():
    # Curves of the tool over the time stood in for a wrist that follows its neighbour.
    follows = ('joint', 'elbow_joint', 'source', 'shoulder_lift_joint', 'ratio', 1e-3)
    answer = solved(('joint_coupling', *follows), exclude=('joint_coupling',))
    assert answer.status == 'unknown'
    first, *others = answer.causes
    assert first.place[0][0] == 'elbow_joint'
    assert first.dependence[0][0] == 'angle'
    assert 'joint_coupling' not in {site.effect for site, _ in first.name}
    assert not any(cause.place[0][1] > 0.5 for cause in others if cause.place)


def test_a_curve_of_the_base_over_the_time_is_one_cause_and_not_two_of_one_share():
    wandered = ('drift', 'xyz_rate', (2e-5, -1e-5, 3e-5))
    answer = solved(wandered, exclude=('drift',), seconds=20.0)
    held = [cause.members for cause in answer.causes]
    assert answer.status == 'unknown' and any(held), answer.reasons
    assert len({k for members in held for k in members}) == sum(map(len, held))


def test_a_wrist_whose_fourth_axis_turns_its_sixth_is_named():
    # Its drives run through one another; those of an arm with a motor in every joint do not.
    coupled = ('joint_coupling', 'joint', 'joint_a6', 'source', 'joint_a4', 'ratio', 1e-3)
    few = all_but('joint_coupling', 'joint_offset', 'gear_ratio', 'transmission_ripple')
    answer = solved(coupled, robot='kuka_kr6_r900', static=30, exclude=tuple(few))
    assert sites(answer) == [{('joint_coupling', 'joint_a6')}]
    (found,) = answer.effects
    assert found.effect.source == 'joint_a4'
    assert found.effect.number('ratio') == pytest.approx(1e-3, rel=0.1)


@pytest.mark.parametrize(
    ('name', 'many'), [('kuka_kr6_r900', 2), ('fanuc_m10ia', 2), ('ur5', 1), ('franka_panda', 1)]
)
def test_drives_run_through_a_wrist_whose_axes_meet(name, many):
    robot = load(name)
    still = View(robot, np.zeros(1), np.zeros(1), *np.zeros((2, 1, robot.n)))
    sources = [seed.source for seed in JointCoupling.seeds(still, robot.joint_names[-1])]
    assert sources == list(robot.joint_names[-2 : -2 - many : -1])


def test_of_few_stations_noise_alone_is_no_rest_beside_a_cause():
    # On unseen parts of 24 stations a right model leaves 1.3 times the noise.
    for seed in range(3):
        few = cell(TRUE[1:2], static=24, seed=seed)
        told = diagnose([few], load(ARM), align='base,tool', experiment=False)
        assert told.status in NAMING and not told.unexplained.above_noise
        assert told.shares.unexplained == 0.0 and not any(cause.rest for cause in told.causes)


def test_what_is_left_above_a_noise_that_is_given_is_told_beside_causes_that_are_named():
    # Far more than the instrument's certificate allows, and it depends on nothing.
    recording = cell(TRUE[1:2])
    rng, measured = np.random.default_rng(3), recording.measured
    position = measured.position + rng.normal(scale=10.0 * SIGMA, size=measured.position.shape)
    given = np.full(position.shape[0], SIGMA)
    measured = replace(measured, position=position, sigma=given)
    told = diagnose([recording.with_measured(measured)], load(ARM), align='base', experiment=False)
    first, left = told.causes
    assert told.status in NAMING and told.unexplained.above_noise
    assert first.name[0][0].joint == 'joint_a2' and not first.rest
    assert left.rest and not left.place and left.share == pytest.approx(told.shares.unexplained)
