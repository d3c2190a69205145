# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What holds for the tests of every package, and which of them run side by side."""

import os
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
