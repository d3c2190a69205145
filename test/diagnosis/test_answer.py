# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What an answer holds: the public schema, shares that add up, figures that agree."""

import json
from numbers import Real

import numpy as np
import pytest
import yaml
from diagnosis_cells import solved

from weld_twin_core.effects import effect_from_mapping

TYPES = {
    'number': Real, 'text': str, 'flag': bool, 'whole': int, 'mapping': dict, 'nothing': type(None)
}  # fmt: skip
SCHEMA = yaml.safe_load("""
schema: text
gap: {rms_m: number, mean_m: number, max_m: number, orientation_rms_rad: number or nothing,
      samples: whole, noise_floor_m: number}
where:
  joints: [{name: text, share: number}]
  regimes: {static: number, reversal: number, speed: number, acceleration: number, load: number,
            temperature: number, time: number}
  path: [{t_start: number, t_end: number, share: number, rms_m: number}]
  direction: {along_m: number, across_m: number, normal_m: number}
verdict:
  status: text
  effects: [{effect: text, joint: text or nothing, parameters: mapping, std: mapping}]
  confidence: number
  learned: number
  sure: flag
  complete: number
  indistinguishable: [[{effect: text, joint: text or nothing}]]
  causes:
  - probability: number
    sure: flag
    effect: whole or nothing
    rest: flag
    place: [{at: text, probability: number}]
    dependence: [{'on': text, probability: number}]
    name: [{effect: text, joint: text or nothing, probability: number}]
    share: number
    share_ci90: [number]
candidates:
- {effect: text, joint: text or nothing, probability: number, rms_after_m: number, shrink: number}
shrink: {rms_before_m: number, rms_after_m: number, ratio: number, ci95: [number],
         elsewhere_ci95: [number], held_out: text}
unexplained: {rms_m: number, above_noise: flag, structure: [text]}
next_experiment: mapping or nothing
""")
ANSWERS = {
    'play': ((('backlash', 'joint', 'elbow_joint', 'width', 8e-4),), {}),
    'tool': ((('tool_pose', 'xyz', (4e-4, -3e-4, 2e-4), 'rotvec', (6e-4, 0.0, -8e-4)),), {}),
    'parallel': ((('link_offset', 'joint', 'elbow_joint', 'dd', 4e-4),), {'robot': 'ur5'}),
    'unknown': (
        (('backlash', 'joint', 'elbow_joint', 'width', 1.5e-3),),
        {
            'exclude': ('backlash', 'friction', 'hysteresis', 'gear_ratio_by_direction'),
            'experiment': True,
        },
    ),
    'points': ((('backlash', 'joint', 'elbow_joint', 'width', 8e-4),), {'orientation': False}),
    'stations': (
        (('joint_compliance', 'joint', 'shoulder_lift_joint', 'compliance', 1.2e-5),),
        {'static': 60},
    ),
    'nothing': ((), {}),
}


@pytest.fixture(params=ANSWERS)
def answer(request):
    effects, options = ANSWERS[request.param]
    return solved(*effects, **options)


def faults(value, schema, path='diagnosis'):
    """Return where a value departs from a schema; a list's only entry describes all of its own."""
    if isinstance(schema, dict):
        missing = [f'{path}.{key} is missing' for key in schema if key not in value]
        return missing + [
            f
            for key, inner in schema.items()
            if key in value
            for f in faults(value[key], inner, f'{path}.{key}')
        ]
    if isinstance(schema, list):
        if type(value) is not list:
            return [f'{path} is no list']
        return [f for k, v in enumerate(value) for f in faults(v, schema[0], f'{path}[{k}]')]
    kinds = tuple(TYPES[word] for word in schema.split(' or '))
    right = isinstance(value, kinds) and (bool in kinds or not isinstance(value, bool))
    return [] if right else [f'{path} is {value!r}']


def test_the_answer_has_every_key_of_the_public_schema_in_its_type(answer):
    data = answer.as_dict()
    assert faults(data, SCHEMA) == []
    assert data['schema'] == 'weld_twin/diagnosis/2'
    assert data['verdict']['status'] in ('identified', 'ambiguous', 'unknown', 'none')
    assert json.loads(json.dumps(data, allow_nan=False)) == data


def test_effects_named_can_be_read_back_as_an_effects_file(answer):
    for entry in answer.as_dict()['verdict']['effects']:
        joint = {} if entry['joint'] is None else {'joint': entry['joint']}
        effect = effect_from_mapping({'effect': entry['effect'], **joint, **entry['parameters']})
        assert effect.to_mapping()['effect'] == entry['effect']
        for key, error in entry['std'].items():
            assert np.shape(error) == np.shape(entry['parameters'][key])
            assert (np.asarray(error) > 0.0).all()


