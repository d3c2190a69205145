# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The summary on a narrow terminal: no word is broken."""

from __future__ import annotations

import diagnoses
import pytest
from rich.console import Console

from weld_twin_report.report import print_summary


@pytest.fixture(scope='module', params=[diagnoses.backlash, diagnoses.unknown])
def made(request):
    return request.param()


@pytest.mark.parametrize('width', [40, 80, 140])
def test_no_word_is_broken(made, width, capsys):
    wide, narrow = (Console(highlight=False, width=w) for w in (400, width))
    print_summary(made, wide)
    whole = set(capsys.readouterr().out.split())
    print_summary(made, narrow)
    shown = capsys.readouterr().out
    assert max(map(len, shown.splitlines())) <= width
    heads = {f'{word}:' for word in whole} | {'error:'}
    assert [word for word in shown.split() if word not in whole | heads] == []
