# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Starting nodes: what they take, what they refuse, and the launch files that start them."""

import ast
import os
import subprocess
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest
import yaml

pytest.importorskip('rclpy', reason='needs ROS 2')

from weld_twin_nodes.live.policy import enclave
from weld_twin_nodes.live.settings import MODULES, node_class

PACKAGE = Path(__file__).parents[2]
LAUNCH = ('cell', 'demo')
TWIN, INJECTOR = 'forward_kinematics_twin', 'error_injector'


AS_FOUND = dict(os.environ)
"""The environment before any test of this process has added messages of others to it."""


def started(name, *words):
    return subprocess.run(
        [sys.executable, '-m', MODULES[name], *words],
        capture_output=True,
        text=True,
        timeout=60,
        env=AS_FOUND,
    )


def test_nodes_load_nothing_that_they_need_for_a_diagnosis_alone():
    slow = "[m for m in ('scipy.linalg', 'matplotlib', 'weld_twin_core.diagnosis.soundness.gate')"
    nodes = f'{MODULES[INJECTOR]}, {MODULES["live_diagnosis"]}'
    code = f'import sys, {nodes}\nprint({slow} if m in sys.modules])'
    said = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    assert said.stdout == '[]\n'


@pytest.mark.parametrize(
    ('name', 'word', 'sentence'),
    [
        (TWIN, 'rbot:=ur5', "weld_twin: no parameter is called 'rbot'; did you mean 'robot'?\n"),
        (TWIN, 'base_from_tf:=true', 'needs the names measuring_frame and base_frame\n'),
        (INJECTOR, 'effects:=[{effect: time_delay, delay: 5e-4}]', 'in two kinds of quotes'),
        (INJECTOR, 'robot:=ur99', "'ur99' is neither"),
        (INJECTOR, 'seed:=1.5', 'seed'),
        ('trajectory_generator', 'path:=nowhere.yaml', "'nowhere.yaml'"),
        ('trajectory_generator', 'rate:=-5.0', 'rate'),
        ('recorder', 'storage:=mcap', "needs the parameter 'out'"),
        ('contact_marker', 'executor:=threads', 'must be one of events, single_threaded, got'),
    ],
)
def test_a_parameter_that_cannot_be_is_refused_in_a_sentence(name, word, sentence, capsys):
    assert import_module(MODULES[name]).main(['--ros-args', '-p', word]) == 2
    said = capsys.readouterr().err
    assert said.startswith('weld_twin: ') and sentence in said
    assert said.count('\n') == 1


def test_a_node_that_must_be_secured_and_cannot_does_not_run_open(tmp_path):
    """Neither without keys nor, where the middleware has no security, with an enclave of them."""
    locked = {'ROS_SECURITY_ENABLE': 'true', 'ROS_SECURITY_STRATEGY': 'Enforce'}
    (tmp_path / 'keys/enclaves/empty').mkdir(parents=True)
    for place in ('/nowhere', '/empty'):
        words = ['--ros-args', '--enclave', place]
        result = subprocess.run(
            [sys.executable, '-m', MODULES[TWIN], *words],
            capture_output=True,
            text=True,
            timeout=60,
            env={**os.environ, **locked, 'ROS_SECURITY_KEYSTORE': str(tmp_path / 'keys')},
        )
        assert result.returncode == 2
        assert 'the node does not run unprotected under ROS_SECURITY_ENABLE' in result.stderr
        assert 'Traceback' not in result.stderr


@pytest.mark.skipif(find_spec('tf2_msgs') is not None, reason='tf2_msgs is installed here')
def test_a_base_that_is_to_come_from_tf_needs_its_messages():
    frames = ('measuring_frame:=world', 'base_frame:=base_link', 'base_from_tf:=true')
    words = [word for frame in frames for word in ('-p', frame)]
    result = started(TWIN, '--ros-args', *words)
    assert result.returncode == 2
    assert 'base_from_tf cannot be done: /tf is not listened to: ' in result.stderr
    assert 'install the package tf2_msgs' in result.stderr


def test_a_parameter_of_another_node_may_be_in_a_file_for_all(cell, tmp_path):
    process = cell.start('recorder', out=str(tmp_path / 'bag'), robot='ur5', seed=3)
    cell.trigger('/recorder/counts')
    assert process.code is None


