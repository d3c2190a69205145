# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The files a diagnosis leaves behind, the page as a PDF to sign among them."""

import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from weld_twin_core import __version__
from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.input_files import InputFile
from weld_twin_msgs_py.files.joint_file import write_joint_motion
from weld_twin_msgs_py.files.posterior_entry import sealed
from weld_twin_msgs_py.files.whole_files import json_text, write_text
from weld_twin_msgs_py.robots.urdf_write import GivenUrdf
from weld_twin_nodes.offline.exports import where_it_holds, write_all

from .diagnosis_page import Sheet, report_page
from .to_do import weighed

BROWSERS = ('chromium', 'chromium-browser', 'google-chrome', 'microsoft-edge')
_SECONDS = 60
"""Longest that printing may take; it takes two."""
_SETTLED_MS = 3000
"""Time of the page's own clock until it is printed: scripts have drawn by then."""


def browser() -> str:
    result = next(filter(None, map(shutil.which, BROWSERS)), None)
    if result is None:
        raise DataError(
            '--pdf needs Chromium, Chrome or Edge, and none is installed: apt-get install chromium, '
            'or print report.html from any browser'
        )
    return result


def print_page(page: Path, out: Path) -> None:
    program = browser()
    with tempfile.TemporaryDirectory() as profile:
        command = [
            program,
            '--headless',
            '--no-sandbox',
            '--disable-gpu',
            '--no-first-run',
            '--no-pdf-header-footer',
            f'--user-data-dir={profile}',
            f'--virtual-time-budget={_SETTLED_MS}',
            f'--print-to-pdf={out.resolve()}',
            page.resolve().as_uri(),
        ]
        try:
            subprocess.run(command, capture_output=True, timeout=_SECONDS, check=True)
        except (subprocess.SubprocessError, OSError) as error:
            raise DataError(f'{page}: {program} did not print it ({error})') from None
    if not out.is_file():
        raise DataError(f'{page}: {program} did not print it')


RESULT = 'diagnosis.json'
PAGE = 'report.html'
PDF = 'report.pdf'
NEXT = 'next_experiment.yaml'
"""The motion to measure next, where one decides; the trajectory generator runs it."""
TOUCHES = 'next_touches.csv'
"""Postures to touch in next: a table to guide the arm by, and no motion, which would tear the ball
from one posture to the next while it rests in its socket."""


def write_results(
    directory: Path,
    diagnosis: Diagnosis,
    inputs: Sequence[InputFile],  # what it was made from
    # The URDF that the robot was read from; ``robot.urdf`` then keeps its names.
    given: GivenUrdf | None = None,
    sheet: Sheet | None = None,  # what the reader wants of the page
) -> None:
    """Write diagnosis.json and the page, and of sound data the model and what to measure next."""
    wanted = diagnosis.next_experiment
    if wanted is not None and wanted.get('motion') is not None:
        file = NEXT if 'contact' not in wanted['motion'] else TOUCHES
        if file == NEXT:
            write_joint_motion(directory / file, wanted['motion'], wanted['sentence'])
        else:
            from weld_twin_msgs_py.tables import write_touches  # loads much that few need

            write_touches(directory / file, wanted['motion'])
        diagnosis = replace(diagnosis, next_experiment={**wanted, 'file': file})
    write_text(directory / PAGE, report_page(diagnosis, inputs, sheet))
    if diagnosis.status != 'unsound':
        posterior = diagnosis.posterior
        notes = [] if posterior is None else where_it_holds(posterior)
        write_all(directory, diagnosis.model, notes, given)
    write_text(directory / RESULT, diagnosis_text(diagnosis, inputs))


def diagnosis_text(diagnosis: Diagnosis, inputs: Sequence[InputFile]) -> str:
    """Return the text of diagnosis.json; what is not a finite number is null."""
    content = diagnosis.as_dict()
    if content['candidates'] is not None:
        content['candidates'] = _candidates(diagnosis, content['candidates'])
    if content['posterior'] is not None:
        content['posterior'] = sealed(content['posterior'])
    content['inputs'] = [item.as_dict() for item in inputs]
    content['version'] = __version__
    return json_text(content)


def _candidates(diagnosis: Diagnosis, entries: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """
    Return the candidates without effects that were asked to be left out.

    One that is the same error as what is named, on any motion, stays, marked as excluded.
    """
    tried = set(weighed(diagnosis))
    named = {site for group in diagnosis.indistinguishable for site in group}
    return [
        item if own in tried else {**item, 'excluded': True}
        for own, item in zip(diagnosis.candidates, entries, strict=True)
        if own in tried or own.site in named
    ]
