# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A URDF of a whole cell, read from the table of its positioner to the torch, and written again."""

import numpy as np
import pytest
from by_pinocchio import by_pinocchio

import weld_twin_core as wt
from weld_twin_core import ModelError, corrected
from weld_twin_msgs_py.robots import load_robot, read_urdf, write_robot_yaml, write_urdf
from weld_twin_msgs_py.robots.urdf_write import GivenUrdf, write_urdf_like

BRANCHES = (
    # name, kind, parent, child, xyz, rpy, axis
    ('rail', 'prismatic', 'world', 'carriage', '0 0 0.4', '0.02 0.01 0.3', '0 1 0'),
    ('mount', 'fixed', 'carriage', 'base_link', '0.1 0.05 0.1', '0 0 1.2', ''),
    ('a1', 'revolute', 'base_link', 'l1', '0 0 0.3', '0 0 0', '0 0 -1'),
    ('a2', 'revolute', 'l1', 'l2', '0.18 0 0.2', '0 0 0', '0 1 0'),
    ('a3', 'revolute', 'l2', 'l3', '0 0 0.6', '0 0 0', '0 1 0'),
    ('a4', 'revolute', 'l3', 'tool0', '0.3 0 0.12', '0 0.1 0', '1 0 0'),
    ('hand', 'fixed', 'tool0', 'torch', '0.3 0 -0.05', '0 0.5 0', ''),
    ('stand', 'fixed', 'world', 'cradle_foot', '1.6 0.2 0.7', '0.01 0 -0.4', ''),
    ('tilt', 'revolute', 'cradle_foot', 'cradle', '0.1 0 0.2', '0 0 0', '1 0 0'),
    ('turn', 'continuous', 'cradle', 'plate', '0.1 0 -0.15', '0.2 0 0', '0 0 -1'),
    ('nest', 'fixed', 'plate', 'table', '0.1 0.05 0.08', '0 0 0.7', ''),
)
SHAPE = '<visual><geometry><mesh filename="a.stl"/></geometry></visual>'
MASSES = {'carriage': 300.0, 'l1': 60.0, 'l2': 40.0, 'torch': 5.0, 'cradle': 120.0, 'plate': 50.0}


def cell_urdf(path, branches=BRANCHES):
    out = ['<robot name="cell">']
    for link in dict.fromkeys(name for row in branches for name in row[2:4]):
        mass = MASSES.get(link)
        inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
        body = f'<origin xyz="0.1 -0.05 0.1"/><mass value="{mass}"/>{inertia}'
        weight = f'<inertial>{body}</inertial>' if mass else ''
        out.append(f'<link name="{link}">{weight}{SHAPE}</link>')
    for name, kind, parent, child, xyz, rpy, axis in branches:
        limit = '<limit lower="-3" upper="2.5" velocity="1" effort="1"/>'
        moving = f'<axis xyz="{axis}"/>{limit}' if axis else ''
        out.append(
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="{xyz}" rpy="{rpy}"/>{moving}</joint>'
        )
    path.write_text('\n'.join([*out, '</robot>']))
    return path


@pytest.fixture
def given(tmp_path):
    return cell_urdf(tmp_path / 'cell.urdf')


def postures(robot):
    return np.random.default_rng(5).uniform(-1.4, 1.4, (8, robot.n))


@pytest.mark.parametrize(
    ('base', 'tip', 'names'),
    [
        ('table', 'torch', ('turn', 'tilt', 'rail', 'a1', 'a2', 'a3', 'a4')),
        ('torch', 'table', ('a4', 'a3', 'a2', 'a1', 'rail', 'tilt', 'turn')),
        ('cradle', 'l2', ('tilt', 'rail', 'a1', 'a2')),
    ],
)
def test_a_chain_up_one_branch_and_down_another_is_that_of_the_tree(given, base, tip, names):
    robot = read_urdf(given, base, tip)
    assert robot.joint_names == names
    assert robot.max_velocity.tolist() == [1.0] * robot.n
    q = postures(robot)
    poses, torques = by_pinocchio(given, names, q, base, tip)
    np.testing.assert_allclose(wt.forward(robot, q), poses, atol=1e-13)
    if (base, tip) == ('table', 'torch'):
        np.testing.assert_allclose(wt.gravity_torque(robot, q), torques, atol=1e-9)


def test_a_corrected_cell_keeps_its_names_and_the_sign_of_every_joint(given, tmp_path):
    robot = read_urdf(given, 'table', 'torch')
    zeros = dict(zip(robot.joint_names, 1e-3 * np.arange(1.0, 8.0), strict=True))
    errors = [wt.effects.JointOffset(name, offset=value) for name, value in zeros.items()]
    errors += [wt.effects.LinkTwist(name, dalpha=2e-3) for name in robot.joint_names]
    errors += [wt.effects.RootPose(xyz=(2e-3, -1e-3, 3e-3), rotvec=(1e-3, 2e-3, -1e-3))]
    errors += [wt.effects.ToolPose(xyz=(0.0, 1e-3, 0.0), rotvec=(0.0, 0.0, 1e-2))]
    better, left = corrected(robot, errors)
    assert left == ()
    written = tmp_path / 'robot.urdf'
    write_urdf_like(written, GivenUrdf(given, 'table', 'torch'), better)
    assert written.read_text().count('a.stl') == given.read_text().count('a.stl')
    q = postures(robot)
    np.testing.assert_allclose(
        by_pinocchio(written, robot.joint_names, q, 'table', 'torch')[0],
        wt.forward(better, q),
        atol=1e-12,
    )
    # With zeros alone, the given file at reading + offset is the corrected one at the reading.
    only_zeros, _ = corrected(robot, errors[: robot.n])
    write_urdf_like(written, GivenUrdf(given, 'table', 'torch'), only_zeros, overwrite=True)
    names, moved = robot.joint_names, q + np.array(list(zeros.values()))
    np.testing.assert_allclose(
        by_pinocchio(written, names, q, 'table', 'torch')[0],
        by_pinocchio(given, names, moved, 'table', 'torch')[0],
        atol=1e-12,
    )


def test_a_cell_survives_its_files(given, tmp_path):
    robot = read_urdf(given, 'table', 'torch')
    q = postures(robot)
    write_robot_yaml(tmp_path / 'robot.yaml', robot)
    write_urdf(tmp_path / 'own.urdf', robot)
    for again in (
        load_robot(tmp_path / 'robot.yaml'),
        load_robot(tmp_path / 'own.urdf', 'world', 'tool'),
    ):
        assert again.joint_names == robot.joint_names
        np.testing.assert_allclose(wt.forward(again, q), wt.forward(robot, q), atol=1e-12)
        torques = wt.gravity_torque(again, q), wt.gravity_torque(robot, q)
        np.testing.assert_allclose(*torques, atol=1e-9)


@pytest.mark.parametrize(
    ('base', 'tip', 'sentence'),
    [
        ('table', 'world', "no joint moves between 'world' and the foot of 'table'; swap the two"),
        ('table', 'elsewhere', "no chain of joints leads from 'table' to 'elsewhere'"),
    ],
)
def test_chains_that_are_none_are_refused(tmp_path, base, tip, sentence):
    alone = ('far', 'revolute', 'island', 'elsewhere', '0 0 0', '0 0 0', '0 0 1')
    path = cell_urdf(tmp_path / 'cell.urdf', (*BRANCHES, alone))
    with pytest.raises(ModelError) as error:
        read_urdf(path, base, tip)
    assert str(error.value) == f"URDF '{path}': {sentence}"
