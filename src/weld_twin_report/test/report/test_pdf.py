# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The page as a PDF, and what is said where it cannot be made."""

import re

import diagnoses
import pytest

from weld_twin_core.errors import DataError
from weld_twin_nodes.cli.in_process import weld_twin
from weld_twin_report.report import report_page
from weld_twin_report.report.diagnosis_files import browser as program
from weld_twin_report.report.diagnosis_files import print_page


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
    code, _, told = weld_twin(
        'diagnose', tmp_path / 'no bag', '--robot', 'ur5', '--pdf', '--out', tmp_path / 'out'
    )
    assert code == 2
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
    code, _, told = weld_twin(
        'diagnose', tmp_path / 'no bag', '--robot', 'ur5', option, value, '--out', tmp_path / 'out'
    )
    assert code == 2 and part in told
