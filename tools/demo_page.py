# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Runs the demo and writes anew what README, tutorial and start page show of it: picture and sentences.

    tools/in_env python tools/demo_page.py [--out DIR]

It needs Chromium. A DIR that is there already is taken as it is, and the demo is not run again.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / 'docs/demo_page.png'
PAGES = ('README.md', 'docs/index.md', 'docs/tutorial.md')
SIZE = '1000,1290'
"""Of the picture [px]: verdict, figures, what to do and the causes."""
TOLD = re.compile(r'(<!-- the demo says -->\n)(.*?)(<!-- end -->\n)', re.S)
"""Where a page has the sentences."""
COLOURS = 128
"""Of the picture; the page has a dozen, and the edges of its letters the others."""
BROWSERS = ('chromium', 'chromium-browser', 'google-chrome')


def sentences(out: Path) -> tuple[list[str], list[str]]:
    """Return what the demo says of the clear case and of the open one."""
    text = (out / 'summary.txt').read_text(encoding='utf-8')
    lines = text.replace('\N{NO-BREAK SPACE}', ' ').splitlines()
    at = [k for k, line in enumerate(lines) if line.startswith('The gap of ')]
    clear, unclear = (lines[k : k + 2] for k in at)
    return clear, unclear


def block(page: str, clear: list[str], unclear: list[str]) -> str:
    """Return the sentences as a page has them: code in the tutorial, a quotation elsewhere."""
    if page.endswith('tutorial.md'):
        told = [*clear, '', 'Another robot on the same seam:', *unclear]
        return '\n' + ''.join(f'    {line}'.rstrip() + '\n' for line in told) + '\n'
    return f'> {" ".join(clear)}\n\nOf another robot it says what one seam cannot tell:\n\n' + (
        f'> {" ".join(unclear)}\n'
    )


def photograph(page: Path) -> None:
    """Take the picture of the top of a page."""
    browser = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if browser is None:
        sys.exit('the picture needs Chromium; install it, or tools/setup test')
    with tempfile.TemporaryDirectory() as home:
        made = Path(home) / 'page.png'
        words = ['--headless', '--no-sandbox', '--hide-scrollbars', f'--user-data-dir={home}/user',
                 f'--window-size={SIZE}', f'--screenshot={made}', page.resolve().as_uri()]  # fmt: skip
        subprocess.run([browser, *words], check=True, capture_output=True)
        with Image.open(made) as picture:  # few colours: a third of the size, and no less sharp
            picture.convert('RGB').quantize(COLOURS).save(PICTURE, optimize=True)


def main() -> None:
    """Write picture and sentences."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').strip().partition('\n')[0])
    parser.add_argument('--out', type=Path, help='where the demo leaves its results')
    given = parser.parse_args().out
    with tempfile.TemporaryDirectory() as scratch:
        out = given or Path(scratch) / 'out'
        if not out.exists():
            subprocess.run(['weld-twin', 'demo', '--out', str(out)], check=True)
        clear, unclear = sentences(out)
        photograph(out / 'diagnosis/report.html')
    for page in PAGES:
        path = ROOT / page
        text, count = TOLD.subn(
            lambda found: found[1] + block(page, clear, unclear) + found[3],  # noqa: B023
            path.read_text(encoding='utf-8'),
        )
        if count != 1:
            sys.exit(f'{page} has {count} places for what the demo says, not one')
        path.write_text(text, encoding='utf-8')


if __name__ == '__main__':
    main()
