# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The page as a PDF to sign, printed by the Chromium of this machine."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path

from weld_twin_core.errors import DataError

BROWSERS = ('chromium', 'chromium-browser', 'google-chrome', 'microsoft-edge')
_SECONDS = 60
"""Longest that printing may take; it takes two."""
_SETTLED_MS = 3000
"""Time of the page's own clock until it is printed: scripts have drawn by then."""


def browser() -> str:
    """
    Return the browser to print with.

    Raises DataError: there is none.
    """
    result = next(filter(None, map(shutil.which, BROWSERS)), None)
    if result is None:
        raise DataError(
            '--pdf needs Chromium, Chrome or Edge, and none is installed: apt-get install chromium, '
            'or print report.html from any browser'
        )
    return result


def print_page(page: Path, out: Path) -> None:
    """
    Print a page to a PDF.

    Raises DataError: there is no browser, or it did not print.
    """
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