@pytest.mark.parametrize('name', MODULES)
def test_help_names_every_parameter_with_its_unit(name, capsys):
    assert import_module(MODULES[name]).main(['--help']) == 0
    told = capsys.readouterr().out
    assert told.startswith(f'usage: {name} ')
    for item in node_class(name).every_setting():
        assert f'\n  {item.name} (' in told
        assert item.description in told


def test_a_node_that_is_asked_for_help_ends_without_a_word_of_ros():
    result = started('recorder', '--help')
    assert (result.returncode, result.stderr) == (0, '')
    assert result.stdout.startswith('usage: recorder ')


def tree_of(name):
    return ast.parse((PACKAGE / 'launch' / f'{name}.launch.py').read_text())


def constant(tree, name):
    """Return the value of a name that a launch file assigns at its top."""
    for item in tree.body:
        if isinstance(item, ast.Assign) and item.targets[0].id == name:
            return item.value
    raise AssertionError(name)


def test_the_launch_files_start_nodes_there_are():
    assert set(ast.literal_eval(constant(tree_of('demo'), 'LISTENERS'))) <= set(MODULES)
    nodes = constant(tree_of('cell'), 'NODES')
    assert {key.value for key in nodes.keys} <= set(MODULES)


def test_the_cell_hands_each_node_only_parameters_it_has():
    tree = tree_of('cell')
    shared = ast.literal_eval(constant(tree, 'MODEL'))
    arguments = ast.literal_eval(constant(tree, 'ARGUMENTS'))
    nodes = constant(tree, 'NODES')
    for name, taken in zip(nodes.keys, nodes.values, strict=True):
        own = [e.value for e in taken.elts if isinstance(e, ast.Constant)]
        if any(isinstance(e, ast.Starred) for e in taken.elts):
            own += shared
        known = {item.name for item in node_class(name.value).every_setting()}
        assert set(own) <= known, name.value
        assert set(own) <= set(arguments)
    assert set(ast.literal_eval(constant(tree, 'TOPICS')).values()) <= set(arguments)


def test_each_node_gets_the_enclave_that_the_policy_names():
    around = ast.literal_eval(constant(tree_of('cell'), 'ENCLAVES'))
    for space in ('', 'left', '/cell/left'):
        assert eval(space.join(around)) == enclave('', space).rstrip('/')
    for name in LAUNCH:
        given = [
            keyword.value.elts[0].value
            for node in ast.walk(tree_of(name))
            if isinstance(node, ast.Call)
            for keyword in node.keywords
            if keyword.arg == 'ros_arguments'
        ]
        assert given == ['--enclave']


@pytest.mark.parametrize('name', LAUNCH)
def test_a_launch_file_sets_nothing_for_whoever_includes_it(name):
    called = {
        node.func.id
        for node in ast.walk(tree_of(name))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    }
    assert 'SetEnvironmentVariable' not in called
    assert 'additional_env' in (PACKAGE / 'launch' / f'{name}.launch.py').read_text()


@pytest.mark.parametrize('name', LAUNCH)
def test_the_parameter_files_name_parameters_there_are(name):
    sections = yaml.safe_load((PACKAGE / 'config' / f'{name}.yaml').read_text())
    every = {item.name for node in MODULES for item in node_class(node).every_setting()}
    for section, content in sections.items():
        node = section.rpartition('/')[2]
        known = every if node == '**' else {i.name for i in node_class(node).every_setting()}
        assert set(content['ros__parameters']) <= known, section


@pytest.mark.parametrize('name', LAUNCH)
def test_launch_describes_it_and_keeps_the_environment(name):
    pytest.importorskip('launch_ros.actions', reason='launch_ros is not on this machine')
    import launch
    from launch.launch_description_sources import PythonLaunchDescriptionSource

    before = dict(os.environ)
    source = PythonLaunchDescriptionSource(str(PACKAGE / 'launch' / f'{name}.launch.py'))
    description = source.get_launch_description(launch.LaunchContext())
    assert len(description.entities) > len(MODULES) - 2
    assert dict(os.environ) == before
