# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The weights that the diagnosis reads are those that the kept cases teach, and say so."""

import json
from importlib.resources import files
from pathlib import Path

import pytest

from weld_twin_core.diagnosis import calibration
from weld_twin_core.diagnosis.calibration.weights import FILE
from weld_twin_lab.belief import learning, study
from weld_twin_lab.belief.trial import read_rows, write_rows
from weld_twin_nodes.cli.main import main

KEPT = Path(__file__).parents[4] / 'docs/results/belief'
SHIPPED = json.loads(files(calibration).joinpath(FILE).read_text(encoding='utf-8'))


@pytest.fixture(autouse=True)
def one_partition(monkeypatch):
    """Take a quarter of the time; what is sure hangs on it by thousandths."""
    monkeypatch.setattr(learning, 'PARTITIONS', 1)


def test_the_shipped_weights_are_what_the_kept_cases_teach():
    taught = study.fit(read_rows(KEPT / study.LEARNED))
    assert taught['card']['seeds'] == SHIPPED['card']['seeds']
    assert taught['sure_from'] == pytest.approx(SHIPPED['sure_from'], abs=6e-3)
    for kind, own in taught['statements'].items():
        assert own['constant'] == pytest.approx(SHIPPED['statements'][kind]['constant'], abs=5e-2)


def test_the_tree_holds_less_than_a_megabyte_of_cases():
    assert sum(file.stat().st_size for file in KEPT.iterdir()) < 1e6


def test_weights_are_fitted_anew_from_tables_by_one_command(tmp_path, capsys):
    rows = [{**row, 'kind': 'single', 'sizes': [2.0]} for row in read_rows(KEPT / study.LEARNED)]
    more = {
        'robot': 'ur5',
        'motion': 'free',
        'truth': 'play',
        'said': 'play',
        'status': 'identified',
        'family': 0.9,
        'seconds': 2.0,
    }
    more |= dict.fromkeys(('right', 'honest', 'named', 'place', 'dependence'), True)
    more |= {'sure': False}
    write_rows(tmp_path / 'learn.jsonl.gz', rows[::6])
    write_rows(tmp_path / 'judge.jsonl.gz', [{**row, **more} for row in rows[1:200:6]])
    asked = ['lab', 'belief', '--learn-from', str(tmp_path / 'learn.jsonl.gz'), '--judge-on']
    assert main([*asked, str(tmp_path / 'judge.jsonl.gz'), '--out', str(tmp_path)]) == 0
    written = json.loads((tmp_path / FILE).read_text(encoding='utf-8'))
    assert written['card']['cases'] == len(rows[::6])
    assert 'calibration error' in capsys.readouterr().out
    assert main([*asked, str(tmp_path / 'learn.jsonl.gz'), '--out', str(tmp_path)]) == 2
    assert 'to learn from and in one to judge on' in capsys.readouterr().err
