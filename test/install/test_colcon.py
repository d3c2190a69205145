# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The tree as a colcon workspace: built, then each executable started as `ros2 run` does."""

import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')
pytest.importorskip('colcon_core', reason='needs colcon')

from weld_twin_nodes.harness import Cell
from weld_twin_nodes.harness.process import MODULES

ROOT = Path(__file__).parents[2]
PACKAGES = [f'weld_twin_{name}' for name in ('core', 'lab', 'msgs_py', 'nodes', 'report')]
NODES = list(MODULES)

pytestmark = [pytest.mark.slow, pytest.mark.cells]


def colcon(folder: Path, *words: str, log: str = 'log') -> str:
    """Run colcon in a workspace; return what it printed."""
    path = f'{Path(sys.executable).parent}:{os.environ["PATH"]}'
    done = subprocess.run(
        [sys.executable, '-m', 'colcon', '--log-base', log, *words],
        cwd=folder,
        capture_output=True,
        text=True,
        env=os.environ | {'PYTHONPATH': '', 'PATH': path},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope='module')
def workspace(tmp_path_factory) -> Path:
    """Build copies of the five packages away from the tree; return the folder with ``install``."""
    folder = tmp_path_factory.mktemp('ws')
    leave = shutil.ignore_patterns('__pycache__')
    for name in PACKAGES:
        shutil.copytree(ROOT / 'src' / name, folder / 'src' / name, ignore=leave)
    colcon(folder, 'build')
    return folder


@pytest.fixture(scope='module')
def sourced(workspace) -> dict[str, str]:
    """Return the environment after ``source install/setup.bash``."""
    script = f'source {shlex.quote(str(workspace / "install/setup.bash"))} && env -0'
    clean = {k: v for k, v in os.environ.items() if k != 'PYTHONPATH'}
    out = subprocess.run(
        ['bash', '-c', script], check=True, capture_output=True, text=True, env=clean
    ).stdout
    return dict(item.split('=', 1) for item in out.split('\0') if '=' in item)


def test_colcon_finds_exactly_the_five_packages(tmp_path):
    found = colcon(ROOT, 'list', '--names-only', log=str(tmp_path / 'log')).split()
    assert sorted(found) == PACKAGES


def test_each_package_is_in_the_index_with_its_files(workspace):
    for name in PACKAGES:
        share = workspace / 'install' / name / 'share'
        assert (share / 'ament_index/resource_index/packages' / name).is_file()
        assert (share / name / 'package.xml').is_file()
    share = workspace / 'install/weld_twin_nodes/share/weld_twin_nodes'
    assert (share / 'launch/demo.launch.py').is_file()
    assert (share / 'config/demo.yaml').is_file()


def test_each_node_runs_as_installed_with_the_parameter_file(workspace, sourced, tmp_path):
    installed = workspace / 'install/weld_twin_nodes'
    config = installed / 'share/weld_twin_nodes/config/demo.yaml'
    with Cell(tmp_path / 'cell') as cell:
        own = {k: v for k, v in os.environ.items() if k.startswith('ROS_')}
        deviations, started = cell.collect('/deviation'), {}
        for name in NODES:
            words = ['--ros-args', '--params-file', str(config)]
            words += ['-p', f'out:={tmp_path / "bag"}'] if name == 'recorder' else []
            program = str(installed / 'lib/weld_twin_nodes' / name)
            assigned = [f'{k}={v}' for k, v in {**sourced, **own}.items()]
            started[name] = cell.start(['env', '-i', *assigned, program, *words])
        cell.wait(
            lambda: set(NODES) <= set(cell.node.get_node_names()), 'the installed nodes', 120.0
        )
        cell.wait(lambda: len(deviations) > 0, 'a deviation', 120.0)
        for process in started.values():
            process.interrupt()
        codes = {name: process.end() for name, process in started.items()}
        assert codes == dict.fromkeys(NODES, 0)
        assert not [name for name, process in started.items() if 'Traceback' in process.log]
    assert (tmp_path / 'bag/metadata.yaml').is_file()


def test_the_command_line_runs_as_installed(workspace, sourced):
    program = workspace / 'install/weld_twin_nodes/lib/weld_twin_nodes/weld-twin'
    out = subprocess.run([program, 'bag', '--robots'], env=sourced, capture_output=True, text=True)
    assert out.returncode == 0, out.stderr
    assert 'franka_panda' in out.stdout
