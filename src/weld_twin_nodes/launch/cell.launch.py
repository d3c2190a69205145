# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The nodes beside a real cell: twin, analyzer, markers; recorder, live diagnosis, RViz on request.

    ros2 launch weld_twin_nodes cell.launch.py robot:=ur10 pose_topic:=/tracker/pose bag:=monday
    ros2 launch weld_twin_nodes cell.launch.py --show-args

The controller gives the joint states, a tracker the measurements. Nothing here moves a robot but the
compensator, where it is asked for, activated, and told to apply what it corrects.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import (
    EnvironmentVariable,
    LaunchConfiguration,
    NotEqualsSubstitution,
    PythonExpression,
)
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

PACKAGE = 'weld_twin_nodes'
RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
ARGUMENTS = {
    'namespace': ('', 'namespace of all nodes and of the topics without a leading slash'),
    'robot': ('topic', "bundled robot, robot file or URDF; 'topic': from robot_description"),
    'base_link': ('', 'first link of the chain in a URDF'),
    'tip_link': ('', 'last link of the chain in a URDF'),
    'model': ('', 'effects file or diagnosis.json that the twin is to know'),
    'measuring_frame': ('', 'frame that measurements must be given in; empty: the first seen'),
    'measured_frame': ('', 'frame that was measured, where measurements come as transforms'),
    'base_from_tf': ('false', 'take from /tf where the base is: base_frame in measuring_frame'),
    'joint_prefix': ('', "what the joint states put before the robot's joint names"),
    'base_frame': ('', "name of the robot's base in what is published; empty: base"),
    'joint_topic': ('joint_states', 'joint states of the controller'),
    'pose_topic': ('measured/tool_pose', 'poses of the tracker'),
    'point_topic': ('measured/tool_point', 'points of a tracker that gives no orientation'),
    'wrench_topic': ('tool_wrench', 'load on the tool'),
    'temperature_topic': ('temperature', 'temperature of the arm'),
    'use_sim_time': ('false', 'take the time from /clock'),
    'bag': ('', 'bag to record, if any'),
    'align': ('', 'frames that the live diagnosis fits along: base, tool, or base,tool'),
    'managed': ('false', 'recorder and live diagnosis wait for the transitions of managed nodes'),
    'live': ('true', 'diagnose while the cell works'),
    'compensate': ('false', 'run the compensator; it waits to be configured and activated'),
    'controller': ('joint_trajectory_controller', 'controller that corrected goals go to'),
    'apply': ('false', 'send what the compensator corrects; else it tells the correction alone'),
    'rviz': ('false', 'show the cell in RViz'),
    'config': ('', 'parameter file; empty: config/cell.yaml of this package'),
}
ENCLAVES = ("'/' + ('", "'.strip('/') or 'weld_twin')")
"""What stands around the namespace in the folder of enclaves, as `weld-twin export policy` names it."""
MODEL = ('base_frame', 'base_from_tf', 'base_link', 'measuring_frame', 'robot', 'tip_link')
MEASURED = ('joint_prefix', 'measured_frame')
FLAGS = ('apply', 'base_from_tf', 'managed')
TOPICS = {
    'joint_states': 'joint_topic',
    'measured/tool_point': 'point_topic',
    'measured/tool_pose': 'pose_topic',
    'temperature': 'temperature_topic',
    'tool_wrench': 'wrench_topic',
}
NODES = {
    'compensator': (*MODEL, 'apply', 'controller', 'joint_prefix', 'model'),
    'deviation_analyzer': (*MODEL, *MEASURED),
    'deviation_markers': (*MODEL, *MEASURED),
    'forward_kinematics_twin': (*MODEL, 'joint_prefix', 'model'),
    'live_diagnosis': (*MODEL, *MEASURED, 'align', 'managed', 'model'),
    'recorder': ('managed',),
}
"""Nodes, and the arguments each takes as a parameter of the same name."""
CONDITIONS = {
    'compensator': IfCondition(LaunchConfiguration('compensate')),
    'live_diagnosis': IfCondition(LaunchConfiguration('live')),
    'recorder': IfCondition(NotEqualsSubstitution(LaunchConfiguration('bag'), '')),
}


def generate_launch_description() -> LaunchDescription:
    """Return the description that `ros2 launch` runs."""
    config = Path(get_package_share_directory(PACKAGE)) / 'config'
    declared = [
        DeclareLaunchArgument(
            name,
            default_value=str(config / 'cell.yaml') if name == 'config' else default,
            description=meaning,
        )
        for name, (default, meaning) in ARGUMENTS.items()
    ]
    discovery = DeclareLaunchArgument(
        'discovery',
        default_value=EnvironmentVariable(RANGE, default_value='SUBNET'),
        description='LOCALHOST, SUBNET or OFF, for these nodes alone',
    )
    enclaves = DeclareLaunchArgument(
        'enclaves',
        default_value=PythonExpression(
            [ENCLAVES[0], LaunchConfiguration('namespace'), ENCLAVES[1]]
        ),
        description='folder of the enclaves, each called like its node; only with ROS_SECURITY_ENABLE',
    )
    rviz = Node(
        package='rviz2',
        executable='rviz2',
        arguments=['-d', str(config / 'cell.rviz')],
        additional_env={RANGE: LaunchConfiguration('discovery')},
        condition=IfCondition(LaunchConfiguration('rviz')),
    )
    return LaunchDescription([*declared, discovery, enclaves, *map(_node, NODES), rviz])


def _node(name: str) -> Node:
    """Return a node with the arguments that are its parameters."""
    own: dict[str, ParameterValue] = {
        key: ParameterValue(LaunchConfiguration(key), value_type=bool if key in FLAGS else str)
        for key in NODES[name]
    }
    own['use_sim_time'] = ParameterValue(LaunchConfiguration('use_sim_time'), value_type=bool)
    if name == 'recorder':
        own['out'] = ParameterValue(LaunchConfiguration('bag'), value_type=str)
    return Node(
        package=PACKAGE,
        executable=name,
        namespace=LaunchConfiguration('namespace'),
        output='screen',
        ros_arguments=['--enclave', [LaunchConfiguration('enclaves'), f'/{name}']],
        parameters=[LaunchConfiguration('config'), own],
        remappings=[(topic, LaunchConfiguration(key)) for topic, key in TOPICS.items()],
        additional_env={RANGE: LaunchConfiguration('discovery')},
        condition=CONDITIONS.get(name),
    )
