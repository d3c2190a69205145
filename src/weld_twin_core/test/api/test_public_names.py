# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""`import weld_twin_core as wt` shows what there is, quickly, and every example in it runs."""

import ast
import doctest
import importlib
import inspect
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import weld_twin_core as wt

SOURCE = Path(wt.__file__)
QUICK = """
import sys
import weld_twin_core as wt
names = dir(wt)
heavy = [name for name in ('numpy', 'scipy', 'weld_twin_core.arm') if name in sys.modules]
print(heavy)
"""


def public():
    return list(wt.__all__)


def objects_of(name):
    """Return a public object, or what a public module lists itself."""
    found = getattr(wt, name)
    if not isinstance(found, ModuleType):
        return [found]
    own = [getattr(found, k) for k in getattr(found, '__all__', ())]
    return [found, *(o for o in own if inspect.isclass(o) or inspect.isfunction(o))]


def test_importing_it_loads_no_array_library():
    done = subprocess.run(
        [sys.executable, '-c', QUICK], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == '[]'


def test_dir_lists_what_can_be_had_and_a_name_that_does_not_exist_is_told():
    assert set(public()) <= set(dir(wt))
    assert [name for name in public() if not hasattr(wt, name)] == []
    with pytest.raises(AttributeError, match="no public name 'diagnoze'; dir"):
        wt.diagnoze  # noqa: B018


def test_type_checkers_see_the_same_names_from_the_same_modules():
    tree = ast.parse(SOURCE.read_text())
    block = next(node for node in tree.body if isinstance(node, ast.If))
    seen = {}
    for node in block.body:
        assert isinstance(node, ast.ImportFrom)
        for alias in node.names:
            assert alias.asname == alias.name, 'a re-export says "import x as x"'
            seen[alias.name] = node.module
    assert sorted(seen) == sorted(public())
    for name, module in seen.items():
        home = importlib.import_module(f'weld_twin_core{"." + module if module else ""}')
        assert getattr(home, name) is getattr(wt, name), name


@pytest.mark.parametrize('name', public())
def test_every_public_name_has_an_example_that_runs(name):
    found = getattr(wt, name)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    test = doctest.DocTestParser().get_doctest(
        inspect.getdoc(found) or '', {'np': np}, name, None, None
    )
    assert test.examples, f'{name} has no example'
    report: list[str] = []
    runner.run(test, out=report.append)
    assert runner.failures == 0, ''.join(report)


@pytest.mark.parametrize('name', public())
def test_every_argument_of_a_public_function_is_described(name):
    missing = []
    for thing in objects_of(name):
        if not inspect.isfunction(thing):
            continue
        text = inspect.getdoc(thing) or ''
        named = [p for p in inspect.signature(thing).parameters if p not in ('self', 'cls')]
        described = text.partition('Parameters\n----------')[2].partition('\n\n---')[0]
        missing += [f'{thing.__qualname__}({p})' for p in named if p not in described]
    assert missing == []
