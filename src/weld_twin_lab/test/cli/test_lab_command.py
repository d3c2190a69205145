# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""`weld-twin lab` knows every proof, and the older ones answer there as they do alone."""

from __future__ import annotations

import re

import pytest

from weld_twin_lab.cli import lab, retired
from weld_twin_nodes.cli import main


def test_older_proofs_answer_under_lab():
    assert {'benchmark', 'blind', 'campaign', 'transfer'} <= set(lab.proofs())


def test_every_proof_tells_what_it_does(capsys):
    for name in lab.proofs():
        with pytest.raises(SystemExit) as left:
            main(['lab', name, '--help'])
        assert left.value.code == 0
        shown = capsys.readouterr().out
        assert f'weld-twin lab {name}' in shown and len(shown.splitlines()) > 4


def test_an_older_proof_fails_under_lab_as_it_does_alone(capsys, tmp_path):
    words = ['blind', 'diagnose', 'nobody', '--out', str(tmp_path / 'out')]
    codes, said = [], []
    for start in ([], ['lab']):
        codes.append(main([*start, *words]))
        said.append(capsys.readouterr().err)
    assert codes == [2, 2]
    assert said[0] == said[1] and 'nobody' in said[0]


@pytest.mark.parametrize(
    ('words', 'now'),
    [
        *(([name], now) for name, now in retired.LAB.items()),
        *((['blind', name], now) for name, now in retired.BLIND.items()),
        *((['campaign', name], now) for name, now in retired.CAMPAIGNS.items()),
    ],
)
def test_a_retired_proof_tells_where_its_question_is_answered(capsys, words, now):
    assert main(['lab', *words, '--cases', '3', 'DIR', '--out', 'OUT']) == 2
    told = capsys.readouterr().err
    assert told == f"weld-twin: '{words[-1]}' is retired: {now}\n"


@pytest.mark.parametrize(('words', 'now'), retired.OPTIONS.items())
def test_so_does_a_retired_option(capsys, words, now):
    assert main(['lab', *words.split(), 'DIR', '--out', 'OUT']) == 2
    assert capsys.readouterr().err == f"weld-twin: '{words}' is retired: {now}\n"


def test_what_a_retired_proof_points_to_can_be_typed():
    tables = retired.LAB, retired.BLIND, retired.CAMPAIGNS, retired.OPTIONS
    named = re.findall(
        r"'lab ([a-z-]+)", ' '.join(now for table in tables for now in table.values())
    )
    assert named and set(named) <= set(lab.proofs())


def test_no_proof_named_is_a_usage_error(capsys):
    with pytest.raises(SystemExit) as left:
        main(['lab'])
    assert left.value.code == 2 and 'PROOF' in capsys.readouterr().err
