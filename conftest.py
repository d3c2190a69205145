# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What holds for the tests of every package, and which of them run side by side."""

import difflib
import fcntl
import gc
import os
import re
import shutil
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# Modules that tests of every package may use.
sys.path.append(str(Path(__file__).parent / 'test'))

# One core is enough for arrays of this size, and the test machine has other work.
os.environ.setdefault('OMP_NUM_THREADS', '1')
# The tests start hundreds of processes; without files of bytecode each compiles all it imports.
os.environ.pop('PYTHONDONTWRITEBYTECODE', None)
sys.dont_write_bytecode = False

# How long an example takes to draw or to run says how busy the machine is.
settings.register_profile(
    'any machine', deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile('any machine')

# Thousands of tests are collected and stay; looking through them for garbage costs a tenth.
gc.disable()


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection(session):
    """Let one process collect before the others: what it compiles in a fresh clone, they only load."""
    if 'PYTEST_XDIST_WORKER' in os.environ:
        shared = Path(session.config.option.basetemp).parent
        with open(shared / 'collected', 'a') as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not os.fstat(lock.fileno()).st_size:
                found = yield
                lock.write('once')
                return found
    return (yield)


def pytest_collection_finish():
    """Look for garbage from now on, only in what is made from now on, and as seldom as `weld-twin`."""
    from weld_twin_nodes.cli.main import GARBAGE

    gc.freeze()
    gc.set_threshold(GARBAGE)
    gc.enable()


def pytest_addoption(parser):
    """Take an option that keeps what is said now, for whoever meant to change it."""
    parser.addoption('--keep', action='store_true', help='keep texts as they are now')


CELLS = 'cells'
WHOLE = ('contacts', 'diagnosis', 'report', 'soundness')
"""Folders whose tests make whole diagnoses, or open pages."""
ASKS = re.compile(r"diagnosed?\(|'diagnose'|'investigate'|browser|chromium")
"""What files elsewhere say that make diagnoses or open pages."""


def pytest_collection_modifyitems(items):
    """
    Put the tests that start nodes first, which wait more than they work; then files with slow ones.

    Then whole diagnoses, so that nothing that takes long is begun last. The folders come as
    pyproject.toml lists them.
    """
    first = {item.path for item in items if item.get_closest_marker('slow')}
    files = {item.path for item in items}
    whole = {p for p in files if p.parent.name in WHOLE or ASKS.search(p.read_text('utf-8'))}
    items.sort(
        key=lambda item: (
            item.get_closest_marker(CELLS) is None,
            item.path not in first,
            item.path not in whole,
        )
    )


FIRST_LINE = ('/recording/', '/install/', '/cli/', '/live/test_l')
"""Places whose cells stand in the first of two lines; both take about two minutes."""
BESIDE = 5
"""How much less the other tests weigh for the scheduler than those of cells, which stand in line one
after the other and would else end last; 5 is a third of the weight."""


SOLVED = 'test/diagnosis: solved('
"""Folder, and what its files call for a diagnosis that is made once in a process."""
HOUSE = 'test/house'
"""Folder whose tests read all sources, each once in a process."""


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    """Let tests of cells go first where tests run side by side; their nodes are forks."""
    if item.get_closest_marker(CELLS) is not None:
        with suppress(ImportError):  # some of them run without ROS
            from weld_twin_nodes.harness import NodeProcess

            # As interpreters of their own they start in test_starting, test_colcon and test_demo.
            NodeProcess.forked = True
    beside = 'PYTEST_XDIST_WORKER' in os.environ and item.get_closest_marker(CELLS) is None
    if beside and os.getpriority(os.PRIO_PROCESS, 0) < BESIDE:
        os.setpriority(os.PRIO_PROCESS, 0, BESIDE)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers():
    """Return one process for each core, and two for the tests of cells: they wait most of the time."""
    return (os.cpu_count() or 1) + 2


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """
    Return what hands out the tests of `make test`.

    Files with the mark `cells` stand in two lines, those that record or install and the others, so
    that no more than two cells of nodes compete for the processor. Any other file goes to the next
    process that is free, and stays whole, so that its fixtures are made once; files that ask
    `SOLVED` for the same diagnoses stay together, and so do those of the `HOUSE`.
    """
    from xdist.scheduler import LoadScopeScheduling

    class ByFile(LoadScopeScheduling):
        @cache  # noqa: B019 - lives as long as the program
        def _split_scope(self, nodeid):
            file = nodeid.partition('::')[0]
            text = (config.rootpath / file).read_text(encoding='utf-8')
            if file.startswith(HOUSE):
                return HOUSE
            if f'mark.{CELLS}' not in text:
                folder, call = SOLVED.split(': ')
                return SOLVED if file.startswith(folder) and call in text else file
            return f'{CELLS} {any(part in file for part in FIRST_LINE)}'

    return ByFile(config, log)


SMALLER = {
    'predicting.sizes': {'SWEEPS': 12, 'LEARNING': 3, 'KEPT': 10},
    'predicting.leftover': {'MOST': 100},
    'advice.candidates': {'STATIONS': 24, 'PATHS': 3},
}
"""How many models are drawn in tests and samples looked at, by rooms of the diagnosis: an eighth of what
users get, so that what is named may not hang on it; stations and paths to choose from are a third."""
DRAWN = 'drawn'
"""Mark of files that are about what is drawn or proposed, or run what users run from end to end."""


@pytest.fixture(scope='module', autouse=True)
def fewer_models(request):
    """
    Let diagnoses draw fewer models in files without the mark `DRAWN`: a quarter of their time.

    The next measurement, another fifth, is chosen from fewer. Tests that leave out most kinds of
    causes do not look at these at all, which is half of their time; users' diagnoses still hold them
    against what is found. Tests that leave out a few are about that, and look at all.
    """
    if request.node.get_closest_marker(DRAWN) is not None:
        yield
        return
    from weld_twin_core.diagnosis.hypotheses import library, search

    build, kinds = library.build, library.candidate_kinds

    def of_few(problem, model, scale, exclude=()):
        every = kinds(problem.align)
        few = [kind for kind in every if kind.name not in exclude]
        with pytest.MonkeyPatch.context() as changed:
            if 2 * len(few) < len(every):
                changed.setattr(library, 'candidate_kinds', lambda *_: few)
            return build(problem, model, scale, exclude)

    with pytest.MonkeyPatch.context() as changed:
        for room, sizes in SMALLER.items():
            for name, size in sizes.items():
                changed.setattr(f'weld_twin_core.diagnosis.{room}.{name}', size)
        changed.setattr(search, 'build', of_few)
        yield SMALLER


@pytest.fixture(scope='session')
def once(tmp_path_factory):
    """Return a function that makes a folder, by its name, once for all processes of a test run."""
    place = tmp_path_factory.getbasetemp()
    place = (place.parent if 'PYTEST_XDIST_WORKER' in os.environ else place) / 'once'
    place.mkdir(exist_ok=True)

    def made(name, make):
        with open(place / f'{name}.lock', 'w') as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)  # the others wait, or have it
            if not (place / name).exists():
                make(place / f'{name}.half')
                (place / f'{name}.half').rename(place / name)
        return place / name

    return made


