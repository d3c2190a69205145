# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Make the made-up diagnoses importable; a headless browser to look at pages with."""

import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

sys.path.insert(0, str(Path(__file__).parent))

BROWSERS = ('chromium', 'chromium-browser', 'google-chrome')


class Seen(NamedTuple):
    """What a browser made of a page: its DOM after the scripts ran, and console messages."""

    dom: str
    console: list[str]


class Browser:
    def __init__(self, program, folder):
        self.command = [
            program,
            '--headless',
            '--no-sandbox',
            '--disable-gpu',
            '--hide-scrollbars',
            f'--user-data-dir={folder / "profile"}',
            '--virtual-time-budget=4000',
            '--enable-logging=stderr',
            '--no-first-run',
        ]
        self.folder = folder

    def run(self, page, *options, width=1100, height=3000):
        result = subprocess.run(
            [*self.command, f'--window-size={width},{height}', *options, page.as_uri()],
            capture_output=True,
            text=True,
            timeout=90,
            check=False,
        )
        return result.stdout, re.findall(r'CONSOLE[^"]*"(.*)"', result.stderr)

    def look(self, text, **size):
        page = self.folder / 'page.html'
        page.write_text(text, encoding='utf-8')
        return Seen(*self.run(page, '--dump-dom', **size))

    def picture(self, text, **size):
        page, out = self.folder / 'page.html', self.folder / 'page.png'
        page.write_text(text, encoding='utf-8')
        self.run(page, f'--screenshot={out}', **size)
        return out

    def printed(self, text):
        page, out = self.folder / 'page.html', self.folder / 'page.pdf'
        page.write_text(text, encoding='utf-8')
        self.run(page, f'--print-to-pdf={out}', '--no-pdf-header-footer')
        return out


@pytest.fixture
def browser(tmp_path):
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        pytest.skip(f'none of {", ".join(BROWSERS)} is installed; apt-get install chromium')
    return Browser(program, tmp_path)
