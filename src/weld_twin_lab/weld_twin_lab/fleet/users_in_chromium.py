# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Users with a real browser, each with a profile of one's own."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from weld_twin_core.errors import DataError

UPLOAD = 120_000.0
"""Milliseconds that an upload may take."""


class InChromium:
    """Somebody in front of a page."""

    def __init__(self, context: Any, root: str) -> None:
        self._page, self._root = context.new_page(), root

    def drop(self, files: Sequence[Path], **fields: str) -> tuple[int, str, str]:
        """Drop a recording; a robot that is none of the list comes as a file."""
        page = self._page
        page.goto(self._root)
        page.set_input_files('#files', [str(file) for file in files])
        for name, value in fields.items():
            if page.locator(f'#{name} option[value="{value}"]').count():
                page.select_option(f'#{name}', value)
        with page.expect_navigation(timeout=UPLOAD) as came:
            page.get_by_role('button', name='Diagnose').click()
        status = came.value.status
        return status, page.url.removeprefix(self._root), page.content()

    def look(self, address: str) -> str:
        """Return what the page shows, which refreshes itself."""
        from playwright.sync_api import Error

        try:
            return str(self._page.content())
        except Error:  # between two pages
            return ''


@contextmanager
def chromium_users(root: str) -> Iterator[Callable[[], InChromium]]:
    """
    Yield what makes users of a server.

    Raises
    ------
    DataError
        There is no Chromium, or nothing that drives it.

    """
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        raise DataError("--chromium needs playwright: pip install 'weld-twin[test]'") from None
    program = shutil.which('chromium') or shutil.which('google-chrome')
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=['--no-sandbox'])
        try:
            yield lambda: InChromium(browser.new_context(), root)
        finally:
            browser.close()