@pytest.fixture(scope='session')
def elbow_found(once):
    """Return the folder of a diagnosis of the example bag; who changes it copies it first."""
    from weld_twin_nodes.cli.in_process import weld_twin

    def diagnosed(out):
        bag = Path(__file__).parent / 'bags/elbow_play'
        said = weld_twin('diagnose', bag, '--robot', 'ur5', '--out', out)
        assert said.code == 0, said.err

    return once('elbow_found', diagnosed)


NUMBER = re.compile(r'-?\d+(?:\.(\d+))?(?:e([-+]\d+))?')
NEAR, NOTHING = 2e-3, 1e-8
"""Share by which numbers may differ, for other versions of what computes them, and what is rounding."""


def nearly(now, before):
    """Return whether two texts differ in no word, and in numbers by hardly one of the last digit."""
    if NUMBER.sub('#', now) != NUMBER.sub('#', before):
        return False
    pairs = zip(NUMBER.finditer(now), NUMBER.finditer(before), strict=True)
    return all(close(a, b) for a, b in pairs if a[0] != b[0])


def close(now, before):
    """Return whether two numbers as they were written are alike."""
    one, other = float(now[0]), float(before[0])
    if now[2] and before[2] and max(abs(one), abs(other)) < NOTHING:
        return True
    digit = 10.0 ** (int(before[2] or 0) - len(before[1] or ''))
    return abs(one - other) < max(1.5 * digit, NEAR * abs(other)) * bool(before[1] or before[2])


@pytest.fixture
def kept(request):
    """
    Return a function that holds a text or a page against what is kept under its name beside the test.

    What is long and nearly another text is kept as what differs from that. After a change that is
    meant to change what is said, `pytest --keep PATH` keeps it anew, and the difference is read.
    """
    from page_text import page_text

    def hold(name, text, base=None):
        text = page_text(text) if text.startswith('<!doctype html>') else text
        text = text.replace('\r\n', '\n')  # as languages of programs have it
        if base is not None:
            both = base.splitlines(), text.splitlines()
            text = '\n'.join(list(difflib.unified_diff(*both, n=0, lineterm=''))[2:]) + '\n'
            text = re.sub('^@@.*@@$', '@@', text, flags=re.MULTILINE)
        file = request.path.parent / 'kept' / f'{name}.txt'
        if request.config.getoption('--keep'):
            file.parent.mkdir(exist_ok=True)
            file.write_text(text, encoding='utf-8')
        before = file.read_text(encoding='utf-8')
        if not nearly(text, before):
            told = difflib.unified_diff(before.splitlines(), text.splitlines(), 'kept', 'now')
            pytest.fail('\n'.join(told))

    return hold


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
        made = playwright.chromium.launch(
            executable_path=program, args=['--no-sandbox', '--disable-gpu']
        )
        yield made
        made.close()


