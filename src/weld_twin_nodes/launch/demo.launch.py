# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The cell of the demo, in real time: generator, injector, twin, analyzer and, on request, recorder.

    ros2 launch weld_twin_nodes demo.launch.py
    ros2 launch weld_twin_nodes demo.launch.py bag:=my_bag config:=my_cell.yaml

Nodes of other machines neither see nor reach it unless ``discovery:=SUBNET`` is given.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, SetEnvironmentVariable
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PythonExpression
from launch_ros.actions import Node

PACKAGE = 'weld_twin_nodes'
NODES = (
    'deviation_analyzer',
    'forward_kinematics_twin',
    'error_injector',
    'trajectory_generator',
)


def generate_launch_description() -> LaunchDescription:
    """Return the description that `ros2 launch` runs."""
    config = str(Path(get_package_share_directory(PACKAGE)) / 'config' / 'demo.yaml')
    parameters = [LaunchConfiguration('config')]
    bag = LaunchConfiguration('bag')
    recorder = Node(
        package=PACKAGE,
        executable='recorder',
        output='screen',
        parameters=[*parameters, {'out': bag}],
        condition=IfCondition(PythonExpression(["'", bag, "' != ''"])),
    )
    return LaunchDescription(
        [
            DeclareLaunchArgument('config', default_value=config, description='parameter file'),
            DeclareLaunchArgument('bag', default_value='', description='bag to record, if any'),
            DeclareLaunchArgument(
                'discovery',
                default_value='LOCALHOST',
                description='LOCALHOST, SUBNET or OFF',
            ),
            SetEnvironmentVariable(
                'ROS_AUTOMATIC_DISCOVERY_RANGE', LaunchConfiguration('discovery')
            ),
            recorder,
            *(
                Node(package=PACKAGE, executable=name, output='screen', parameters=parameters)
                for name in NODES
            ),
        ]
    )
