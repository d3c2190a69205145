# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The belief that the diagnosis reads is the one that the kept cases teach, and says so."""

import json
from functools import cache
from importlib.resources import files
from pathlib import Path

import pytest

from weld_twin_core.diagnosis import trust
from weld_twin_core.diagnosis.trust.model import FILE
from weld_twin_lab.belief.judged import cases_of, examples_of
from weld_twin_lab.belief.learning import learned
from weld_twin_lab.belief.rows import read_rows, seeds_of, write_rows
from weld_twin_lab.cli.lab_jobs import belief
from weld_twin_nodes.cli.main import main

KEPT = Path(__file__).parents[4] / 'docs/results/belief'
SHIPPED = json.loads(files(trust).joinpath(FILE).read_text(encoding='utf-8'))


@cache
def kept(name):
    """Return the rows of a table that is kept; some thousand."""
    return read_rows(KEPT / name)


def test_the_shipped_belief_is_what_the_kept_cases_teach():
    rows = kept(belief.LEARNED)
    # Answers as a whole, whose bound is the one that counts; causes take four times as long.
    whole = [e for e in examples_of(cases_of(rows)) if e.level.startswith('answer ')]
    taught = learned(whole, {}, SHIPPED['card']['risk'])
    assert seeds_of(rows) == SHIPPED['card']['seeds']
    assert taught['levels']
    for name, level in taught['levels'].items():
        assert taught['sure_from'][name] == pytest.approx(SHIPPED['sure_from'][name])
        assert level['bias'] == pytest.approx(SHIPPED['levels'][name]['bias'], abs=1e-3)


def test_nothing_is_judged_on_cases_that_were_learned_from():
    taught = {row['name'] for row in kept(belief.LEARNED)}
    assert not taught & {row['name'] for row in kept(belief.JUDGED)}


def test_belief_is_fitted_anew_from_tables_by_one_command(tmp_path, capsys):
    few, others = (kept(name)[:40] for name in (belief.LEARNED, belief.JUDGED))
    write_rows(tmp_path / 'learn.jsonl', few)
    write_rows(tmp_path / 'judge.jsonl', others)
    asked = ['--learn-from', str(tmp_path / 'learn.jsonl'), '--judge-on']
    assert (
        main(['lab', 'belief', *asked, str(tmp_path / 'judge.jsonl'), '--out', str(tmp_path)]) == 0
    )
    written = json.loads((tmp_path / FILE).read_text(encoding='utf-8'))
    assert written['card']['cases'] <= 40
    assert 'calibration error' in capsys.readouterr().out
    assert (
        main(['lab', 'belief', *asked, str(tmp_path / 'learn.jsonl'), '--out', str(tmp_path)]) == 2
    )
    assert 'to learn from and in one to judge on' in capsys.readouterr().err
