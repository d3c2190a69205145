# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Robots as files: the bundled ones, and those that a user drops in a folder."""

import re
from importlib.resources import files

import numpy as np
import pytest

from weld_twin_core import ModelError, catalog, forward
from weld_twin_msgs_py.robots import load_robot, own_files, read_robot_yaml, robot_names

SCARA = """# two links in a plane, and a quill
name: picker
joints:
- {name: one, a: 0.35, lower: -2.5, upper: 2.5}
- {name: two, a: 0.25, lower: -2.5, upper: 2.5}
- {name: quill, type: prismatic, lower: 0.0, upper: 0.2}
source: measured with a rule
"""
URDF = """<robot name="gantry"><link name="floor"/><link name="tool0"/>
<joint name="slide" type="prismatic"><origin xyz="0 0 0.5"/><axis xyz="1 0 0"/>
<limit lower="0" upper="2" velocity="1" effort="1"/>
<parent link="floor"/><child link="tool0"/></joint></robot>"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return the folder of one's own robots, which the environment names."""
    monkeypatch.setenv('WELD_TWIN_ROBOTS', str(tmp_path))
    return tmp_path


@pytest.mark.parametrize('name', catalog.names())
def test_the_reader_of_users_robots_reads_the_bundled_files_alike(name):
    path = files('weld_twin_core.arm.catalog') / f'{name}.yaml'
    assert read_robot_yaml(str(path)).to_mapping() == catalog.load(name).to_mapping()


def test_a_file_that_is_dropped_is_a_robot_by_its_name(folder):
    (folder / 'Picker_2.yaml').write_text(SCARA)
    (folder / 'gantry.urdf').write_text(URDF)
    (folder / 'notes.txt').write_text('no robot')
    assert robot_names() == (*catalog.names(), 'gantry', 'Picker_2')
    picker = load_robot('picker_2')
    q = np.array([0.4, -1.1, 0.07])
    turned = [0.35 * np.cos(0.4) + 0.25 * np.cos(-0.7), 0.35 * np.sin(0.4) + 0.25 * np.sin(-0.7)]
    np.testing.assert_allclose(forward(picker, q)[:3, 3], [*turned, 0.07], atol=1e-15)
    slid = forward(load_robot('gantry'), [0.8])[:3, 3]
    np.testing.assert_allclose(slid, [0.8, 0.0, 0.5], atol=1e-12)
    assert load_robot('gantry', tip_link='tool0').n == 1


def test_the_settings_of_the_user_are_looked_in_where_nothing_is_said(tmp_path, monkeypatch):
    monkeypatch.delenv('WELD_TWIN_ROBOTS', raising=False)
    monkeypatch.setenv('XDG_CONFIG_HOME', str(tmp_path / 'settings'))
    assert own_files() == ()
    place = tmp_path / 'settings/weld_twin/robots'
    place.mkdir(parents=True)
    (place / 'mine.yml').write_text(SCARA)
    assert load_robot('mine').name == 'picker'


def test_several_folders_are_looked_in(tmp_path, monkeypatch):
    for name in ('a', 'b'):
        (tmp_path / name).mkdir()
        (tmp_path / name / f'cell_{name}.yaml').write_text(SCARA)
    monkeypatch.setenv('WELD_TWIN_ROBOTS', f'{tmp_path / "a"}:{tmp_path / "b"}')
    assert robot_names()[-2:] == ('cell_a', 'cell_b')


@pytest.mark.parametrize(
    ('names', 'asked', 'words'),
    [
        (['ur5.yaml'], 'ur5', "'ur5' is the name of several robots: the bundled one, "),
        (['UR5.urdf'], 'ur5', "'ur5' is the name of several robots: the bundled one, "),
        (['cell.yaml', 'Cell.yml'], 'cell', "'cell' is the name of several robots: "),
    ],
)
def test_a_name_of_two_robots_is_none(folder, names, asked, words):
    for name in names:
        (folder / name).write_text(SCARA)
    with pytest.raises(ModelError, match=f'^{re.escape(words)}.*; rename all files but one$'):
        load_robot(asked)
    assert load_robot('ur10').name == 'ur10'


def test_a_bad_file_is_named_and_so_is_a_folder_that_is_none(folder, monkeypatch):
    (folder / 'cell.yaml').write_text(SCARA.replace('0.35', '350'))
    with pytest.raises(ModelError, match=r"cell\.yaml': joint 'one': a is 350, which looks like"):
        load_robot('cell')
    monkeypatch.setenv('WELD_TWIN_ROBOTS', str(folder / 'gone'))
    with pytest.raises(ModelError, match=r"one of that name in '.*/gone', which is no folder$"):
        load_robot('cell')
