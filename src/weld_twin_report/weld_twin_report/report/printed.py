# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a print needs beside its signatures: what it was made from, and what it leaves open."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePath

from weld_twin_core import __version__
from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_msgs_py.files.input_files import InputFile
from weld_twin_nodes.wording.words import passed

from .answer import Answer
from .footing import measured_next
from .html import Child, Html, pairs, tag

_SHORT = 12
"""Digits of a hash that tell files apart on paper; the page has all."""
_FILES = 4
"""Files told on paper; the page has all."""
_FINDINGS = 3
"""Checks told on paper, the gravest; the page has all."""


def printed_section(answer: Answer, inputs: Sequence[InputFile], judged: Html | None) -> Html:
    """Return what only a print shows, with the lines to sign on: a side may part from the other."""
    diagnosis = answer.diagnosis
    rows: list[tuple[str, Child]] = [
        ('Data', _data(diagnosis)),
        ('Cannot be told apart', '; '.join(answer.open)),
        ('Measure next', measured_next(diagnosis)),
        ('Made from', _files(inputs)),
    ]
    lines = [tag('span', text) for text in ('Checked by', 'Date', 'Signature')]
    status = tag('span', answer.status, class_=f'status {diagnosis.status}')
    return tag(
        'section.printed', pairs(rows), tag('div', status, judged), tag('p.signatures', *lines)
    )


def _data(diagnosis: Diagnosis) -> str:
    """Return what stood out of the data; warnings before notes."""
    open_ones = [c for level in ('unsound', 'warning', 'note') for c in diagnosis.checks
                 if c.level == level]  # fmt: skip
    fine = len(diagnosis.checks) - len(open_ones)
    reported = [f'{check.level}: {check.sentence}' for check in open_ones[:_FINDINGS]]
    if len(open_ones) > _FINDINGS:
        reported.append(f'{len(open_ones) - _FINDINGS} more are on the page.')
    return ' '.join([f'{passed(fine, len(diagnosis.checks)).capitalize()}.', *reported])


def _files(inputs: Sequence[InputFile]) -> Html:
    """Return files, the start of their hashes, the version, and when it was printed."""
    reported = [f'{PurePath(item.path).name} (SHA-256 {item.sha256[:_SHORT]}…)' for item in inputs]
    more = [f'{len(reported) - _FILES} more'] if len(reported) > _FILES else []
    named = '; '.join([*reported[:_FILES], *more, f'weld_twin {__version__}'])
    return tag('span', named, tag('span#printed-at'))
