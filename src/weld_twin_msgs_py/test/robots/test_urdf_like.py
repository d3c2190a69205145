# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A corrected robot in its own URDF: names stay, and the tool goes where the correction says."""

from dataclasses import replace

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_msgs_py.robots import load_robot
from weld_twin_msgs_py.robots.urdf_like import GivenUrdf, write_urdf_like

URDF = """<robot name="pinned">
 <link name="foot"/><link name="arm"><visual><geometry><mesh filename="a.stl"/></geometry></visual>
 </link><link name="elbow"/><link name="fore"/><link name="hand"/><link name="ball"/>
 <joint name="turn" type="revolute"><origin xyz="0.1 0 0.3" rpy="0 0 0.2"/><parent link="foot"/>
  <child link="arm"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
 <joint name="lift" type="fixed"><origin xyz="0 0.05 0.2" rpy="0.1 0 0"/><parent link="arm"/>
  <child link="elbow"/></joint>
 <joint name="bend" type="revolute"><origin xyz="0.3 0 0" rpy="0 0.4 0"/><parent link="elbow"/>
  <child link="fore"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
 <joint name="grip" type="fixed"><origin xyz="0.4 0 0" rpy="0 0 0"/><parent link="fore"/>
  <child link="hand"/></joint>
 <joint name="screw" type="fixed"><origin xyz="0 0 0.05" rpy="0 0 0"/><parent link="hand"/>
  <child link="ball"/></joint>
</robot>
"""


def pose(robot, q):
    """Return the tool pose at joint positions."""
    motion = wt.JointMotion([0.0], [q], static=True)
    return wt.Twin(robot).poses(wt.Recording('', motion), np.zeros(1))


@pytest.mark.parametrize('q', [(0.0, 0.0), (0.7, -1.1), (-1.3, 0.4)])
def test_names_stay_and_the_tip_goes_where_the_corrected_robot_has_it(tmp_path, q):
    (tmp_path / 'given.urdf').write_text(URDF)
    nominal = load_robot(tmp_path / 'given.urdf')
    tool = np.array(nominal.T_flange_tool)
    tool[:3, 3] += [0.001, -0.002, 0.003]
    wrong = replace(
        nominal.with_frames(tool=tool),
        theta=nominal.theta + [0.01, -0.02],
        a=nominal.a + [0.002, 0.001],
        alpha=nominal.alpha + [0.004, -0.003],
        d=nominal.d + [0.001, 0.002],
    )

    write_urdf_like(tmp_path / 'robot.urdf', GivenUrdf(tmp_path / 'given.urdf'), wrong)

    text = (tmp_path / 'robot.urdf').read_text()
    again = load_robot(tmp_path / 'robot.urdf', base_link='foot', tip_link='ball')
    assert again.joint_names == ('turn', 'bend')
    assert 'filename="a.stl"' in text
    np.testing.assert_allclose(pose(again, q).position, pose(wrong, q).position, atol=1e-12)
    np.testing.assert_allclose(pose(again, q).rotation, pose(wrong, q).rotation, atol=1e-12)
