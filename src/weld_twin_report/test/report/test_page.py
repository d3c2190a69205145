# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The page as a browser has it, or a print: no script errors, nothing fetched, readable at any width."""

import json
import re
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from io import BytesIO

import diagnoses
import numpy as np
import pytest
from command_line import refused
from matplotlib.image import imread

from weld_twin_core.diagnosis.result import Check, Traces
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.input_files import InputFile
from weld_twin_report.report import report_page
from weld_twin_report.report.diagnosis_files import browser as program
from weld_twin_report.report.diagnosis_files import print_page
from weld_twin_report.report.page_data import page_data


@pytest.fixture(scope='module', params=list(diagnoses.ALL))
def case(request):
    return diagnoses.ALL[request.param]()


def embedded(page):
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
    run = embedded(report_page(case))['runs'][0]
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