def test_every_effect_named_belongs_to_a_set_and_every_set_to_an_effect(answer):
    named = [(f.effect.name, f.effect.site) for f in answer.effects]
    groups = [{(s.effect, s.joint) for s in group} for group in answer.indistinguishable]
    assert len(named) == len(groups)
    assert all(sum(site in group for group in groups) == 1 for site in named)


def test_joints_regimes_stretches_and_directions_share_out_the_gap(answer):
    joints = [share for _, share in answer.where.joints]
    regimes = list(answer.where.regimes.values())
    assert min(joints) >= 0.0 and min(regimes) >= 0.0
    if answer.model.found:
        assert sum(joints) <= 1.0 + 1e-9 and sum(regimes) <= 1.0 + 1e-9
    assert joints == sorted(joints, reverse=True)
    assert {name for name, _ in answer.where.joints} == set(answer.model.robot.joint_names)
    path = np.array(answer.where.path)
    assert path[:, 2].sum() == pytest.approx(1.0)
    assert (path[:, 1] >= path[:, 0]).all() and (path[1:, 0] > path[:-1, 1]).all()
    parts = np.array(list(answer.where.direction.values()))
    residual = answer.traces.before[0][answer.traces.trusted[0]]
    assert (parts**2).sum() == pytest.approx((residual**2).sum(axis=1).mean(), rel=1e-6)


def test_shares_of_causes_rest_and_noise_add_up_and_so_do_probabilities_of_rivals(answer):
    every = sum(c.probability for c in answer.candidates)
    assert every == pytest.approx(round(every), abs=1e-9)
    if answer.status != 'unknown':  # where curves took the names' place in the model
        assert round(every) == len(answer.model.found)
    shares = [cause.share for cause in answer.causes]
    assert shares == sorted(shares, reverse=True)
    # What is left without a name has an entry of its own, whose share is the unexplained.
    named = sum(cause.share for cause in answer.causes if not cause.rest)
    total = named + answer.shares.unexplained + answer.shares.noise
    assert total == pytest.approx(1.0, abs=1e-9)
    for cause in answer.causes:
        assert 0.0 <= cause.share_ci90[0] <= cause.share <= cause.share_ci90[1] <= 1.0
        for level in (cause.place, cause.dependence, cause.name):
            beliefs = [belief for _, belief in level]
            assert all(0.0 < belief <= 1.0 for belief in beliefs)


def test_an_unknown_says_where_it_is_on_what_it_depends_and_carries_its_curve():
    effects, options = ANSWERS['unknown']
    answer = solved(*effects, **options)
    assert answer.status == 'unknown'
    (cause,) = (one for one in answer.causes if not one.rest)
    assert cause.place[0][0] == 'elbow_joint'
    assert cause.dependence[0][0] == 'direction'
    assert {site.effect for site, _ in cause.name} == {'joint_curve'}
    assert {effect.name for effect in answer.model.found} == {'joint_curve'}
    assert answer.shrink.ratio < 0.5


def test_the_shrink_is_the_ratio_of_its_own_figures_inside_its_interval(answer):
    shrink = answer.shrink
    assert shrink.ratio == pytest.approx(shrink.rms_after_m / shrink.rms_before_m, rel=1e-9)
    assert shrink.ci95[0] <= shrink.ratio <= shrink.ci95[1]
    assert shrink.held_out == 'blocked cross-validation'
    if answer.model.found:  # the waterfall ends where the shrink does
        assert shrink.steps[-1][1] == pytest.approx(shrink.rms_after_m, rel=1e-9)
        assert len(shrink.alone) == len(shrink.steps)


@pytest.mark.parametrize(
    ('name', 'joint', 'regime'),
    [('play', 'elbow_joint', 'reversal'), ('stations', 'shoulder_lift_joint', 'load')],
)
def test_most_of_the_gap_lies_on_the_joint_and_in_the_regime_of_its_cause(name, joint, regime):
    effects, options = ANSWERS[name]
    answer = solved(*effects, **options)
    assert answer.where.joints[0][0] == joint
    assert answer.where.joints[0][1] > 0.9
    assert answer.where.regimes[regime] > 0.9


def test_the_map_of_joints_points_at_reversals_of_the_joint_with_play():
    answer = solved(*ANSWERS['play'][0])
    shares = np.array(answer.where.map_shares)
    joint, regressor = np.unravel_index(shares.argmax(), shares.shape)
    assert answer.model.robot.joint_names[joint] == 'elbow_joint'
    assert answer.where.map_regressors[regressor] == 'reversal'
