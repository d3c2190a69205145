# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is sealed stays as it was, or is found out; what is to be blind is kept blind."""

import hashlib
import json
import stat
import subprocess
import sys

import pytest
from blind_verdicts import offset, truth
from command_line import refused

from weld_twin_core.errors import DataError
from weld_twin_lab.blind import seal


@pytest.fixture
def sealed(tmp_path):
    """Return directories of two cases and their truths, sealed, recordings being mere bytes."""
    cases, truths = tmp_path / 'cases', tmp_path / 'elsewhere' / 'truths'
    entries = []
    for name in ('case_0001', 'case_0002'):
        (cases / name / 'train').mkdir(parents=True)
        (cases / name / 'train' / 'train.mcap').write_bytes(b'recording of ' + name.encode())
        seal.write(truths / name / seal.TRUTH, truth('single', [offset('a')], name=name))
        entries.append(
            {'name': name, 'case': seal.digest(cases / name), 'truth': seal.digest(truths / name)}
        )
    seal.write(cases / seal.CASES, {'seal': seal.seal_of(entries), 'cases': entries})
    seal.write(truths / seal.TRUTHS, {'seed': 1})
    return cases, truths


def test_untouched_truths_open_in_the_order_of_the_cases(sealed):
    assert [item['name'] for item in seal.opened(*sealed)] == ['case_0001', 'case_0002']


def test_the_seal_is_a_plain_hash_that_anyone_can_check(sealed):
    listed = json.loads((sealed[0] / seal.CASES).read_text())
    text = ''.join(f'{e["name"]} {e["case"]} {e["truth"]}\n' for e in listed['cases'])
    assert hashlib.sha256(text.encode()).hexdigest() == listed['seal']


def change(path):
    """Change one byte in the middle of a file."""
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


@pytest.mark.parametrize(
    ('spoil', 'words'),
    [
        (lambda c, t: change(c / 'case_0002/train/train.mcap'), 'case of case_0002 was changed'),
        (lambda c, t: change(t / 'case_0001' / seal.TRUTH), 'truth of case_0001 was changed'),
        (lambda c, t: (c / 'case_0001/more').write_text(''), 'case_0001 was changed'),
        (lambda c, t: (t / 'case_0002').rename(t / 'lost'), 'truth of case_0002 is missing'),
        (lambda c, t: (c / seal.CASES).write_text('{"schema": "x"}'), "has the schema 'x'"),
    ],
)
def test_what_is_not_as_it_was_sealed_is_found(sealed, spoil, words):
    spoil(*sealed)
    with pytest.raises(DataError, match=words):
        seal.opened(*sealed)


def test_a_truth_swapped_together_with_its_hash_is_found_by_the_seal(sealed):
    cases, truths = sealed
    listed = json.loads((cases / seal.CASES).read_text())
    change(truths / 'case_0001' / seal.TRUTH)
    listed['cases'][0]['truth'] = seal.digest(truths / 'case_0001')
    (cases / seal.CASES).write_text(json.dumps(listed))
    with pytest.raises(DataError, match='seal'):
        seal.opened(cases, truths)


def test_a_list_sealed_anew_does_not_pass_for_the_one_published(sealed):
    cases, truths = sealed
    published = json.loads((cases / seal.CASES).read_text())['seal']
    change(cases / 'case_0001' / 'train' / 'train.mcap')
    listed = json.loads((cases / seal.CASES).read_text())
    listed['cases'][0]['case'] = seal.digest(cases / 'case_0001')
    listed['seal'] = seal.seal_of(listed['cases'])
    (cases / seal.CASES).write_text(json.dumps(listed))
    assert seal.opened(cases, truths)
    with pytest.raises(DataError, match='seal'):
        seal.opened(cases, truths, published)


def test_the_command_line_tells_of_a_broken_seal_in_one_line(sealed, tmp_path):
    change(sealed[1] / 'case_0001' / seal.TRUTH)
    words = ('--truths', sealed[1], '--results', tmp_path / 'verdicts')
    result = refused('blind', 'score', sealed[0], *words, '--out', tmp_path / 'score')
    assert 'truth of case_0001 was changed' in result
    assert not (tmp_path / 'score').exists()


@pytest.mark.parametrize('place', ['cases/truths', 'truths', 'cases'])
def test_a_diagnosis_that_could_read_the_truths_is_refused(sealed, tmp_path, place):
    near = tmp_path / place / seal.TRUTHS
    near.parent.mkdir(exist_ok=True)
    seal.write(near, {'seed': 1})
    assert '--allow-readable' in refused('blind', 'diagnose', sealed[0], '--out', tmp_path / 'out')
    assert not (tmp_path / 'out').exists()


def test_truths_are_out_of_reach_of_others(sealed):
    assert seal.truths_within_reach(sealed[0]) is None
    seal.make_private(sealed[1])
    for path in (sealed[1], *sealed[1].rglob('*')):
        assert stat.S_IMODE(path.stat().st_mode) & 0o077 == 0


def test_the_diagnosis_loads_neither_plant_nor_truths():
    code = (
        'import sys, weld_twin_lab.blind.diagnosing; print([name for name in sys.modules if '
        'name.startswith("weld_twin_lab.plant") or name == "mujoco" or '
        'name in ("weld_twin_lab.blind.making", "weld_twin_lab.blind.scoring")])'
    )
    out = subprocess.run(
        [sys.executable, '-c', code],
        capture_output=True,
        text=True,
        check=True,
        env={'PYTHONPATH': ':'.join(sys.path)},
    )
    assert out.stdout.strip() == '[]'
