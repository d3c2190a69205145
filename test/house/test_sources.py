# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What sources hold: short functions and lines, numbers that say what they mean, no effect by name."""

import ast
import sys
from itertools import zip_longest

from import_graph import ROOT, module_files, parsed, statements

from weld_twin_core.effects import REGISTRY

sys.path.insert(0, str(ROOT / 'tools'))

from numbers_tuned import CORE, tuned

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
    for node in statements(tree):
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


def test_every_number_says_what_it_means_and_one_that_does_not_is_found():
    source = 'A = 1.0\nB = 2\n"""Two."""\nC, D = 3, np.pi\nE = "x"\nF: float = -1e-3\ng = 5\n'
    assert untold(ast.parse(source).body) == ['A', 'C', 'D', 'F']
    files = module_files(ROOT / 'src')
    named = {name: untold(parsed(file).body) for name, file in files.items()}
    assert {name: found for name, found in named.items() if found} == {}


SOUNDNESS = 40
"""Tuned numbers of all checks of data and set-up together."""


def test_units_and_indices_are_no_tuned_numbers_and_defaults_are(tmp_path):
    source = tmp_path / 'some.py'
    source.write_text(
        'FAR = 0.05\nSHAPE = np.zeros((5, 7))\nDEGREE = 0.0174\nEACH = a[4:9] + 1e-3**2\n'
        'def f(x, few=12):\n    return f"{x * 7.5} mm" + str(x / 2.0 - 3 * x) + g(x, axis=5, b=0.7)\n'
    )
    assert list(tuned(source)) == [(1, 0.05), (5, 12.0), (6, 0.7)]


def test_checks_of_data_and_set_up_share_few_numbers():
    found = {path.name: list(tuned(path)) for path in (CORE / 'diagnosis/soundness').glob('*.py')}
    assert sum(map(len, found.values())) <= SOUNDNESS, found


FILES = {
    name: file
    for name, file in module_files(ROOT / 'src').items()
    if name.startswith('weld_twin_core.diagnosis.')
}
MAKING = {'soundness', 'unseen', 'advice'}
"""Rooms that make instances of their own: what mistakes look like, and curves without formula."""


def room(module):
    return module.split('.')[2]


def asking():
    return [name for name in FILES if room(name) not in MAKING]


def imported(file):
    """Return all that a file imports by name, and the last names of modules that it imports whole."""
    nodes = [n for n in statements(parsed(file)) if isinstance(n, ast.Import | ast.ImportFrom)]
    return {alias.name.rpartition('.')[2] for node in nodes for alias in node.names}


def test_no_effect_is_imported():
    effects = {kind.__name__ for kind in REGISTRY.values()}
    effects |= {kind.__module__.rpartition('.')[2] for kind in REGISTRY.values()}
    named = {name: imported(FILES[name]) & effects for name in asking()}
    assert {name: found for name, found in named.items() if found} == {}


def test_no_effect_is_spelt_out():
    named = {}
    for name in asking():
        nodes = ast.walk(parsed(FILES[name]))
        words = [node.value for node in nodes if isinstance(node, ast.Constant)]
        named[name] = {word for word in words if isinstance(word, str)} & set(REGISTRY)
    assert {name: found for name, found in named.items() if found} == {}


def test_the_rooms_that_may_are_still_there():
    assert {room(name) for name in FILES} >= MAKING
