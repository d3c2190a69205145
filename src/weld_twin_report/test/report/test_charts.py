# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Charts of the pages: the library is the one that was pinned, and one cursor serves all of a key."""

import hashlib
import json
import re
from importlib.resources import files
from types import SimpleNamespace

import numpy as np
import pytest

from weld_twin_core import effect_from_mapping, load
from weld_twin_core.twin.directions import Directions
from weld_twin_report.report.charts import Axis, Line, chart, curve_figure, embedded, thinned
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


@pytest.mark.parametrize('known', [True, False])
def test_a_curve_is_drawn_with_the_band_that_holds_nine_in_ten(known):
    robot, sigma = load('ur5'), np.array([2e-4, 1e-4])
    entry = {'effect': 'joint_curve', 'joint': 'elbow_joint', 'values': [1e-3, -5e-4]}
    curve = effect_from_mapping({**entry, 'knots': [-1.0, 0.5]})
    allowed = SimpleNamespace(directions=Directions((), 1, (curve,)), covariance=np.diag(sigma**2))
    model = SimpleNamespace(found=(curve,), robot=robot)
    case = SimpleNamespace(model=model, posterior=allowed if known else None)
    told = json.loads(re.search(r'json">(.*)</script>', curve_figure(case, 0, curve))[1])
    np.testing.assert_allclose(np.array(told['x'])[[0, -1]], np.degrees([-1.0, 0.5]), rtol=1e-3)
    off, (low, high) = np.array(told['lines'][0]['values']), np.array(told['band'])
    np.testing.assert_allclose(off[[0, -1]], np.degrees([1e-3, -5e-4]), rtol=1e-3)
    half = np.degrees(1.645 * sigma * known)
    np.testing.assert_allclose((high - low)[[0, -1]], 2.0 * half, rtol=2e-2, atol=1e-12)
    np.testing.assert_allclose(0.5 * (high + low), off, atol=1e-4)
    assert told['joint'] == 2
