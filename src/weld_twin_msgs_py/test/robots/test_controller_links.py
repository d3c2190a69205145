# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which links of a URDF are the controller's base and flange, and that no corrected file loses them."""

from dataclasses import replace

import numpy as np
import pytest

from weld_twin_core import ModelError, corrected, default_seam, effect_from_mapping, forward
from weld_twin_core.arm.chain import frames
from weld_twin_core.arm.dynamics import payload_torque, wrench_torque
from weld_twin_core.diagnosis.advice import actions
from weld_twin_msgs_py.robots import load_robot, write_robot_yaml, write_urdf
from weld_twin_msgs_py.robots.urdf_write import GivenUrdf, write_urdf_like

MOVES = (
    ('j1', 'root', 'a', '0 0 0.4', '{axis}'),
    ('j2', 'a', 'b', '0.2 0 0', '0 1 0'),
    ('j3', 'b', 'c', '0 0 0.7', '0 -1 0'),
    ('j4', 'c', 'd', '0.3 0 0.1', '-1 0 0'),
    ('j5', 'd', 'e', '0.4 0 0', '0 1 0'),
    ('j6', 'e', '{last}', '0.05 0 0', '-1 0 0'),
)
Q = np.array([0.3, -0.2, 0.5, 0.4, 0.7, -1.1])


def urdf(*fixed, root='base_link', last='link_6', axis='0 0 -1'):
    """Return an arm; ``fixed`` are (parent, child, xyz, rpy) of what is fixed to its ends."""
    links, joints = {root}, ''
    for name, parent, child, xyz, about in MOVES:
        parent, child = parent.replace('root', root), child.format(last=last)
        links |= {parent, child}
        joints += (
            f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="{xyz}"/><axis xyz="{about.format(axis=axis)}"/>'
            '<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
        )
    for k, (parent, child, xyz, rpy) in enumerate(fixed):
        links |= {parent, child}
        joints += (
            f'<joint name="f{k}" type="fixed"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="{xyz}" rpy="{rpy}"/></joint>'
        )
    named = ''.join(f'<link name="{link}"/>' for link in sorted(links))
    return f'<robot name="arm">{named}{joints}</robot>'


TORCH = ('0.1 0 0.3', '0 0.5 0')


def to(child, xyz='0.1 0 0', rpy='0 0 0', parent='link_6'):
    """Return what is fixed to a link, the last one unless told."""
    return parent, child, xyz, rpy


HANDS = {
    'tool0 of ROS-Industrial': ('tool0', to('tool0', rpy='0 1.5707963 0')),
    'tool0 before flange': (
        'tool0',
        to('flange'),
        to('tool0', '0 0 0', '0 1.5707963 0', 'flange'),
    ),
    'a tip called tool0': ('flange', to('flange'), to('tool0', '0.05 0 0.3', '0 0.6 0', 'flange')),
    'flange alone': ('flange', to('flange')),
    'a flange of another name': ('mounting_flange', to('mounting_flange')),
    'one link more than joints': ('link7', to('link7')),
    'a flange with a number': ('fr3_link8', to('fr3_link8')),
    'an end that carries the tool': ('ee_link', to('ee_link', rpy='0 0 1')),
    'the last link': ('link_6',),
    'a tool of two parts': ('link_6', to('cable_box', '0 0 0.1')),
}


@pytest.mark.parametrize('hand', HANDS)
def test_the_flange_is_found_by_its_name(hand, tmp_path):
    flange, *fixed = HANDS[hand]
    carrier = fixed[-1][1] if fixed else 'link_6'
    text = urdf(*fixed, (carrier, 'tcp', *TORCH))
    (tmp_path / 'r.urdf').write_text(text)
    robot = load_robot(tmp_path / 'r.urdf')
    assert (robot.controller.base_link, robot.controller.flange_link) == ('base_link', flange)
    bare = load_robot(tmp_path / 'r.urdf', tip_link=flange)  # the tool of this one is the flange
    np.testing.assert_allclose(
        forward(robot.with_frames(tool=robot.controller.flange), Q), forward(bare, Q), atol=1e-12
    )


def test_the_flange_beside_the_way_to_the_tip_is_found_and_another_can_be_asked_for(tmp_path):
    fixed = ('link_6', 'tool0', '0.1 0 0', '0 0 0'), ('link_6', 'tcp', *TORCH)
    (tmp_path / 'r.urdf').write_text(urdf(*fixed))
    assert load_robot(tmp_path / 'r.urdf', tip_link='tcp').controller.flange_link == 'tool0'
    asked = load_robot(tmp_path / 'r.urdf', tip_link='tcp', flange_link='link_6')
    assert asked.controller.flange_link == 'link_6'
    with pytest.raises(ModelError, match="'c' is not fixed to 'link_6', the last link that moves"):
        load_robot(tmp_path / 'r.urdf', tip_link='tcp', flange_link='c')


BESIDE = ('base_link', 'base', '0 0 0.4', '0 0 3')
ON_A_STAND = ('base', 'base_link', '0 0 1', '0 0 1')
IN_A_WORLD = ('world', 'base_link', '1 0 2', '3.1415927 0 0')
BASES = {
    # what hangs where, the root of the arm, what is asked for: what the base is
    'base beside base_link': ('base', 'base_link', None, BESIDE),
    'base_link asked for': ('base_link', 'base_link', 'base_link', BESIDE),
    'a turned base link in a world': ('base_link', 'base_link', None, IN_A_WORLD),
    'a world asked for': ('world', 'base_link', 'world', IN_A_WORLD),
    'a stand called base': ('base_link', 'base_link', None, ON_A_STAND),
    'no usual name': ('link_0', 'link_0', None, ('world', 'link_0', '0 0 1', '0 1 0')),
}


