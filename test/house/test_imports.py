# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Imports point one way: between packages, between the rooms of a package, between files."""

from pathlib import Path

import pytest
from import_graph import (
    ROOT,
    against_order,
    circles,
    grouped,
    import_graph,
    imported_names,
    layer_table,
    module_files,
)

LAYERS = layer_table((ROOT / 'docs/architecture.md').read_text(encoding='utf-8'))
PACKAGES = [f'weld_twin_{name}' for name in ('core', 'msgs_py', 'nodes', 'report', 'lab')]
FILES = module_files(ROOT / 'src')


def tree(folder: Path, sources: dict[str, str]) -> dict[str, Path]:
    """Write sources by their paths in a folder of packages; return the files of the modules."""
    for path, source in sources.items():
        file = folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(source)
    return module_files(folder)


@pytest.fixture(scope='module')
def graph():
    return import_graph(FILES)


def test_the_graph_finds_imports_wherever_they_stand(tmp_path):
    files = tree(
        tmp_path,
        {
            'p/p/__init__.py': '',
            'p/p/top.py': 'from . import low\nimport p.room.deep as deep\n',
            'p/p/low.py': 'def f():\n    from .room.deep import thing\n',
            'p/p/types.py': (
                'from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from .top import T\n'
            ),
            'p/p/room/__init__.py': 'from .deep import thing\n',
            'p/p/room/deep.py': 'from .. import low\nimport numpy\n',
        },
    )
    graph = import_graph(files)
    assert graph['p.top'] == {'p', 'p.low', 'p.room.deep'}
    assert graph['p.low'] == {'p.room.deep'}
    assert graph['p.types'] == {'p.top'}
    assert graph['p.room'] == {'p.room.deep'}
    assert circles(graph) == [{'p.low', 'p.room.deep'}]
    assert circles(grouped(graph, 2)) == [{'p.low', 'p.room'}]
    assert against_order(grouped(graph, 2), ['p.room', 'p.low', 'p.top']) == ['p.room -> p.low']


def test_packages_point_one_way(graph):
    assert [house for house in LAYERS if '.' not in house] == PACKAGES
    packages = grouped(graph, 1)
    assert sorted(packages) == sorted(PACKAGES)
    assert against_order(packages, PACKAGES) == []


def test_the_plant_knows_no_other_room(graph):
    outward = {
        f'{module} -> {other}'
        for module, others in graph.items()
        for other in others
        if module.startswith('weld_twin_lab.plant') and not other.startswith('weld_twin_lab.plant')
    }
    assert outward == set()


@pytest.mark.parametrize('house', LAYERS)
def test_every_room_has_its_layer_in_the_architecture_page(house):
    depth = len(house.split('.'))
    rooms = {name.split('.')[depth] for name in FILES if name.startswith(f'{house}.')}
    assert rooms - {'__main__'} == set(LAYERS[house]), (
        'docs/architecture.md tells the rooms of each package, the lowest first'
    )


@pytest.mark.parametrize('house', LAYERS)
def test_rooms_point_to_rooms_below_them(house, graph):
    order = [f'{house}.{room}' for room in LAYERS[house]]
    assert against_order(grouped(graph, len(house.split('.')) + 1), order) == []


@pytest.mark.parametrize('package', PACKAGES)
def test_tests_of_a_package_import_it_and_those_below_alone_and_have_names_of_their_own(package):
    allowed = set(PACKAGES[: PACKAGES.index(package) + 1])
    for file in sorted((ROOT / 'src' / package / 'test').rglob('*.py')):
        named = {name.split('.')[0] for name in imported_names(file.stem, file)}
        assert named & set(PACKAGES) <= allowed, file
    # As colcon runs them, each is imported by its bare name.
    names = [file.name for file in (ROOT / 'src' / package / 'test').rglob('*.py')]
    twice = {name for name in names if names.count(name) > 1}
    assert twice - {'conftest.py'} == set()


def test_no_files_import_each_other_in_a_circle(graph):
    assert circles(graph) == []


def test_the_architecture_page_names_every_folder():
    text = (ROOT / 'docs/architecture.md').read_text(encoding='utf-8')
    folders = [name.split('.') for name, file in FILES.items() if file.name == '__init__.py']
    rooms = {parts[-1] for parts in folders if len(parts) == 2}
    rooms |= {parts[-1] for parts in folders if len(parts) == 3 and parts[0] == 'weld_twin_core'}
    assert [name for name in sorted(rooms) if f'`{name}/`' not in text] == []
