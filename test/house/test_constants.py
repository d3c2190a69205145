# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A number at the top of a file says below it what it means, its unit, and why it is what it is."""

import ast
from itertools import zip_longest

from import_graph import ROOT, module_files, parsed

UNITS = {'NANOSECOND', 'NANOSECONDS', 'DEGREE', 'PLACES'}
"""Constants whose name says it all."""


def is_number(value):
    """Return whether an expression is a number, some numbers, or numbers computed from others."""
    parts = list(ast.walk(value))
    named = any(isinstance(part, ast.Dict | ast.Lambda | ast.ListComp) for part in parts)
    texts = any(isinstance(part, ast.Constant) and isinstance(part.value, str) for part in parts)
    numbers = any(
        isinstance(part, ast.Constant) and type(part.value) in (int, float) for part in parts
    )
    return numbers and not named and not texts


def untold(body):
    """Return the names of the numbers at the top of a source that no sentence follows."""
    out = []
    for node, after in zip_longest(body, body[1:]):
        targets = node.targets if isinstance(node, ast.Assign) else []
        if isinstance(node, ast.AnnAssign) and node.value is not None:
            targets = [node.target]
        names = [name.id for t in targets for name in ast.walk(t) if isinstance(name, ast.Name)]
        told = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
        if names and all(n.isupper() for n in names) and is_number(node.value) and not told:
            out += [name for name in names if name.strip('_') not in UNITS]
    return out


def test_an_untold_number_is_found():
    source = 'A = 1.0\nB = 2\n"""Two."""\nC, D = 3, np.pi\nE = "x"\nF: float = -1e-3\ng = 5\n'
    assert untold(ast.parse(source).body) == ['A', 'C', 'D', 'F']


def test_every_number_says_what_it_means():
    files = module_files(ROOT / 'src')
    named = {name: untold(parsed(file).body) for name, file in files.items()}
    assert {name: found for name, found in named.items() if found} == {}
