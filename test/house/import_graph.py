# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Who imports whom, read from the source: at the top, inside functions, and for types alone."""

import ast
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
Graph = Mapping[str, set[str]]


def module_files(root: Path) -> dict[str, Path]:
    """Return the file of each module of the packages that lie in the folders of a folder."""
    files = {}
    for package in sorted(root.iterdir()):
        for file in sorted((package / package.name).rglob('*.py')):
            name = '.'.join(file.relative_to(package).with_suffix('').parts)
            files[name.removesuffix('.__init__')] = file
    return files


@cache
def parsed(file: Path) -> ast.Module:
    """Return the tree of a file; all tests of this folder share it."""
    return ast.parse(file.read_text(encoding='utf-8'))


def statements(tree: ast.Module) -> Iterator[ast.AST]:
    """Yield every statement of a source, wherever it stands; no expression holds one."""
    ahead: list[ast.AST] = [tree]
    while ahead:
        node = ahead.pop()
        yield node
        parts = ast.iter_child_nodes(node)
        ahead += [part for part in parts if isinstance(part, HOLDERS)]


HOLDERS = (ast.stmt, ast.excepthandler, ast.match_case)
"""Statements, and the parts of some that hold further ones."""


@cache
def imported_names(module: str, file: Path, *, at_once: bool = False) -> frozenset[str]:
    """Return the full name of all that a file imports, anywhere in it or as it is imported."""
    package = module if file.name == '__init__.py' else module.rpartition('.')[0]
    found: set[str] = set()
    for node in parsed(file).body if at_once else statements(parsed(file)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = package.split('.')[: len(package.split('.')) - node.level + 1]
            base = '.'.join([*(above if node.level else []), *filter(None, [node.module])])
            # `from package import module` runs the package as well
            found |= {base} | {f'{base}.{alias.name}' for alias in node.names}
    return frozenset(found)


def import_graph(files: Mapping[str, Path]) -> dict[str, set[str]]:
    """Return, of each module, those of the others that it imports."""
    return {
        module: {name for name in imported_names(module, file) if name in files} - {module}
        for module, file in files.items()
    }


def grouped(graph: Graph, depth: int) -> dict[str, set[str]]:
    """Return the graph of the packages (depth 1), of their rooms (2), or of rooms in rooms (3)."""

    def group(name: str) -> str:
        return '.'.join(name.split('.')[:depth])

    out: dict[str, set[str]] = {}
    for module, others in graph.items():
        out.setdefault(group(module), set()).update(group(other) for other in others)
    return {name: others - {name} for name, others in out.items()}


def circles(graph: Graph) -> list[set[str]]:
    """Return the groups of modules each of which imports all others of its group in the end."""
    reach = {module: _reached(graph, module) for module in graph}
    groups = {
        frozenset(other for other in reach[module] if module in reach[other]) for module in graph
    }
    return sorted((set(group) for group in groups if group), key=sorted)


def _reached(graph: Graph, start: str) -> set[str]:
    seen: set[str] = set()
    ahead = list(graph[start])
    while ahead:
        module = ahead.pop()
        if module not in seen:
            seen.add(module)
            ahead += graph[module]
    return seen


def layer_table(text: str) -> dict[str, list[str]]:
    """Return the rooms of each package, lowest first, as docs/architecture.md tells them."""
    rows = [line.split('|')[1:-1] for line in text.splitlines() if line.startswith('| `weld_twin')]
    return {_quoted(package)[0]: _quoted(rooms) for package, rooms in rows}


def _quoted(cell: str) -> list[str]:
    return cell.split('`')[1::2]


def against_order(graph: Graph, order: Iterable[str]) -> list[str]:
    """Return the arrows that point from a name to one that stands after it in an order."""
    place = {name: k for k, name in enumerate(order)}
    return sorted(
        f'{name} -> {other}'
        for name, others in graph.items()
        for other in others
        if name in place and other in place and place[other] > place[name]
    )
