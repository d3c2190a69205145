# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Pages of a fleet: the worst cell first, what changed, what is usual, in a real browser."""

import numpy as np
import pytest

from weld_twin_lab.benchmark.waiting_data import fill
from weld_twin_nodes.cli.in_process import weld_twin
from weld_twin_report.fleet.cell_page import baseline
from weld_twin_report.history import Database
from weld_twin_report.history.runs import Run, Runs

pytest.importorskip('sqlalchemy', reason='the history is an extra')


@pytest.fixture(scope='module')
def written(tmp_path_factory):
    """Return a folder of pages: three cells, the second has stepped, the third has a bad bag."""
    place = tmp_path_factory.mktemp('pages')
    database = Database(str(place / 'fleet.db'))
    fill(database, 3, 16)
    why = "'<b>noise</b>.mcap' is damaged"
    run = Run('key', 'line 003', '/data/<b>noise</b>.mcap', 'refused', why, 0.1, 1)
    assert Runs(database).write(run, None)
    for cell in database.cells():
        Runs(database).look(cell)
    database.close()
    said = weld_twin('history', 'page', '--db', place / 'fleet.db', '--out', place / 'pages')
    assert (said.code, said.out) == (0, f'{place}/pages/index.html: 3 cells\n')
    return place / 'pages'


def test_the_worst_cell_is_first_and_leads_to_its_page(written, browser):
    page = browser.open((written / 'index.html').read_text())
    page.goto((written / 'index.html').as_uri())
    assert page.locator('h1').inner_text().startswith('line 002 has the largest gap')
    assert page.locator('#cells tbody th').all_inner_texts()[0] == 'line 002'
    assert 'stepped' in page.locator('#cells tbody tr').first.inner_text()
    assert '<b>noise</b>.mcap' in page.locator('#troubles').inner_text()
    page.locator('#cells a').first.click()
    assert page.locator('h1').inner_text().startswith('Zero offset of elbow_joint: stepped by')
    assert page.locator('.chart canvas').count() == 3
    assert page.locator('#diagnoses tbody tr').count() == 16
    page.get_by_text('All cells').click()
    assert page.locator('h1').inner_text().startswith('line 002')
    assert browser.console == []


def test_what_is_usual_is_three_deviations_of_the_first_diagnoses():
    rng = np.random.default_rng(2)
    usual = baseline(np.append(5.0 + 0.1 * rng.normal(size=12), [99.0] * 20))
    assert usual.middle == pytest.approx(5.0, abs=0.1)
    assert usual.high - usual.middle == pytest.approx(0.3, rel=0.5)
    assert usual.middle - usual.low == pytest.approx(usual.high - usual.middle)
    # One outlier among them does not widen the limits much.
    wild = baseline(np.array([5.0, 5.1, 4.9, 5.0, 50.0, 5.1, 4.9, 5.0]))
    assert wild.high < 6.0
    assert baseline(np.array([1.0, np.nan, 2.0])) is None
    assert baseline(np.arange(9.0), before=2) is None


def test_what_changed_is_worked_out_once_and_again_after_a_new_diagnosis(tmp_path):
    database = Database(str(tmp_path / 'fleet.db'))
    fill(database, 2, 8)
    runs = Runs(database)
    first = runs.look('line 002')
    # What is kept is taken, whatever else is given.
    assert runs.look('line 002', []) == first
    entry = database.entries('line 002')[-1]
    assert [e.at for e in database.entries('line 002', 3)][-1] == entry.at
    assert len(database.entries('line 002', 3)) == 3
    database.close()
