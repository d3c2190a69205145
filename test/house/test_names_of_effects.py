# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis knows no effect by name: what it needs to know, it asks through the hooks."""

import ast

from import_graph import ROOT, module_files, parsed

from weld_twin_core.effects import REGISTRY

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
    nodes = [n for n in ast.walk(parsed(file)) if isinstance(n, ast.Import | ast.ImportFrom)]
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
