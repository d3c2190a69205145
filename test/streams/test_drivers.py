# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What drivers publish, laid out as their sources have it, is taken with the options that are told.

Each layout names the file that it was read from and the commit. Joints are published with the
quality of service of the driver; the oracle is the kinematics of the robot at the joints by name.
"""

import re
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from geometry_msgs.msg import PoseStamped
from participants import participant, placed
from rclpy.qos import QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from sensor_msgs.msg import JointState

from weld_twin_core import Robot, forward, load
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.to_messages import ros_messages
from weld_twin_msgs_py.messages.topics import TWIN_BASE, TWIN_POSE
from weld_twin_nodes.harness import Cell
from weld_twin_nodes.live.deviation_analyzer import DeviationAnalyzer
from weld_twin_nodes.live.forward_kinematics_twin import ForwardKinematicsTwin

pytestmark = pytest.mark.cells

S = 1_000_000_000
GUIDE = Path(__file__).parents[2] / 'docs/cell.md'
UR_ORDER = (1, 2, 3, 4, 5, 0)
"""What a hardware interface lists is what joint_state_broadcaster publishes: in any order."""


def numbered(name, count=6):
    return tuple(name.format(k) for k in range(1, count + 1))


@dataclass(frozen=True)
class Driver:
    """Joints as a driver publishes them."""

    source: str  # repository, file and commit that the layout was read from
    robot: str  # the model that stands for the arm
    names: tuple  # the arm's joints in the order of the robot
    beside: tuple = ()  # other joints in the same message
    order: tuple = (0, 1, 2, 3, 4, 5)  # places of the published joints in that of the robot
    velocities: bool = True  # whether it has a velocity interface; else the broadcaster gives NaN
    sensor: bool = False  # best effort, as sensor data
    options: dict = field(default_factory=dict)  # parameters of the nodes


UR = 'UniversalRobots/Universal_Robots_ROS2_Driver ur_robot_driver/config/ur_controllers.yaml 032aad68'
UR5E = tuple(load('ur5e').joint_names)
MOTO = 'Yaskawa-Global/motoros2 config/motoros2_config.yaml 045485df'
YASKAWA = ('joint_1_s', 'joint_2_l', 'joint_3_u', 'joint_4_r', 'joint_5_b', 'joint_6_t')
YASKAWA_MAP = '{' + ', '.join(f'{n}: joint_{k}' for k, n in enumerate(YASKAWA, 1)) + '}'
GROUP = {'joint_prefix': 'group_1/', 'joint_map': YASKAWA_MAP}
FANUC = (
    'FANUC-CORPORATION/fanuc_driver fanuc_hardware_interface/config/ros2_controllers.yaml 71c1ae47'
)
KUKA = 'kroshu/kuka_drivers kuka_rsi_driver/config/'
RSI = f'{KUKA}joint_trajectory_controller_config_6_axis_kl.yaml cca4b3b3'
DUAL = f'{KUKA}dual_arm/joint_trajectory_controller_config_dual_arm.yaml eb24c5cb'
KUKA_MAP = '{' + ', '.join(f'joint_a{k}: joint_{k}' for k in range(1, 7)) + '}'
DRIVERS = {
    'ur_robot_driver': Driver(UR, 'ur5e', UR5E, order=UR_ORDER),
    'ur_robot_driver, tf_prefix': Driver(
        UR, 'ur5e', tuple(f'alice_{name}' for name in UR5E), order=UR_ORDER
    ),
    'MotoROS2': Driver(
        MOTO, 'yaskawa_ma2010', numbered('group_1/joint_{}'), sensor=True, options=GROUP
    ),
    'MotoROS2, R1+B1+S1': Driver(
        MOTO,
        'yaskawa_ma2010',
        numbered('group_1/joint_{}'),
        ('group_2/joint_1', 'group_3/joint_1', 'group_3/joint_2'),
        sensor=True,
        options={**GROUP, 'joints_beside': 'group_3/joint_1, group_3/joint_2'},
    ),
    'fanuc_driver': Driver(
        FANUC,
        'fanuc_m10id12',
        numbered('J{}'),
        velocities=False,
        options={'joint_map': '{' + ', '.join(f'joint_{k}: J{k}' for k in range(1, 7)) + '}'},
    ),
    'kuka_drivers': Driver(
        RSI, 'kuka_kr16_2', numbered('joint_{}'), velocities=False, options={'joint_map': KUKA_MAP}
    ),
    'kuka_drivers, linear unit': Driver(
        RSI,
        'kuka_kr16_2',
        numbered('joint_{}'),
        ('rail_joint_1',),
        velocities=False,
        options={'joint_map': KUKA_MAP},
    ),
    'kuka_drivers, two arms': Driver(
        DUAL,
        'kuka_kr16_2',
        numbered('robot1_joint_{}'),
        numbered('robot2_joint_{}'),
        velocities=False,
        options={'joint_prefix': 'robot1_', 'joint_map': KUKA_MAP},
    ),
    'abb_ros2': Driver(
        'PickNikRobotics/abb_ros2 abb_bringup/config/abb_controllers.yaml 713c4c22',
        'abb_irb1600',
        numbered('joint_{}'),
    ),
    'franka_ros2': Driver(
        'frankaemika/franka_ros2 franka_bringup/config/controllers.yaml 07c6541f',
        'franka_panda',
        numbered('panda_joint{}', 7),
        ('panda_finger_joint1', 'panda_finger_joint2'),
        order=tuple(range(7)),
        options={'joints_beside': 'panda_finger_joint1, panda_finger_joint2'},
    ),
    'doosan-robot2': Driver(
        'DoosanRobotics/doosan-robot2 dsr_controller2/config/dsr_controller2.yaml 03ca15b9',
        'abb_irb1600',  # no arm of this maker is bundled: names and order are what is taken
        numbered('joint_{}'),
        order=(0, 1, 3, 4, 2, 5),
    ),
    'xarm_ros2': Driver(
        'xArm-Developer/xarm_ros2 xarm_controller/config/xarm6_controllers.yaml 08ca7e44',
        'mecademic_meca500',  # likewise
        numbered('joint{}'),
    ),
}
CARRIED = {'MotoROS2, R1+B1+S1': 'group_2/joint_1', 'kuka_drivers, linear unit': 'rail_joint_1'}
"""Layouts whose arm stands on an axis that the model lacks, which is told when it moves."""


def posture(robot: Robot) -> np.ndarray:
    low, high = np.maximum(robot.lower, -3.0), np.minimum(robot.upper, 3.0)
    return low + (high - low) * np.linspace(0.3, 0.6, robot.n)


def joint_state(driver, q, ns, travel):
    """Return the message that the driver would send."""
    out = JointState()
    out.header.stamp.sec, out.header.stamp.nanosec = divmod(ns, S)
    out.name = [*(driver.names[k] for k in driver.order), *driver.beside]
    out.position = [*(q[k] for k in driver.order), *([travel] * len(driver.beside))]
    count = len(out.name)
    out.velocity = [0.0 if driver.velocities else np.nan] * count
    out.effort = [np.nan] * count
    return out


@pytest.fixture(scope='module')
def cell(tmp_path_factory):
    with Cell(tmp_path_factory.mktemp('drivers')) as cell:
        yield cell


@pytest.fixture
def node(cell):
    """Put a node into the shared cell for one test."""
    added = []

    def add(make, **options):
        added.append(cell.add(make, **options))
        return added[-1]

    yield add
    for each in added:
        cell.remove(each)


@pytest.fixture(scope='module')
def driver_node(cell):
    with participant('driver', cell.domain) as node:
        yield node


@pytest.mark.parametrize('which', DRIVERS)
def test_the_joints_of_a_driver_move_the_twin(cell, node, driver_node, which):
    driver, robot = DRIVERS[which], load(DRIVERS[which].robot)
    reliable = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
    qos = qos_profile_sensor_data if driver.sensor else reliable
    twin = node(ForwardKinematicsTwin, robot=driver.robot, **driver.options)
    sender = driver_node.create_publisher(JointState, '/joint_states', qos)
    poses = cell.collect(TWIN_POSE.name)
    q, stamp = posture(robot), [S]

    def step(travel=0.0, since=S):
        stamp[0] += S // 100
        sender.publish(joint_state(driver, q, stamp[0], travel))
        return len(poses) > 0 and poses.stamps[-1] > since

    cell.wait(step, f'poses of {which}')
    position, rotation = from_messages.pose(poses.last)
    expected = forward(robot, q)
    np.testing.assert_allclose(position, expected[:3, 3], atol=1e-12)
    np.testing.assert_allclose(rotation, expected[:3, :3], atol=1e-12)
    moved = stamp[0] + S // 100
    cell.wait(lambda: step(0.1, moved), 'poses while what stands beside the arm moves')
    twin.tell_health()
    told = twin.health.lasting.get('joints beside', '')
    assert told.partition(' moved')[0] == CARRIED.get(which, '')
    driver_node.destroy_publisher(sender)


def off(T):
    """Return a measured pose: a millimetre aside."""
    out = T.copy()
    out[:3, 3] += [1e-3, -2e-3, 5e-4]
    return out


def rigid_bodies(T, header):
    """Return what vicon, optitrack and qualisys drivers of MOCAP4ROS2 send, the tool second."""
    from mocap4r2_msgs.msg import RigidBodies, RigidBody

    other = RigidBody(rigid_body_name='table')
    other.pose.orientation.w = 1.0
    tool = RigidBody(rigid_body_name='torch', pose=pose(T, header).pose)
    return RigidBodies(header=header, rigidbodies=[other, tool])


def tag(T, header):
    from tf2_msgs.msg import TFMessage

    stamp = header.stamp.sec * S + header.stamp.nanosec
    return TFMessage(transforms=[placed(T, stamp, header.frame_id, '36h11:5')])


def pose(T, header):
    out = ros_messages().pose(S, T[:3, 3], T[:3, :3])
    out.header = header
    return out


def point(T, header):
    out = ros_messages().point(S, T[:3, 3])
    out.header = header
    return out


INSTRUMENTS = {
    'MOCAP4ROS2 (vicon, optitrack, qualisys)': (
        'MOCAP4ROS2-Project/mocap4r2_msgs msg/RigidBodies.msg 58db978e',
        rigid_bodies,
        '/rigid_bodies',
        {'measured_frame': 'torch'},
    ),
    'apriltag_ros': (
        'christianrauch/apriltag_ros src/AprilTagNode.cpp 011db4ee',
        tag,
        '/tf',
        {'measured_frame': '36h11:5'},
    ),
    'lasertracker_ros2_control': (
        'christophfroehlich/lasertracker_ros2_control '
        'lasertracker_ros2_control/bringup/config/lasertracker_controllers.yaml 7c56428d',
        pose,
        '/pose_broadcaster/pose',
        {},
    ),
    'points in bursts': ('a tracker that hands on 20 points at once', point, '/points', {}),
}


@pytest.mark.parametrize('which', INSTRUMENTS)
def test_what_an_instrument_sends_is_compared(cell, node, driver_node, packages, which):
    _, make, topic, options = INSTRUMENTS[which]
    place = 'tool_point' if make is point else 'tool_pose'
    names = ['--ros-args', '-r', f'measured/{place}:={topic}']
    analyzer = node(DeviationAnalyzer, robot='ur5', cli_args=names, **options)
    twin, base = cell.publisher(TWIN_POSE), cell.publisher(TWIN_BASE)
    base.publish(cell.messages.pose(S, np.zeros(3), np.eye(3), 'world'))
    T = forward(load('ur5'), posture(load('ur5')))
    theirs = driver_node.create_publisher(
        type(make(T, PoseStamped().header)), topic, qos_profile_sensor_data
    )
    deviations, stamp, held = cell.collect('/deviation'), [S], []
    due = [0.0]

    def step():
        if time.monotonic() < due[0]:
            return False
        due[0] = time.monotonic() + 0.02
        stamp[0] += S // 100
        header = PoseStamped().header
        header.frame_id = 'instrument'
        header.stamp.sec, header.stamp.nanosec = divmod(stamp[0], S)
        twin.publish(cell.messages.pose(stamp[0], T[:3, 3], T[:3, :3], 'world'))
        held.append(make(off(T), header))
        if make is not point or len(held) == 20:
            for message in held:
                theirs.publish(message)
            held.clear()
        return len(deviations) > 45

    cell.wait(step, f'deviations by {which}')
    np.testing.assert_allclose(
        from_messages.vector3(deviations.last), [1e-3, -2e-3, 5e-4], atol=1e-9
    )
    assert analyzer.health.inputs[topic].lost == 0
    for publisher in (twin, base):
        cell.node.destroy_publisher(publisher)
    driver_node.destroy_publisher(theirs)


def test_the_guide_has_a_row_for_each_with_its_options_and_its_source():
    text = GUIDE.read_text()
    rows = [line for line in text.splitlines() if line.startswith('| ')]
    given = {which: (driver.source, driver.options) for which, driver in DRIVERS.items()}
    given |= {which: (row[0], row[3]) for which, row in INSTRUMENTS.items()}
    for which, (source, options) in given.items():
        row = next((row for row in rows if row.startswith(f'| {which} |')), '')
        assert row, which
        if 'the same' not in row:
            assert all(name in row for name in options), row
        commit = re.search(r' ([0-9a-f]{8})$', source)
        if commit is not None:
            repository, file = source.split()[:2]
            assert f'`{repository}`, `{file}`, commit {commit[1]} |' in text, which
