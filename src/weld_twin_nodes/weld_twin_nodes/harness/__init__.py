# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Runs a cell without launch: nodes in this process or in their own, fed, awaited, listened to.

A test of one's own cell::

    from weld_twin_core.recording import JointMotion
    from weld_twin_nodes.harness import Cell

    def test_my_tracker_driver_keeps_its_stamps(motion: JointMotion):
        with Cell() as cell:
            cell.start('forward_kinematics_twin', robot='my_cell.yaml')   # its own process
            cell.start(['ros2', 'run', 'my_driver', 'tracker'])           # anybody's node
            poses = cell.collect('/twin/tool_pose')
            cell.feed(motion, joint_names)
            cell.wait(lambda: len(poses) == motion.t.size, 'a pose for every joint state')

Everything happens in a ROS domain of its own, on this machine only. `Cell.add` puts a node into
this process instead, where a debugger reaches it.
"""

from .cell import Cell, CellTimeout, Tap
from .process import NodeProcess

__all__ = ['Cell', 'CellTimeout', 'NodeProcess', 'Tap']
