# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The security policy allows each node what it does, and nothing else."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import pytest
from defusedxml.ElementTree import parse

pytest.importorskip('rclpy', reason='needs ROS 2')

from weld_twin_msgs_py.messages.topics import BY_NAME, ROBOT_DESCRIPTION
from weld_twin_nodes.harness import Cell
from weld_twin_nodes.harness.process import MODULES
from weld_twin_nodes.live.cell_node import CellNode

pytestmark = pytest.mark.cells

POLICY = Path(__file__).parents[4] / 'src/weld_twin_nodes/security/weld_twin.policy.xml'
PERMISSIONS = {
    ('topics', 'publish'): 'get_publisher_names_and_types_by_node',
    ('topics', 'subscribe'): 'get_subscriber_names_and_types_by_node',
    ('services', 'reply'): 'get_service_names_and_types_by_node',
    ('services', 'request'): 'get_client_names_and_types_by_node',
}
WAYS = {
    'trajectory_generator': [
        {'follow': '/deviation'},
        {'source': 'path'},
        {'source': 'joint_trajectory'},
    ],
    'recorder': [{'topics': list(BY_NAME)}],
}
"""Parameters that between them bring out everything a node can do."""


def profiles():
    return {item.get('node'): item for item in parse(POLICY).getroot().iter('profile')}


def allowed(profile, kind, permission):
    """Return absolute names, as the graph tells them."""
    own = f'/{profile.get("node")}'
    names = [
        item.text
        for block in profile.findall(kind)
        if block.get(permission) == 'ALLOW'
        for item in block
    ]
    assert len(names) == len(set(names))
    return {own + name[1:] if name.startswith('~') else f'/{name}' for name in names}


def node_class(name):
    module = import_module(MODULES[name])
    return next(
        item
        for item in vars(module).values()
        if isinstance(item, type)
        and issubclass(item, CellNode)
        and item.__module__ == module.__name__
    )


@pytest.mark.parametrize('name', MODULES)
def test_the_policy_is_exactly_what_a_node_does(name, tmp_path):
    kind = node_class(name)
    seen = {key: set() for key in PERMISSIONS}
    with Cell(tmp_path / 'cell') as cell:
        for k, parameters in enumerate(WAYS.get(name, [{}])):
            if name == 'recorder':
                parameters = {**parameters, 'out': str(tmp_path / f'bag{k}')}
            node = cell.add(kind, use_sim_time=True, **parameters)
            assert node.get_name() == name
            for key, query in PERMISSIONS.items():
                seen[key] |= {topic for topic, _ in getattr(node, query)(name, '/')}
            cell.remove(node)
    if any(setting.name == 'robot' for setting in kind.settings):
        seen['topics', 'subscribe'].add(ROBOT_DESCRIPTION.name)  # waits for one before all else
    for (what, permission), names in seen.items():
        assert allowed(profiles()[name], what, permission) == names, (what, permission)


def test_the_policy_speaks_of_the_nodes_there_are_and_denies_nothing_by_name():
    root = parse(POLICY).getroot()
    assert root.tag == 'policy'
    assert root.get('version') == '0.2.0'
    assert set(profiles()) == set(MODULES)
    paths = [item.get('path') for item in root.iter('enclave')]
    assert paths == [f'/weld_twin/{name}' for name in profiles()]
    for profile in profiles().values():
        assert profile.get('ns') == '/'
        values = {value for block in profile for value in block.attrib.values()}
        assert values == {'ALLOW'}
        for block in profile:
            assert not any('*' in item.text for item in block)
