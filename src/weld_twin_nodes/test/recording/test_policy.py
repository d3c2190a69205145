# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The security policy allows each node what it does, and nothing else."""

from pathlib import Path

import pytest
from command_line import done
from defusedxml.ElementTree import parse

pytest.importorskip('rclpy', reason='needs ROS 2')

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.messages.topics import BY_NAME, FRAMES, ROBOT_DESCRIPTION
from weld_twin_nodes.harness import Cell
from weld_twin_nodes.live.policy import policy
from weld_twin_nodes.live.settings import MODULES, node_class

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
    'recorder': [{'topics': list(BY_NAME)}, {'managed': True}],
    'live_diagnosis': [{'cameras': 'eye={}/eye.yaml'}, {'managed': True}],
    'compensator': [{'managed': True}],
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
    return {own + n[1:] if n.startswith('~') else f'/{n.lstrip("/")}' for n in names}


@pytest.mark.parametrize('name', MODULES)
def test_the_policy_is_exactly_what_a_node_does(name, tmp_path):
    kind = node_class(name)
    seen = {key: set() for key in PERMISSIONS}
    with Cell(tmp_path / 'cell') as cell:
        for k, parameters in enumerate(WAYS.get(name, [{}])):
            if name == 'recorder':
                parameters = {**parameters, 'out': str(tmp_path / f'bag{k}')}
            if 'cameras' in parameters:
                (tmp_path / 'eye.yaml').write_text('camera_matrix: [9, 0, 4, 0, 9, 4, 0, 0, 1]\n')
                parameters = {'cameras': parameters['cameras'].format(tmp_path)}
            node = cell.add(kind, use_sim_time=True, **parameters)
            assert node.get_name() == name
            for key, query in PERMISSIONS.items():
                opened = {topic for topic, _ in getattr(node, query)(name, '/')}
                # An action is named as one; test/streams/test_compensator.py has what it opens.
                seen[key] |= {topic for topic in opened if '/_action/' not in topic}
            cell.remove(node)
    if any(setting.name == 'robot' for setting in kind.settings):
        # It waits for these before all else, or where tf2_msgs is installed.
        seen['topics', 'subscribe'] |= {row.name for row in (ROBOT_DESCRIPTION, *FRAMES)}
    if name == 'recorder':
        seen['topics', 'subscribe'] |= {row.name for row in FRAMES}
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


def test_the_file_is_what_the_command_prints():
    assert done('export', 'policy') == POLICY.read_text(encoding='utf-8')


def test_a_namespace_and_remaps_change_the_names_they_mean(tmp_path):
    out = tmp_path / 'left.xml'
    words = ('--namespace', '/left', '--nodes', 'forward_kinematics_twin', '--out', out)
    remaps = ('--remap', 'joint_states:=/cell/states', '--remap', '/tf:=tf')
    done('export', 'policy', *words, *remaps)
    (profile,) = parse(out).getroot().iter('profile')
    assert (profile.get('ns'), profile.get('node')) == ('/left', 'forward_kinematics_twin')
    heard = next(b for b in profile if b.get('subscribe') == 'ALLOW')
    names = {item.text for item in heard}
    assert {'/cell/states', '/left/tf', '/tf_static', 'tool_wrench'} <= names
    assert not {'joint_states', '/tf'} & names


def test_what_no_node_has_is_not_remapped():
    with pytest.raises(DataError, match='/joint_sates is remapped, but none of the nodes has'):
        policy(remaps={'joint_sates': '/x'})
    with pytest.raises(
        DataError, match="no node is called 'twin'; there are trajectory_generator"
    ):
        policy(nodes=['twin'])
