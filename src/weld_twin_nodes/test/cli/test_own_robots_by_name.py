# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A robot file that is dropped in a folder is asked for by its name, as bundled robots are."""

import pytest

from weld_twin_core.arm import catalog
from weld_twin_msgs_py.bags import read_recording
from weld_twin_msgs_py.robots import load_robot, write_robot_yaml


@pytest.fixture
def cell7(tmp_path, monkeypatch):
    """Return the file of a robot of one's own: an arm on a plinth."""
    monkeypatch.setenv('WELD_TWIN_ROBOTS', str(tmp_path / 'robots'))
    raised = catalog.load('kuka_kr16_2')
    base = raised.T_world_base.copy()
    base[2, 3] = 0.75
    (tmp_path / 'robots').mkdir()
    file = tmp_path / 'robots/cell7.yaml'
    write_robot_yaml(file, raised.with_frames(base=base))
    return file


def test_commands_take_it_and_info_lists_it(weld_twin, cell7, tmp_path):
    heights = {}
    for robot in ('cell7', 'kuka_kr16_2'):
        words = ('--robot', robot, '--path', 'line', '--rate', 20, '--out', tmp_path / robot)
        said = weld_twin('simulate', *words)
        assert said.code == 0, said.err
        bag = read_recording(tmp_path / robot, load_robot(robot))
        heights[robot] = bag.measured.position[:, 2].mean()
    assert heights['cell7'] - heights['kuka_kr16_2'] == pytest.approx(0.75, abs=1e-9)
    listed = weld_twin('bag', '--robots').out
    assert listed.splitlines()[-1].split() == ['cell7', 'your', 'own', str(cell7)]
