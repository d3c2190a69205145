# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How many tuned numbers decide in a room: every literal but 0, 1, 2, units and indices.

    tools/in_env python tools/numbers_tuned.py diagnosis/soundness          the sum, file by file
    tools/in_env python tools/numbers_tuned.py diagnosis/soundness --all    every one with its line

Defaults count as well as constants. A unit is a number in a sentence (an f-string), a factor of
`UNITS`, or a constant whose name is one. An index is what stands in brackets, says an axis or a
shape, or counts the coordinates of a point, a pose or a matrix in the middle of a formula.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CORE = ROOT / 'src' / 'weld_twin_core' / 'weld_twin_core'
PLAIN = {0.0, 1.0, 2.0}
UNITS = {60.0, 100.0, 180.0, 1e3, 1e6, 1e9}
"""Seconds, per cent, degrees, milli, micro and nano."""
NAMED = {'DEGREE', 'MILLIMETRE', 'INCH', 'NORMAL'}
"""Constants that are a unit, or a number of mathematics."""
SHAPED = {'eye', 'zeros', 'ones', 'reshape', 'range', 'slice', 'tile', 'diff', 'round'}
"""Functions that are given shapes, places and orders."""
COORDINATES = {3, 4, 6, 9}
"""Coordinates of a point, a quaternion, a pose and a matrix; only as whole numbers in a formula."""


def tuned(path: Path) -> Iterator[tuple[int, float]]:
    """Yield line and value of every tuned number of a file."""
    yield from _tuned(ast.parse(path.read_text(encoding='utf-8')), bare=False)


def _tuned(node: ast.AST, *, bare: bool) -> Iterator[tuple[int, float]]:
    """Yield what stands below a node; ``bare`` where a whole number is one that was chosen."""
    if isinstance(node, ast.JoinedStr | ast.AnnAssign | ast.Assign) and _is_unit(node):
        return
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        value = abs(float(node.value))
        counts = type(node.value) is int and node.value in COORDINATES and not bare
        if value not in PLAIN | UNITS and not counts:
            yield node.lineno, float(node.value)
        return
    if isinstance(node, ast.Subscript):
        yield from _tuned(node.value, bare=bare)
        return
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
        yield from _tuned(node.right, bare=bare)  # powers of ten are units
        yield from _tuned(node.left, bare=bare) if not isinstance(node.left, ast.Constant) else ()
        return
    if isinstance(node, ast.Call) and _name(node.func) in SHAPED:
        yield from _tuned(node.func, bare=False)
        return
    if isinstance(node, ast.keyword) and (node.arg or '').startswith('ax'):
        return
    for child in ast.iter_child_nodes(node):
        chosen = isinstance(node, ast.Assign | ast.AnnAssign | ast.arguments)
        inside = isinstance(node, ast.Tuple | ast.UnaryOp) and bare
        yield from _tuned(child, bare=chosen or inside)


def _is_unit(node: ast.JoinedStr | ast.AnnAssign | ast.Assign) -> bool:
    """Return whether it is a sentence, or gives a unit its value."""
    if isinstance(node, ast.JoinedStr):
        return True
    targets = node.targets if isinstance(node, ast.Assign) else [node.target]
    names = [
        name.id for target in targets for name in ast.walk(target) if isinstance(name, ast.Name)
    ]
    return bool(names) and all(name.strip('_') in NAMED for name in names)


def _name(node: ast.AST) -> str:
    return getattr(node, 'id', getattr(node, 'attr', ''))


def main() -> int:
    """Print the table."""
    rooms = [name for name in sys.argv[1:] if not name.startswith('-')]
    for room in rooms or ['diagnosis']:
        total = 0
        for path in sorted((CORE / room).rglob('*.py')):
            found = list(tuned(path))
            total += len(found)
            print(f'{len(found):6}  {path.relative_to(CORE)}')
            for line, value in found if '--all' in sys.argv else ():
                print(f'{"":8}{line:5}  {value:g}')
        print(f'{total:6}  {room}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
