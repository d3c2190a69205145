# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""`schema`: what the readers take, the schemas take, and what they refuse they refuse."""

import json
import re
from functools import cache
from pathlib import Path

import pytest
import yaml
from command_line import done, refused

from weld_twin_core import Robot, TwinError, catalog, effects_from_list
from weld_twin_core.contacts import Artefact
from weld_twin_core.effects import REGISTRY
from weld_twin_core.motion.paths import Torch, from_mapping

jsonschema = pytest.importorskip('jsonschema', reason='needs a checker of JSON Schema')
UR5 = catalog.load('ur5')
DOCS = Path(__file__).parents[4] / 'docs'
PLACE = [0.4, 0.0, 0.2]
LINE = {'kind': 'line', 'start': PLACE, 'end': [0.4, 0.1, 0.2]}


def read_seam(data):
    Torch.from_mapping(data.get('torch') or {})
    return from_mapping(data)


READERS = {
    'robot': Robot.from_mapping,
    'effects': lambda data: effects_from_list(data, UR5),
    'seam': read_seam,
    'artefact': Artefact.from_mapping,
}


def joint(**keys):
    return {'joints': [{'name': 'j', **keys}]}


def offset(**keys):
    return [{'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': 1e-3} | keys]


@cache
def schema(name):
    return json.loads(done('export', 'schema', name))


def checks(name, data):
    return jsonschema.Draft7Validator(schema(name)).is_valid(data)


def reads(name, data):
    try:
        READERS[name](data)
    except TwinError:
        return False
    return True


RIPPLE = {'effect': 'transmission_ripple', 'joint': 'elbow_joint'}
RIPPLE |= {'amplitude': [1e-4], 'order': [2], 'phase': [0]}
TIE = {'between': ['a', 'b'], 'value': 0.05}
GOOD = [
    *(('robot', catalog.load(name).to_mapping()) for name in catalog.names()),
    ('robot', joint(type='prismatic', lower=0.0, upper=1.0)),
    ('robot', joint() | {'plausible': {'backlash': {'width': {'high': 1e-3}}}}),
    ('effects', []),
    ('effects', offset()),
    ('effects', [RIPPLE]),
    ('seam', LINE),
    ('seam', LINE | {'torch': {'work': 0.1, 'heading': 'seam'}}),
    ('seam', LINE | {'weave': {'amplitude': 0.002, 'wavelength': 0.01}}),
    ('seam', {'kind': 'circle', 'centre': PLACE, 'radius': 0.1, 'turns': 1.0}),
    ('seam', {'kind': 'points', 'points': [PLACE, [0.4, 0.1, 0.2], [0.5, 0.1, 0.2]]}),
    ('artefact', {'contacts': {'a': 'point', 'b': {'kind': 'point'}}, 'distances': [TIE]}),
    ('artefact', {'contacts': {'a': {'kind': 'plane', 'at': PLACE, 'axis': [0.0, 0.0, 1.0]}}}),
    ('artefact', {'blocks': {'b': {'size': [1, 1, 1], 'at': PLACE, 'turn': PLACE, 'sigma': 1}}}),
]
BAD = [
    ('robot', {'name': 'no joints'}),
    ('robot', joint(colour='red')),
    ('robot', joint(type='ball')),
    ('robot', joint() | {'convention': 'mine'}),
    ('effects', offset(offset='much')),
    ('effects', offset(wide=1)),
    ('effects', offset(effect='gremlins')),
    ('effects', [{'effect': 'backlash', 'joint': 'elbow_joint', 'width': -1e-3}]),
    ('effects', [{'effect': 'base_pose', 'xyz': [0.0, 0.0]}]),
    ('seam', {'kind': 'line', 'start': PLACE}),
    ('seam', LINE | {'torch': {'lean': 0.1}}),
    ('seam', LINE | {'kind': 'knot'}),
    ('artefact', {'contacts': {'a': 'cone'}}),
    ('artefact', {'lengths': []}),
    ('artefact', {'blocks': {'b': {'at': PLACE}}}),
]


@pytest.mark.parametrize(('name', 'data'), GOOD, ids=lambda v: v if isinstance(v, str) else '')
def test_what_is_read_is_taken(name, data):
    assert reads(name, data)
    assert checks(name, data)


@pytest.mark.parametrize(('name', 'data'), BAD, ids=lambda v: v if isinstance(v, str) else '')
def test_what_is_refused_is_refused(name, data):
    assert not reads(name, data)
    assert not checks(name, data)


def test_every_effect_of_the_documentation_is_taken():
    text = (DOCS / 'effects.md').read_text(encoding='utf-8')
    lists = [yaml.safe_load(block) for block in re.findall(r'```yaml\n(- .*?)```', text, re.S)]
    assert lists
    for entries in lists:
        assert checks('effects', entries), entries


def test_every_effect_has_its_own_part():
    titles = {part['title'] for part in schema('effects')['items']['oneOf']}
    assert titles == set(REGISTRY)


def test_a_robot_file_has_the_keys_that_its_reader_knows():
    made = schema('robot')
    for data, keys in (
        ({'joints': [], 'zzz': 1}, made['properties']),
        (joint(zzz=1), made['properties']['joints']['items']['properties']),
    ):
        with pytest.raises(TwinError) as caught:
            Robot.from_mapping(data)
        known = str(caught.value).partition('known keys are ')[2]
        assert set(known.split(', ')) == set(keys)


def test_a_kind_that_is_not_there_is_one_sentence():
    result = refused('export', 'schema', 'weather')
    assert "there is no schema 'weather'; there are robot, effects, seam" in result
