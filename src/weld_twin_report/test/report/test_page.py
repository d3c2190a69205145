# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The page and its charts as a browser has them, or a print: complete, readable, one cursor."""

import hashlib
import json
import re
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from importlib.resources import files
from io import BytesIO
from types import SimpleNamespace

import diagnoses
import numpy as np
import pytest
from command_line import refused
from matplotlib.image import imread

from weld_twin_core import effect_from_mapping, load
from weld_twin_core.diagnosis.result import Check, Traces
from weld_twin_core.errors import DataError
from weld_twin_core.twin.directions import Directions
from weld_twin_msgs_py.files.input_files import InputFile
from weld_twin_report.report import report_page
from weld_twin_report.report.charts import Axis, Line, chart, curve_figure, embedded, thinned
from weld_twin_report.report.diagnosis_files import browser as program
from weld_twin_report.report.diagnosis_files import print_page
from weld_twin_report.report.html import document
from weld_twin_report.report.page_data import page_data

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


@pytest.fixture(scope='module', params=list(diagnoses.ALL))
def case(request):
    return diagnoses.ALL[request.param]()


def data_of(page):
    return json.loads(re.search(r'id="data">(.*?)</script>', page, re.DOTALL)[1])


def test_a_script_error_would_be_noticed(browser):
    browser.open('<script>nothing_of_that_name()</script>')
    assert any('nothing_of_that_name' in line for line in browser.console)


def test_both_seams_are_drawn_and_the_one_before_is_redder(browser):
    page = browser.open(report_page(diagnoses.backlash()))

    def seam(side):
        return imread(BytesIO(page.locator(f'canvas[data-side={side}]').screenshot()))

    def red(image):
        return ((image[..., 0] > 0.6) & (image[..., 1] < 0.35) & (image[..., 2] < 0.35)).sum()

    def blue(image):
        return ((image[..., 2] > 0.55) & (image[..., 0] < 0.3) & (image[..., 1] < 0.65)).sum()

    assert red(seam('before')) > 200 > 20 > red(seam('after'))
    assert blue(seam('after')) > 200


def test_the_page_needs_no_other_file(case):
    page = report_page(case)
    assert not re.search(
        r'(src|href)\s*=["\'](?!#)|@import|url\(|https?://(?!github.com/leeoniya)', page
    )
    assert "default-src 'none'" in page.replace('&#x27;', "'")
    assert len(page) < 1_000_000


class Nesting(HTMLParser):
    VOID = ('meta', 'input', 'br')

    def __init__(self):
        super().__init__()
        self.open = []

    def handle_starttag(self, tag, attrs):
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_every_element_is_closed_in_order(case):
    parser = Nesting()
    parser.feed(report_page(case))
    assert parser.open == []


def test_names_from_a_bag_cannot_become_markup():
    evil = '</script><script>alert(1)</script>'
    case = diagnoses.nothing()
    recording = replace(case.recordings[0], name=evil)
    checks = (Check(evil, 'warning', evil),)
    page = report_page(
        replace(case, recordings=(recording,), checks=checks), [InputFile(evil, evil, evil)]
    )
    assert evil not in page and 'alert(1)</script' not in page


def test_a_diagnosis_without_pictures_still_has_a_page(browser):
    case = replace(diagnoses.nothing(), traces=Traces((), (), (), ()), recordings=(), checks=())
    browser.open(report_page(case))
    assert browser.console == []


def test_the_picture_keeps_the_largest_deviations_of_a_long_recording():
    count = 200_000
    t = np.arange(count) * 0.01
    measured = np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)
    before = np.zeros((count, 3))
    before[123_457] = [0, 3e-3, 4e-3]
    traces = Traces((t,), (measured,), (before,), (np.zeros((count, 3)),))
    still = replace(diagnoses.nothing(), traces=traces, recordings=())
    run = page_data(still)['runs'][0]
    shown = np.reshape(run['before'], (-1, 3))
    assert len(shown) <= 3002
    assert np.linalg.norm(shown, axis=1).max() == pytest.approx(5000.0)


def test_the_picture_is_drawn_from_the_deviations_of_the_diagnosis():
    case = diagnoses.backlash()
    run = data_of(report_page(case))['runs'][0]
    path, left, part = (
        np.reshape(v, (-1, 3)) for v in (run['path'], run['left'], run['parts'][0])
    )
    shown = np.searchsorted(case.traces.t[0] - case.traces.t[0][0], np.array(run['t']) - 6e-4)
    assert np.allclose(path + left + part, 1e6 * case.traces.measured[0][shown], atol=0.2)


def test_unsound_stations_without_a_floor_have_a_page():
    case = diagnoses.nothing()
    bare = replace(case.gap, noise_floor_m=float('nan'))
    page = report_page(replace(case, status='unsound', gap=bare))
    assert 'NaN' not in page and 'nan mm' not in page


def test_the_page_is_printed_on_two_sides_at_most(tmp_path):
    try:
        program()
    except DataError:
        pytest.skip('no Chromium is installed: apt-get install chromium')
    page = tmp_path / 'report.html'
    page.write_text(report_page(diagnoses.circle()), encoding='utf-8')
    print_page(page, tmp_path / 'report.pdf')
    content = (tmp_path / 'report.pdf').read_bytes()
    assert content.startswith(b'%PDF')
    assert 1 <= len(re.findall(rb'/Type /Page\b', content)) <= 2


def test_without_a_browser_it_is_said_before_anything_is_computed(tmp_path, monkeypatch):
    monkeypatch.setenv('PATH', str(tmp_path))
    words = ('--robot', 'ur5', '--pdf', '--out', tmp_path / 'out')
    told = refused('diagnose', tmp_path / 'no bag', *words)
    assert '--pdf needs Chromium' in told and 'print report.html from any browser' in told


@pytest.mark.parametrize(
    ('option', 'value', 'part'),
    [
        ('--tolerance', '-1', '--tolerance -1: give millimetres above 0'),
        ('--uncertainty', 'nan', '--uncertainty nan: give millimetres above 0'),
        ('--joint-names', 'no_file.yaml', 'a prefix of one to three letters such as A, or a YAML'),
    ],
)
def test_what_the_sheet_cannot_use_is_refused_in_a_sentence(option, value, part, tmp_path):
    words = ('--robot', 'ur5', option, value, '--out', tmp_path / 'out')
    assert part in refused('diagnose', tmp_path / 'no bag', *words)


SLOW = ('scipy.interpolate', 'scipy.optimize', 'scipy.stats', 'scipy.spatial', 'matplotlib')
LOADED = f"""
import sys
import weld_twin_core.diagnosis, weld_twin_msgs_py.bags, weld_twin_report.report.diagnosis_files
print([name for name in {SLOW} if name in sys.modules])
"""


def test_a_diagnosis_loads_nothing_slow_that_it_does_not_use():
    said = subprocess.run(
        [sys.executable, '-c', LOADED], capture_output=True, text=True, check=True
    )
    assert said.stdout == '[]\n'