@pytest.mark.parametrize('case', BASES)
def test_the_base_is_the_link_asked_for_or_found_by_its_name(case, tmp_path):
    base, root, asked, fixed = BASES[case]
    (tmp_path / 'r.urdf').write_text(urdf(fixed, root=root))
    robot = load_robot(tmp_path / 'r.urdf', asked, 'link_6')
    assert robot.controller.base_link == base
    own = load_robot(tmp_path / 'r.urdf', base, 'link_6')  # poses of this one are in that link
    T_world_base = robot.T_world_base @ robot.controller.base
    seen = np.linalg.inv(T_world_base) @ forward(robot, Q)
    np.testing.assert_allclose(seen, forward(own, Q), atol=1e-12)


def test_the_base_of_a_ur_is_told_by_base_link_and_its_programs_count_from_base(tmp_path):
    (tmp_path / 'r.urdf').write_text(urdf(('base_link', 'base', '0 0 0', '0 0 3.1415927')))
    robot = load_robot(tmp_path / 'r.urdf', tip_link='link_6')
    np.testing.assert_allclose(robot.T_world_origin, np.eye(4), atol=1e-12)
    turned = robot.T_world_base @ robot.controller.base
    np.testing.assert_allclose(turned, np.diag([-1.0, -1.0, 1.0, 1.0]), atol=1e-7)
    moved = np.eye(4)
    moved[:3, 3] = 1.0, 2.0, 3.0
    np.testing.assert_allclose(robot.with_origin(moved).T_world_origin, moved, atol=1e-12)


def hand_in_base(robot):
    """Return the controller's flange in its base."""
    bare = robot.with_frames(tool=robot.controller.flange)
    return np.linalg.inv(robot.T_world_base @ robot.controller.base) @ forward(bare, Q)


@pytest.mark.parametrize('tip', ['tcp', 'tool0', 'link_6'])
def test_corrected_files_keep_flange_and_base_where_the_tool_was_fitted(tip, tmp_path):
    given = tmp_path / 'given.urdf'
    fixed = ('link_6', 'tool0', '0.1 0 0', '0 1.5 0'), ('tool0', 'tcp', *TORCH)
    given.write_text(urdf(*fixed))
    nominal = load_robot(given, 'base_link', tip)
    tool = np.array(nominal.T_flange_tool)
    tool[:3, 3] += [0.02, -0.01, 0.03]  # a reflector beside the torch
    robot = replace(nominal.with_frames(tool=tool), theta=nominal.theta + [0, 2e-3, 1e-3, 0, 0, 0])

    write_urdf_like(tmp_path / 'like.urdf', GivenUrdf(given, 'base_link', tip), robot)
    write_robot_yaml(tmp_path / 'r.yaml', robot)
    write_urdf(tmp_path / 'own.urdf', robot)
    again = [
        load_robot(tmp_path / 'like.urdf', 'base_link', tip),
        load_robot(tmp_path / 'r.yaml'),
        load_robot(tmp_path / 'own.urdf'),
    ]
    for read in again:
        np.testing.assert_allclose(forward(read, Q), forward(robot, Q), atol=1e-12)
        np.testing.assert_allclose(hand_in_base(read), hand_in_base(robot), atol=1e-12)
        np.testing.assert_allclose(read.T_world_origin, robot.T_world_origin, atol=1e-12)


def arms(tmp_path):
    """Return one arm whose first axis points up in its URDF, and the same with it down."""
    fixed = ('link_6', 'tool0', '0.1 0 0', '0 1.5707963 0'), ('tool0', 'tcp', *TORCH)
    out = []
    for name, axis in (('up', '0 0 1'), ('down', '0 0 -1')):
        (tmp_path / f'{name}.urdf').write_text(urdf(*fixed, axis=axis))
        out.append(load_robot(tmp_path / f'{name}.urdf'))
    return out


def test_a_seam_lies_in_the_same_place_whichever_way_the_first_axis_counts(tmp_path):
    up, down = (default_seam(robot).sample(np.zeros(1)) for robot in arms(tmp_path))
    np.testing.assert_allclose(down.position, up.position, atol=1e-9)
    np.testing.assert_allclose(down.normal, [[0.0, 0.0, 1.0]], atol=1e-12)


def test_a_wrench_in_the_base_pulls_along_the_axes_of_the_base_link(tmp_path):
    for robot in arms(tmp_path):
        chain = frames(robot, Q)
        weight = np.array([0.0, 0.0, -9.80665, 0.0, 0.0, 0.0])
        hung = payload_torque(robot, chain, 1.0, np.zeros(3))
        np.testing.assert_allclose(wrench_torque(robot, chain, weight, 'base'), hung, atol=1e-12)


def test_a_tool_is_corrected_along_the_axes_of_the_controllers_flange(tmp_path):
    robot = arms(tmp_path)[1]
    # A millimetre along x of tool0, as the rows of this arm have it.
    x = robot.controller.flange[:3, 0] * 1e-3
    slipped, moved = (
        effect_from_mapping({'effect': name, 'xyz': x.tolist()})
        for name in ('tool_slip', 'tool_pose')
    )
    for told in actions([slipped, moved], robot):
        assert 'by +1.000 mm along axis x of the flange' in told
    real, _ = corrected(robot, [moved])
    on_flange = np.linalg.inv(robot.controller.flange)
    shift = (on_flange @ (real.T_flange_tool - robot.T_flange_tool))[:3, 3]
    np.testing.assert_allclose(shift, [1e-3, 0.0, 0.0], atol=1e-12)
