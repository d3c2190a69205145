# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Charts of the pages: the library is the one that was pinned, and one cursor serves all of a key."""

import hashlib
import re
from importlib.resources import files

import numpy as np

from weld_twin_report.report.charts import Axis, Line, chart, embedded, thinned
from weld_twin_report.report.html import document

UPLOT = files('weld_twin_report.report') / 'uplot'
T = np.linspace(0.0, 10.0, 201)


def two_charts(key='run'):
    axes = (Axis('time', 's'), Axis('deviation', 'mm'))
    charts = [
        chart(title, T, [Line('before', values, 'before')], axes, key=key)
        for title, values in (('rising', T), ('falling', 10.0 - T))
    ]
    return document('charts', *charts, charts=True)


def test_the_library_is_the_one_its_table_names():
    table = (UPLOT / 'README.md').read_text(encoding='utf-8')
    rows = re.findall(r'`(\S+)` \| ([0-9a-f]{64})', table)
    assert len(rows) == 2
    for name, expected in rows:
        assert hashlib.sha256((UPLOT / name).read_bytes()).hexdigest() == expected
    assert 'MIT License' in (UPLOT / 'LICENSE').read_text(encoding='utf-8')


def test_hovering_one_chart_shows_the_values_of_the_same_instant_in_both(browser):
    page = browser.open(two_charts())
    page.locator('.u-over').first.hover(position={'x': 200, 'y': 50})
    times, rising, falling = (
        [float(re.findall(r'[\d.]+', text)[-1]) for text in cells]
        for cells in (
            page.locator('.u-legend tr:nth-child(1)').all_inner_texts(),
            page.locator('.chart:nth-child(1) .u-legend tr:nth-child(2)').all_inner_texts(),
            page.locator('.chart:nth-child(2) .u-legend tr:nth-child(2)').all_inner_texts(),
        )
    )
    assert times[0] == times[1] > 0.5
    assert rising[0] == times[0] and abs(falling[0] - (10.0 - times[0])) < 1e-9
    assert browser.console == []


def test_an_instant_told_by_another_part_of_the_page_moves_the_cursor(browser):
    page = browser.open(two_charts())
    tell = "document.dispatchEvent(new CustomEvent('instant', {detail: {key: 'run', x: 2.5}}))"
    page.evaluate(tell)
    text = page.locator('.u-legend tr:nth-child(1)').first.inner_text()
    assert float(re.findall(r'[\d.]+', text)[0]) == 2.5


def test_thinning_keeps_the_peaks_of_every_line():
    rng = np.random.default_rng(0)
    rows = [rng.random(50_000), rng.random(50_000)]
    rows[0][777], rows[1][40_001] = 9.0, 8.0
    kept = thinned(rows, 1000)
    assert kept.size <= 1002 and {0, 777, 40_001, 49_999} <= set(kept.tolist())


def test_what_is_not_finite_is_null_in_a_page():
    text = embedded({'a': [1.0, float('nan')], 'b': {'c': float('inf')}})
    assert text.endswith('>{"a":[1.0,null],"b":{"c":null}}</script>')