CONTRAST = 'color-contrast'
AXE = '(options) => axe.run(document, options).then((told) => told.violations)'
CLIPPED = """() => [...document.querySelectorAll('main *')].filter((item) => {
  const box = item.getBoundingClientRect(), style = getComputedStyle(item);
  if (!box.width || !item.checkVisibility() || style.position === 'absolute') return false;
  if (item.closest('.scroll, .u-wrap')) return false;
  return box.right > innerWidth + 1 || (item.scrollWidth > item.clientWidth + 2
    && style.overflowX === 'hidden' && !item.classList.contains('plot'));
}).map((item) => item.outerHTML.slice(0, 90))"""
OVERLAP = """() => {
  const kinds = 'h1, h2, h3, p, li, dt, dd, td, th, label, button, figcaption';
  const items = [...document.querySelectorAll(`main :is(${kinds})`)]
    .filter((item) => item.checkVisibility() && item.textContent.trim() && !item.closest('.uplot'))
    .map((item) => [item, item.getBoundingClientRect()]).filter(([, box]) => box.width && box.height);
  const out = [];
  items.forEach(([a, p], i) => items.slice(i + 1).forEach(([b, q]) => {
    if (a.contains(b) || b.contains(a)) return;
    const w = Math.min(p.right, q.right) - Math.max(p.left, q.left);
    const h = Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top);
    if (w > 2 && h > 2) out.push(`${a.textContent.slice(0, 30)} | ${b.textContent.slice(0, 30)}`);
  }));
  return out;
}"""
EMPTY = """() => [...document.querySelectorAll('canvas')].filter((item) => {
  if (!item.checkVisibility()) return false;
  if (!item.width || !item.height) return true;
  const small = document.createElement('canvas');
  small.width = small.height = 60;
  const pen = small.getContext('2d', { willReadFrequently: true });
  pen.drawImage(item, 0, 0, 60, 60);
  return !pen.getImageData(0, 0, 60, 60).data.some((value) => value);
}).length"""


class Browser:
    """Opens pages given as text one after the other in a tab, and notes what they say on the console."""

    def __init__(self, tab, folder):
        self.tab, self.folder, self.console = tab, folder, []
        self._listeners = {
            'console': lambda message: self.console.append(message.text),
            'pageerror': lambda error: self.console.append(str(error)),
            'request': lambda request: self._only_files(request.url),
        }
        for event, listener in self._listeners.items():
            tab.on(event, listener)

    def open(self, text):
        """Return the open page, as wide as a screen, in light colours."""
        place = self.folder / 'page.html'
        place.write_text(text, encoding='utf-8')
        self.tab.mouse.move(0, 0)
        self.tab.set_viewport_size({'width': 1100, 'height': 900})
        self.tab.emulate_media(media='null', color_scheme='light')
        self.console = []
        self.tab.goto(place.as_uri())
        return self.tab

    def hindrances(self, text, sides=None):
        """Return what hinders reading a page: light, dark, on a phone, on paper; or on its console."""
        axe = pytest.importorskip('axe_playwright_python.sync_playwright').Axe()
        page, out = self.open(text), []
        count = self.sides() if sides else 0
        out += [f'{count} sides'] * (count > (sides or 0))
        page.evaluate(axe.axe_script)
        # Contrasts are those of a scheme, and take longest where a page is narrow.
        shape, colours = {'rules': {CONTRAST: {'enabled': False}}}, {'runOnly': [CONTRAST]}
        told_alone = {'resultTypes': ['violations']}
        looks = ((390, 'light', shape), (1100, 'light', colours), (1100, 'dark', colours))
        for width, scheme, rules in looks:
            page.set_viewport_size({'width': width, 'height': 900})
            page.emulate_media(color_scheme=scheme)
            page.wait_for_timeout(60)
            told = [*page.evaluate(CLIPPED), *page.evaluate(OVERLAP)]
            told += ['an empty drawing'] * page.evaluate(EMPTY)
            for found in page.evaluate(AXE, rules | told_alone):
                if found['impact'] in ('serious', 'critical'):
                    told += [f'{found["id"]}: {node["html"][:90]}' for node in found['nodes'][:4]]
            if sides and width < 1100 and self.sides() != count:
                told.append('it is printed on more sides from here')
            out += [f'{width} {scheme}: {item}' for item in told]
        page.emulate_media(media='print', color_scheme='light')
        return [*out, *(f'print: {item}' for item in page.evaluate(CLIPPED)), *self.console]

    def sides(self):
        """Return on how many sides of paper the open page is printed."""
        return len(re.findall(rb'/Type /Page\b', self.tab.pdf(prefer_css_page_size=True)))

    def _only_files(self, url):
        if not url.startswith(('file:', 'data:')):
            self.console.append(f'fetched {url}')

    def close(self):
        """Hear no more of the tab."""
        for event, listener in self._listeners.items():
            self.tab.remove_listener(event, listener)


@pytest.fixture(scope='session')
def tab(chromium):
    """Return one tab for all pages; a window for each costs as much as what is drawn in it."""
    return chromium.new_context().new_page()


@pytest.fixture
def browser(tab, tmp_path):
    """Return a browser that opens pages given as text."""
    made = Browser(tab, tmp_path)
    yield made
    made.close()
