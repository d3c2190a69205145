#!/usr/bin/env python3
# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
r"""
Break the code on purpose, one place at a time, and count how often the tests notice.

    tools/in_env python tools/mutants.py            the decision of a diagnosis
    tools/in_env python tools/mutants.py --module weld_twin_core.diagnosis.algebra.gram \
        --tests test/diagnosis/test_normal_equations.py

Mutants: a comparison flipped, or moved by its boundary; a number 25 % up or down; a branch that is
never taken; 'and' for 'or'. A default of a dataclass is a number like any other. Each mutant runs
in a process of its own, forked from one that has imported everything else, so a mutant costs
little more than its tests. Exits with 1 when fewer than --least of them are caught.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import copy
import importlib
import importlib.abc
import importlib.util
import io
import os
import sys
from collections.abc import Iterator, Sequence
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import CodeType, ModuleType

ROOT = Path(__file__).parents[1]
PACKAGES = [ROOT / 'src' / name for name in ('weld_twin_core', 'weld_twin_msgs_py')]
DIAGNOSIS = 'weld_twin_core.diagnosis'
MODULES = tuple(f'{DIAGNOSIS}.{name}' for name in ('verdict.decision', 'beliefs'))
TESTS = ('src/weld_twin_core/test/diagnosis/test_decision.py',)
LEAST = 0.9
"""Share to catch: 33 of 37 kinds were the goal when this began."""
FIELDS = '_verdict'
"""Of the beliefs only those are broken that the verdict reads; the others need whole searches."""

FLIPPED: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.GtE,),
    ast.LtE: (ast.Gt, ast.Lt),
    ast.Gt: (ast.LtE,),
    ast.GtE: (ast.Lt, ast.Gt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
}
"""Strict comparisons of measured numbers are not moved to their boundary: it is never met."""


def places(tree: ast.Module, beliefs: bool) -> Iterator[tuple[ast.AST, str]]:
    """Yield what may be broken: a node of the tree, and how."""
    for node in ast.walk(tree):
        if beliefs:
            if isinstance(node, ast.Call) and getattr(node.func, 'id', '') == FIELDS:
                yield from ((node.args[0], how) for how in ('less', 'more'))
            continue
        if isinstance(node, ast.Compare):
            yield from ((node, f'compare {k}') for k in range(len(FLIPPED[type(node.ops[0])])))
        elif isinstance(node, ast.If | ast.IfExp):
            yield node, 'never'
            yield node, 'always'
        elif isinstance(node, ast.BoolOp):
            yield node, 'and or'
        elif isinstance(node, ast.Constant) and movable(node.value):
            yield from ((node, how) for how in ('less', 'more'))


def movable(value: object) -> bool:
    """Return whether a constant is a number that can be moved; 25 % of 0.0 is nothing."""
    return type(value) is int or (type(value) is float and value != 0.0)


def broken(tree: ast.Module, number: int, beliefs: bool) -> tuple[ast.Module, str]:
    """Return a copy of the tree broken at one place, and what was done in words."""
    tree = copy.deepcopy(tree)
    node, how = list(places(tree, beliefs))[number]
    before = ast.unparse(node)
    if isinstance(node, ast.Compare):
        node.ops[0] = FLIPPED[type(node.ops[0])][int(how.split()[1])]()
    elif isinstance(node, ast.If | ast.IfExp):
        before = f'if {ast.unparse(node.test)}'
        node.test = ast.Constant(how == 'always')
    elif isinstance(node, ast.BoolOp):
        node.op = ast.And() if isinstance(node.op, ast.Or) else ast.Or()
    elif isinstance(node, ast.Constant):
        node.value = moved(node.value, how)
    after = how if isinstance(node, ast.If | ast.IfExp) else ast.unparse(node)
    line = getattr(node, 'lineno', 0)
    return ast.fix_missing_locations(tree), f'line {line}: {before}  ->  {after}'


def moved(value: object, how: str) -> float:
    """Return a number 25 % less or more; whole ones by one at least."""
    assert isinstance(value, int | float)
    way = 1 if how == 'more' else -1
    if isinstance(value, int):
        return value + way * max(1, round(0.25 * abs(value)))
    return value * (1.0 + 0.25 * way)


class Broken(importlib.abc.MetaPathFinder, importlib.abc.InspectLoader):
    """Imports one module from another code than its file's."""

    def __init__(self, name: str, code: CodeType) -> None:
        self.name, self.code = name, code

    def find_spec(self, name: str, path: object, target: object = None) -> ModuleSpec | None:
        return importlib.util.spec_from_loader(name, self) if name == self.name else None

    def get_source(self, name: str) -> None:
        return None

    def get_code(self, name: str) -> CodeType:
        return self.code

    def exec_module(self, module: ModuleType) -> None:
        exec(self.code, module.__dict__)


def survives(name: str, tree: ast.Module, file: Path, tests: Sequence[str]) -> bool:
    """Return whether all tests pass with a broken module."""
    child = os.fork()
    if child == 0:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            sys.meta_path.insert(0, Broken(name, compile(tree, str(file), 'exec')))
            os._exit(int(run(tests) != 0))
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def run(tests: Sequence[str]) -> int:
    """Run tests in this process; 0 when all pass."""
    import pytest

    options = ['-q', '-x', '-p', 'no:cacheprovider', '--no-header', '--import-mode=importlib']
    return int(pytest.main([*options, *tests]))


def prepare(modules: Sequence[str]) -> None:
    """Import what never changes, so that every process starts with it."""
    for place in PACKAGES:
        sys.path.insert(0, str(place))
    import pytest  # noqa: F401

    for name in modules:
        importlib.import_module(name)
    # The rooms of what will be broken are imported anew; what lies outside of them only hands
    # objects on, and stays.
    rooms = {name.rpartition('.')[0] for name in modules} - {DIAGNOSIS}
    for name in list(sys.modules):
        if name in modules or name.rpartition('.')[0] in rooms:
            del sys.modules[name]


def main() -> int:
    """Break everything once, and tell what nobody noticed."""
    parser = argparse.ArgumentParser(description=__doc__.strip().partition('\n')[0])
    parser.add_argument('--module', action='append', metavar='NAME', help='may be repeated')
    parser.add_argument('--tests', action='append', metavar='FILE', help='may be repeated')
    parser.add_argument('--least', type=float, default=LEAST, metavar='SHARE')
    args = parser.parse_args()
    modules, tests = args.module or MODULES, args.tests or TESTS
    os.chdir(ROOT)
    prepare(modules)
    caught, total = 0, 0
    for name in modules:
        file = next(
            path
            for place in PACKAGES
            if (path := place / (name.replace('.', '/') + '.py')).is_file()
        )
        tree, beliefs = ast.parse(file.read_text(encoding='utf-8')), name.endswith('.beliefs')
        for number in range(len(list(places(tree, beliefs)))):
            mutant, words = broken(tree, number, beliefs)
            total += 1
            if survives(name, mutant, file, tests):
                print(f'survives: {name.rpartition(".")[2]}, {words}', flush=True)
            else:
                caught += 1
    print(f'{caught} of {total} mutants caught ({caught / max(total, 1):.0%})')
    return int(caught < args.least * total)


if __name__ == '__main__':
    sys.exit(main())
