# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The report as one HTML file that needs nothing else: no network, no other file."""

from __future__ import annotations

from collections.abc import Sequence

from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_msgs_py.files.input_files import InputFile

from .cause_levels import levels_section
from .cause_list import causes_section
from .changed_section import changed_section
from .charts import embedded
from .contact_clouds import contacts_section
from .footing import checks_section, inputs_section, next_section
from .gap_location import where_section
from .headline import header, opening
from .html import Html, document, own_file, tag
from .seam_view import seam_data, seam_section
from .shrinking import shrink_section
from .words import STATUS


def report_page(diagnosis: Diagnosis, inputs: Sequence[InputFile] = ()) -> str:
    """
    Return the page.

    Parameters
    ----------
    diagnosis : Diagnosis
    inputs : sequence of InputFile
        What it was made from, as the page lists it.

    """
    causes = () if diagnosis.status == 'unsound' else _causes(diagnosis)
    body = tag(
        'main',
        header(diagnosis),
        opening(diagnosis),
        *causes,
        checks_section(diagnosis),
        inputs_section(inputs),
    )
    title = f'{STATUS[diagnosis.status]} · {diagnosis.model.robot.name} · diagnosis'
    data = embedded(seam_data(diagnosis), 'data')
    script = tag('script', own_file('page.js'))
    return document(title, body, data, script, charts=True)


def _causes(diagnosis: Diagnosis) -> tuple[Html | None, ...]:
    """Return where the gap lies, what causes it, what that brings, and what to measure next."""
    return (
        seam_section(diagnosis) if diagnosis.contacts is None else contacts_section(diagnosis),
        levels_section(diagnosis),
        where_section(diagnosis),
        causes_section(diagnosis),
        changed_section(diagnosis),
        shrink_section(diagnosis),
        next_section(diagnosis),
    )
