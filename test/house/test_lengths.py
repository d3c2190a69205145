# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Functions and lines are short: forty lines without the docstring, and as wide as flake8 takes."""

import ast

from import_graph import ROOT, parsed

MOST = 40
WIDEST = 105
"""Characters of a line in setup.cfg; ruff passes over one that ends in a comment for a tool."""


def lines(function):
    """Return the lines of a function, its docstring left out."""
    first = function.body[0]
    told = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    spent = first.end_lineno - first.lineno + 1 if told else 0
    return function.end_lineno - function.lineno + 1 - spent


def functions(tree):
    """Yield the functions of a source by name, wherever they stand."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node.name, lines(node)


def test_a_docstring_counts_nothing():
    source = 'def f():\n    """\n    Long.\n\n    """\n    a = 1\n    return a\n'
    assert list(functions(ast.parse(source))) == [('f', 3)]


def test_no_function_is_long():
    files = [file for place in ('src', 'test') for file in (ROOT / place).rglob('*.py')]
    long = {
        f'{file.relative_to(ROOT)}: {name}': count
        for file in files
        for name, count in functions(parsed(file))
        if count > MOST
    }
    assert long == {}


def test_no_line_is_wide():
    wide = [
        f'{file.relative_to(ROOT)}:{k}'
        for file in (ROOT / 'src').rglob('*.py')
        for k, line in enumerate(file.read_text(encoding='utf-8').splitlines(), 1)
        if len(line) > WIDEST
    ]
    assert wide == []
