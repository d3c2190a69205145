# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The cell of the demo, in real time: generator, injector, twin, analyzer and, on request, recorder.

    ros2 launch weld_twin_nodes demo.launch.py
    ros2 launch weld_twin_nodes demo.launch.py bag:=my_bag config:=my_cell.yaml

Each node waits for its listeners, the recorder among them, so that a bag is whole. Nodes of other
machines neither see nor reach it unless ``discovery:=SUBNET`` is given; whatever includes this
file keeps its own discovery.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, NotEqualsSubstitution, PythonExpression
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

PACKAGE = 'weld_twin_nodes'
LISTENERS = {
    'deviation_analyzer': 0,
    'forward_kinematics_twin': 1,
    'error_injector': 1,
    'trajectory_generator': 2,
}
"""How many of these nodes take each node's main output; the recorder takes all of them."""


def generate_launch_description() -> LaunchDescription:
    """Return the description that `ros2 launch` runs."""
    config = Path(get_package_share_directory(PACKAGE)) / 'config' / 'demo.yaml'
    arguments = {
        'config': (str(config), 'parameter file'),
        'bag': ('', 'bag to record, if any'),
        'discovery': ('LOCALHOST', 'LOCALHOST, SUBNET or OFF'),
        'enclaves': ('/weld_twin', 'folder of the enclaves; only with ROS_SECURITY_ENABLE'),
    }
    bag = LaunchConfiguration('bag')
    recorder = _node(
        'recorder',
        {'out': ParameterValue(bag, value_type=str)},
        condition=IfCondition(NotEqualsSubstitution(bag, '')),
    )
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(name, default_value=default, description=meaning)
                for name, (default, meaning) in arguments.items()
            ),
            recorder,
            *(_node(name, {'wait_for_subscribers': _listeners(name)}) for name in LISTENERS),
        ]
    )


def _node(name: str, own: dict[str, ParameterValue], **options: IfCondition) -> Node:
    """Return a node with its own parameters over those of the file."""
    return Node(
        package=PACKAGE,
        executable=name,
        output='screen',
        ros_arguments=['--enclave', [LaunchConfiguration('enclaves'), f'/{name}']],
        parameters=[LaunchConfiguration('config'), own],
        additional_env={'ROS_AUTOMATIC_DISCOVERY_RANGE': LaunchConfiguration('discovery')},
        **options,
    )


def _listeners(name: str) -> ParameterValue:
    """Return how many take a node's main output, the recorder among them where there is one."""
    recorded = ["int('", LaunchConfiguration('bag'), "' != '')"]
    return ParameterValue(PythonExpression([f'{LISTENERS[name]} + ', *recorded]), value_type=int)
