# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Broken and malicious files give a result or one sentence; the campaign reads many more."""

import json
import math
import sqlite3
from contextlib import closing

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from weld_twin_core import DataError, ModelError, PathError, TwinError, catalog
from weld_twin_lab.campaigns import fuzz
from weld_twin_lab.campaigns.broken_files import targets
from weld_twin_lab.campaigns.fuzz import harms, try_one
from weld_twin_msgs_py.bags.reader import unlz4, unzstd, zstd
from weld_twin_msgs_py.files.diagnosis_model import load_model
from weld_twin_msgs_py.files.effects_file import read_effects
from weld_twin_msgs_py.files.path_file import read_path
from weld_twin_msgs_py.files.yaml_file import parse_yaml, yaml_text
from weld_twin_msgs_py.robots import load_robot
from weld_twin_nodes.cli import main

SEED = 7
CASES = 8

anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.text(max_size=8) | st.sampled_from(['kind', 'effect', 'joints']), inner, max_size=4
        )
    ),
    max_leaves=12,
)
few = settings(
    max_examples=25,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)


@pytest.mark.parametrize('name', targets())
def test_a_broken_file_is_read_or_refused_in_a_sentence(name):
    found = {}
    tally = fuzz.hunt(name, SEED, CASES, found)
    assert found == {}
    assert tally['right'] + tally['refused'] == CASES
    assert tally['refused'] > 0


@pytest.mark.parametrize('name', targets())
def test_the_samples_the_broken_files_are_made_of_are_right(name, tmp_path):
    kind = targets()[name]
    for k, seed in enumerate(kind.seeds):
        path = tmp_path / f'sample{k}{kind.suffix}'
        path.write_bytes(seed)
        assert kind.read(path) is not None


def test_a_topic_whose_type_is_no_text_makes_a_damaged_bag(tmp_path):
    kind = targets()['sqlite3']
    path = tmp_path / f'bag{kind.suffix}'
    path.write_bytes(kind.seeds[0])
    with closing(sqlite3.connect(path)) as base, base:
        base.execute("UPDATE topics SET type = x'00ff' WHERE id = 1")
    with pytest.raises(DataError, match=r'is damaged .*no text'):
        kind.read(path)


def test_a_list_as_key_is_refused_where_another_key_came_before():
    with pytest.raises(ModelError, match='unhashable key'):
        parse_yaml('a: 1\n? [1, 2]\n: 3\n', 'robot file')


@pytest.mark.parametrize('name', [name for name in harms() if 'gigabyte' not in name])
def test_a_malicious_file_is_refused(name):
    assert try_one(name).startswith('refused: ')


@pytest.mark.parametrize('pack', ['zstd', 'lz4'])
def test_what_is_compressed_is_unpacked_within_bounds(pack):
    from lz4.frame import compress

    unpack = {'zstd': unzstd, 'lz4': unlz4}[pack]
    packed = {'zstd': zstd.compress, 'lz4': compress}[pack]
    motion = bytes(range(256)) * 4000
    assert unpack(packed(motion), len(motion)) == motion
    assert unpack(packed(motion)) == motion
    with pytest.raises(DataError, match='would unpack to more than'):
        unpack(packed(motion), len(motion) - 1)
    with pytest.raises(DataError, match='would unpack to more than'):
        unpack(packed(bytes(100_000_000)))


@few
@given(anything)
def test_any_data_is_a_file_or_a_sentence(tmp_path, data):
    robot = catalog.load('ur5')
    readers = {
        'robot.yaml': load_robot,
        'effects.yaml': lambda path: read_effects(path, robot),
        'path.yaml': read_path,
        'model.json': lambda path: load_model(robot, path),
    }
    for name, read in readers.items():
        path = tmp_path / name
        json_text = json.dumps({'schema': 'weld_twin/diagnosis/1', 'model': data})
        path.write_text(json_text if name.endswith('json') else yaml_text(data), errors='replace')
        try:
            read(path)
        except TwinError as error:
            assert '\n' not in str(error)


@pytest.mark.parametrize('text', ['1' * 400, '-' + '1' * 400, '0x' + 'f' * 400])
def test_a_whole_number_no_machine_holds_is_infinite(text):
    assert math.isinf(parse_yaml(f'[{text}]', 'a list')[0])
    assert parse_yaml('[9223372036854775807, 12]', 'a list') == [2**63 - 1, 12]


@pytest.mark.parametrize('text', ['{kind: [line]}', '{kind: {a: 1}}', '[1]', '7'])
def test_a_path_of_no_kind_is_refused(tmp_path, text):
    (tmp_path / 'path.yaml').write_text(text)
    with pytest.raises(PathError, match=r'path'):
        read_path(tmp_path / 'path.yaml')


def test_the_campaign_keeps_its_result_and_touches_no_other_file(tmp_path, capsys):
    out = tmp_path / 'hunt.json'
    words = ['campaign', 'fuzz', '--only', 'points', '--cases', '5', '--out', str(out)]
    (tmp_path / 'mine').write_text('keep')
    assert main([*words[:-1], str(tmp_path / 'mine')]) == 2
    assert 'holds something else already' in capsys.readouterr().err
    assert (tmp_path / 'mine').read_text() == 'keep'
    assert main([*words[:3], 'poems', *words[4:]]) == 2
    assert "no kind of file is called 'poems'" in capsys.readouterr().err
