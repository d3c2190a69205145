# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What holds for the tests of every package, and which of them run side by side."""

import os
import shutil
from functools import cache

import pytest

# One core is enough for arrays of this size, and the test machine has other work.
os.environ.setdefault('OMP_NUM_THREADS', '1')

CELLS = 'cells'


def pytest_collection_modifyitems(items):
    """
    Put the tests that start nodes first, which wait more than they work; then files with slow ones.

    So that nothing that takes long is begun last.
    """
    slow = {item.path for item in items if item.get_closest_marker('slow')}
    items.sort(key=lambda item: (item.get_closest_marker(CELLS) is None, item.path not in slow))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers():
    """Return one process for each core, and one for the tests of cells: it waits most of the time."""
    return (os.cpu_count() or 1) + 1


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """
    Return what hands out the tests of `make test`.

    Files with the mark `cells` go to one process, one after the other, so that no two cells of
    nodes compete for the processor. Any other file goes to the next process that is free, and
    stays whole, so that its fixtures are made once.
    """
    from xdist.scheduler import LoadScopeScheduling

    class ByFile(LoadScopeScheduling):
        @cache  # noqa: B019 - lives as long as the program
        def _split_scope(self, nodeid):
            file = nodeid.partition('::')[0]
            text = (config.rootpath / file).read_text(encoding='utf-8')
            return CELLS if f'mark.{CELLS}' in text else file

    return ByFile(config, log)


BROWSERS = ('chromium', 'chromium-browser', 'google-chrome')


@pytest.fixture(scope='session')
def chromium():
    """Return a headless Chromium, one for the whole process; the tests open pages in it."""
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        pytest.skip('no Chromium is installed: apt-get install chromium')
    api = pytest.importorskip(
        'playwright.sync_api', reason='Playwright is missing: tools/setup test'
    )
    with api.sync_playwright() as playwright:
        made = playwright.chromium.launch(executable_path=program, args=['--no-sandbox'])
        yield made
        made.close()


class Browser:
    """Opens pages given as text, and notes what they say on the console."""

    def __init__(self, chromium, folder):
        self.chromium, self.folder, self.console = chromium, folder, []
        self.contexts = []

    def open(self, text, *, width=1100, height=900, **how):
        """Return the open page; ``how`` is for the context, such as ``color_scheme='dark'``."""
        place = self.folder / f'page{len(self.contexts)}.html'
        place.write_text(text, encoding='utf-8')
        context = self.chromium.new_context(viewport={'width': width, 'height': height}, **how)
        self.contexts.append(context)
        page = context.new_page()
        self.console = []
        page.on('console', lambda message: self.console.append(message.text))
        page.on('pageerror', lambda error: self.console.append(str(error)))
        page.on('request', lambda request: self._only_files(request.url))
        page.goto(place.as_uri())
        return page

    def _only_files(self, url):
        if not url.startswith(('file:', 'data:')):
            self.console.append(f'fetched {url}')

    def close(self):
        """Close all pages."""
        for context in self.contexts:
            context.close()


@pytest.fixture
def browser(chromium, tmp_path):
    """Return a browser that opens pages given as text."""
    made = Browser(chromium, tmp_path)
    yield made
    made.close()
