# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Functions are short: at most forty lines without their docstring."""

import ast

from import_graph import ROOT

MOST = 40


def lines(function):
    """Return the lines of a function, its docstring left out."""
    first = function.body[0]
    told = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    spent = first.end_lineno - first.lineno + 1 if told else 0
    return function.end_lineno - function.lineno + 1 - spent


def functions(source):
    """Yield the functions of a source by name, wherever they stand."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node.name, lines(node)


def test_a_docstring_counts_nothing():
    source = 'def f():\n    """\n    Long.\n\n    """\n    a = 1\n    return a\n'
    assert list(functions(source)) == [('f', 3)]


def test_no_function_is_long():
    files = [file for place in ('src', 'test') for file in (ROOT / place).rglob('*.py')]
    long = {
        f'{file.relative_to(ROOT)}: {name}': count
        for file in files
        for name, count in functions(file.read_text(encoding='utf-8'))
        if count > MOST
    }
    assert long == {}
