# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Bags of trackers that publish transforms and of controllers that publish states of their own."""

from types import SimpleNamespace

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from weld_twin_core import DataError, ModelError, forward, load
from weld_twin_core.arm.rotation import quaternion_from_matrix
from weld_twin_core.cameras import Camera, Lens
from weld_twin_msgs_py.bags import bag_info, read_recording
from weld_twin_msgs_py.messages.image_points import corners
from weld_twin_msgs_py.messages.topics import TopicNames
from weld_twin_msgs_py.tables import read_target

ROBOT = load('ur5')
N = 12
RNG = np.random.default_rng(3)
Q = np.linspace(0.1, 0.6, N)[:, None] + RNG.uniform(-1.0, 1.0, 6)
TOOL = forward(ROBOT, Q)[:, :3, 3]
STATE = """\
std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint reference
trajectory_msgs/JointTrajectoryPoint feedback
================================================================================
MSG: trajectory_msgs/JointTrajectoryPoint
float64[] positions
float64[] velocities
float64[] accelerations
float64[] effort
builtin_interfaces/Duration time_from_start
"""
DYNAMIC = """\
std_msgs/Header header
string[] joint_names
InterfaceValue[] interface_values
================================================================================
MSG: control_msgs/InterfaceValue
string[] interface_names
float64[] values
"""
BODIES = """\
std_msgs/Header header
uint32 frame_number
mocap4r2_msgs/RigidBody[] rigidbodies
================================================================================
MSG: mocap4r2_msgs/RigidBody
std_msgs/Header header
uint32 frame_number
string rigid_body_name
mocap4r2_msgs/Marker[] markers
geometry_msgs/Pose pose
================================================================================
MSG: mocap4r2_msgs/Marker
int64 index
geometry_msgs/Point translation
"""
TAGS = """\
std_msgs/Header header
apriltag_msgs/AprilTagDetection[] detections
================================================================================
MSG: apriltag_msgs/AprilTagDetection
string family
int32 id
int32 hamming
float32 goodness
float32 decision_margin
apriltag_msgs/Point centre
apriltag_msgs/Point[4] corners
float64[9] homography
================================================================================
MSG: apriltag_msgs/Point
float64 x
float64 y
"""


class Cell:
    """Messages of a controller and a tracker, written by rosbags' own writer."""

    def __init__(self):
        self.store = get_typestore(Stores.ROS2_JAZZY)
        for name, text in (
            ('control_msgs/msg/JointTrajectoryControllerState', STATE),
            ('control_msgs/msg/DynamicJointState', DYNAMIC),
            ('mocap4r2_msgs/msg/RigidBodies', BODIES),
            ('apriltag_msgs/msg/AprilTagDetectionArray', TAGS),
        ):
            types = get_types_from_msg(text, name)
            self.store.register({k: v for k, v in types.items() if k not in self.store.types})
        self.rows = []

    def make(self, kind, **fields):
        return self.store.types[kind](**fields)

    def header(self, k, frame=''):
        stamp = self.make('builtin_interfaces/msg/Time', sec=k // 10 + 1, nanosec=k % 10 * 10**8)
        return self.make('std_msgs/msg/Header', stamp=stamp, frame_id=frame)

    def add(self, topic, kind, k, frame='', **fields):
        fields = fields if 'transforms' in fields else {'header': self.header(k, frame), **fields}
        self.rows.append((topic, kind, k, self.make(kind, **fields)))

    def joints(self, k, names=ROBOT.joint_names, q=None):
        none, q = np.array([]), Q[k] if q is None else q
        told = {'name': list(names), 'position': q, 'velocity': none, 'effort': none}
        self.add('/joint_states', 'sensor_msgs/msg/JointState', k, **told)

    def state(self, k, names, reference, feedback):
        """Add what a controller tells of its command and of what came of it."""

        def point(q):
            none = np.array([])
            now = self.make('builtin_interfaces/msg/Duration', sec=0, nanosec=0)
            told = {'positions': q, 'velocities': np.zeros(6), 'accelerations': none}
            kind = 'trajectory_msgs/msg/JointTrajectoryPoint'
            return self.make(kind, **told, effort=none, time_from_start=now)

        told = {'joint_names': names, 'reference': point(reference), 'feedback': point(feedback)}
        kind = 'control_msgs/msg/JointTrajectoryControllerState'
        self.add('/controller/state', kind, k, **told)

    def placed(self, pose, kind, place, turn):
        """Return a pose as a message of a kind, of two messages under these names."""
        where = 'Vector3' if place == 'translation' else 'Point'
        where = self.make(
            f'geometry_msgs/msg/{where}', **dict(zip('xyz', pose[:3, 3], strict=True))
        )
        q = dict(zip('xyzw', quaternion_from_matrix(pose[:3, :3]), strict=True))
        turned = self.make('geometry_msgs/msg/Quaternion', **q)
        return self.make(f'geometry_msgs/msg/{kind}', **{place: where, turn: turned})

    def transform(self, k, child='probe'):
        pose = self.placed(forward(ROBOT, Q[k]), 'Transform', 'translation', 'rotation')
        told = {'header': self.header(k, 'tracker'), 'child_frame_id': child, 'transform': pose}
        return self.make('geometry_msgs/msg/TransformStamped', **told)

    def write(self, folder):
        with Writer(folder / 'bag', version=9, storage_plugin=StoragePlugin.MCAP) as bag:
            known = {}
            for topic, kind, k, message in self.rows:
                if (topic, kind) not in known:
                    connection = bag.add_connection(topic, kind, typestore=self.store)
                    known[topic, kind] = connection
                data = self.store.serialize_cdr(message, kind)
                bag.write(known[topic, kind], (k + 10) * 10**8, data)
        return folder / 'bag'


@pytest.fixture
def cell():
    return Cell()


def assert_read(recording):
    np.testing.assert_allclose(recording.joints.q, Q, atol=1e-15)
    np.testing.assert_allclose(recording.measured.position, TOOL, atol=1e-12)


def test_transforms_of_one_topic_are_measured_poses(cell, tmp_path):
    for k in range(N):
        cell.joints(k)
        message = cell.transform(k)
        cell.rows.append(('/probe', 'geometry_msgs/msg/TransformStamped', k, message))
    assert_read(read_recording(cell.write(tmp_path), ROBOT, TopicNames(pose='/probe')))


def test_one_frame_of_tf_is_the_measured_pose(cell, tmp_path):
    for k in range(N):
        cell.joints(k)
        both = [cell.transform(k, 'camera'), cell.transform(k)]
        cell.add('/tf', 'tf2_msgs/msg/TFMessage', k, transforms=both)
    bag = cell.write(tmp_path)
    assert_read(read_recording(bag, ROBOT, TopicNames(pose='/tf:probe')))
    with pytest.raises(DataError, match='holds the frames camera, probe; say which'):
        read_recording(bag, ROBOT, TopicNames(pose='/tf'))


def test_one_rigid_body_of_a_motion_capture_system_is_the_measured_pose(cell, tmp_path):
    def body(k, name, pose):
        pose = cell.placed(pose, 'Pose', 'position', 'orientation')
        told = {'header': cell.header(k), 'frame_number': k, 'rigid_body_name': name, 'pose': pose}
        return cell.make('mocap4r2_msgs/msg/RigidBody', **told, markers=[])

    for k in range(N):
        cell.joints(k)
        seen = [body(k, 'table', np.eye(4)), body(k, 'torch', forward(ROBOT, Q[k]))]
        kind = 'mocap4r2_msgs/msg/RigidBodies'
        cell.add('/rigid_bodies', kind, k, 'mocap', frame_number=k, rigidbodies=seen)
    bag = cell.write(tmp_path)
    names = TopicNames(pose='/rigid_bodies:torch')
    assert_read(read_recording(bag, ROBOT, names))
    assert {topic.name: topic.use for topic in bag_info(bag, names).topics} == {
        '/joint_states': 'joints',
        '/rigid_bodies': 'pose',
    }
    with pytest.raises(DataError, match='holds the bodies table, torch; say which'):
        read_recording(bag, ROBOT, TopicNames(pose='/rigid_bodies'))


def test_the_reference_of_a_controller_is_the_commanded_motion(cell, tmp_path):
    for k in range(N):
        cell.state(k, list(ROBOT.joint_names), Q[k], Q[k] + 1e-3)
    bag = cell.write(tmp_path)
    for part, off in (('', 0.0), (':reference', 0.0), (':feedback', 1e-3)):
        names = TopicNames(joints=f'/controller/state{part}')
        np.testing.assert_allclose(read_recording(bag, ROBOT, names).joints.q, Q + off, atol=1e-15)
    with pytest.raises(DataError, match="no part 'eror'; reference and feedback"):
        read_recording(bag, ROBOT, TopicNames(joints='/controller/state:eror'))


def test_what_a_controller_feeds_back_is_measured_against_what_it_commanded(cell, tmp_path):
    """The servo's own gap: one topic tells of both, and no tracker is there."""
    turned = [f'left_{name}' for name in reversed(ROBOT.joint_names)]
    for k in range(N):
        cell.state(k, turned, np.flip(Q[k]) - 2e-3, np.flip(Q[k]).copy())
    names = TopicNames(joints='/controller/state', pose='/controller/state')
    bag = cell.write(tmp_path)
    assert bag_info(bag, names).usable
    recording = read_recording(bag, ROBOT, names)
    np.testing.assert_allclose(recording.joints.q, Q - 2e-3, atol=1e-15)
    np.testing.assert_allclose(recording.measured.position, TOOL, atol=1e-12)


def test_a_dynamic_joint_state_is_a_joint_state(cell, tmp_path):
    value = 'control_msgs/msg/InterfaceValue'
    for k in range(N):
        each = [
            cell.make(value, interface_names=['effort', 'position'], values=np.array([7.0, q]))
            for q in Q[k]
        ]
        other = cell.make(value, interface_names=['force'], values=np.array([1.0]))
        told = {'joint_names': ['wrench_sensor', *ROBOT.joint_names]}
        told['interface_values'] = [other, *each]
        cell.add('/dynamic_joint_states', 'control_msgs/msg/DynamicJointState', k, **told)
    bag, names = cell.write(tmp_path), TopicNames(joints='/dynamic_joint_states')
    np.testing.assert_allclose(read_recording(bag, ROBOT, names).joints.q, Q)
    assert 'joint states' not in ' '.join(bag_info(bag, names).missing)


def test_a_topic_whose_type_was_changed_while_it_was_recorded_is_told(cell, tmp_path):
    for k in range(N):
        cell.joints(k)
        pose = cell.placed(forward(ROBOT, Q[k]), 'Pose', 'position', 'orientation')
        sure = {'pose': pose, 'covariance': np.full(36, 1e-10)}
        whole = cell.make('geometry_msgs/msg/PoseWithCovariance', **sure)
        kinds = ('PoseStamped', pose), ('PoseWithCovarianceStamped', whole)
        name, what = kinds[k < N // 2]
        cell.add('/measured/tool_pose', f'geometry_msgs/msg/{name}', k, pose=what)
    bag = cell.write(tmp_path)
    with pytest.raises(DataError, match=r'Stamped and geometry_msgs.* one type alone'):
        read_recording(bag, ROBOT)
    assert not bag_info(bag).usable


def test_a_prefix_of_all_joints_is_taken_off_and_told(cell, tmp_path):
    for k in range(N):
        cell.joints(k, [f'left_{name}' for name in ROBOT.joint_names])
    recording = read_recording(cell.write(tmp_path), ROBOT)
    np.testing.assert_allclose(recording.joints.q, Q)
    assert "named with the prefix 'left_'" in ' '.join(recording.notes)


def test_one_of_two_robots_on_a_topic_is_read_by_its_prefix_and_a_map_of_names(cell, tmp_path):
    called = dict(zip(ROBOT.joint_names, 'ABCDEF', strict=True))
    both = [*(f'left/{name}' for name in 'ABCDEF'), *(f'right/{name}' for name in 'FEDCBA')]
    for k in range(N):
        cell.joints(k, both, np.concatenate([Q[k] + 1.0, np.flip(Q[k])]))
    names = TopicNames(joint_prefix='right/', joint_map=tuple(called.items()))
    recording = read_recording(cell.write(tmp_path), ROBOT, names)
    np.testing.assert_allclose(recording.joints.q, Q, atol=1e-15)
    with pytest.raises(ModelError, match="'knee' is given another name, but is no joint of robot"):
        read_recording(tmp_path / 'bag', ROBOT, TopicNames(joint_map=(('knee', 'A'),)))


FOCAL, SIDE = 1200.0, 0.06
MIDDLES = {7: (0.0, 0.0, 0.0), 11: (0.1, 0.02, 0.0)}
AGAINST_THE_CLOCK = ((-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0))
"""Corners of a tag as its detector counts them, x to the right and y down, in half sides."""


def detection(cell, tag, middle, board):
    """Return what apriltag_ros says of a tag on a board that a pinhole sees."""
    corners = [(*(0.5 * SIDE * np.array(c)), 0.0) for c in AGAINST_THE_CLOCK]
    there = (np.array(corners) + middle) @ board[:3, :3].T + board[:3, 3]
    places = FOCAL * there[:, :2] / there[:, 2:] + [640.0, 480.0]
    point = 'apriltag_msgs/msg/Point'
    told = {'family': 'tag36h11', 'id': tag, 'hamming': 0, 'goodness': 0.0}
    told |= {'decision_margin': 80.0, 'centre': cell.make(point, x=0.0, y=0.0)}
    told |= {'corners': [cell.make(point, x=x, y=y) for x, y in places], 'homography': np.zeros(9)}
    return cell.make('apriltag_msgs/msg/AprilTagDetection', **told)


def test_a_tag_that_has_not_four_corners_that_are_somewhere_is_refused():
    here, nowhere = SimpleNamespace(x=1.0, y=2.0), SimpleNamespace(x=np.nan, y=2.0)
    for found, words in (([here] * 3, 'has 3 corners'), ([here] * 3 + [nowhere], 'no finite')):
        message = SimpleNamespace(detections=[SimpleNamespace(id=7, corners=found)])
        with pytest.raises(DataError, match=words):
            corners(message)


def test_tags_that_a_camera_found_tell_poses(tmp_path):
    cell = Cell()
    eye = np.eye(4)
    eye[:3, 3] = [0.1, -0.2, 2.5]
    eye[:3, :3] = np.diag([1.0, -1.0, -1.0])
    boards = []
    for k in range(N):
        cell.joints(k)
        board = np.linalg.inv(eye) @ forward(ROBOT, Q[k])
        # Wherever the flange looks, the board on it faces the camera that looks down.
        board[:3, :3] = np.diag([1.0, 1.0, 1.0]) + 0.1 * np.cross(np.eye(3), [1.0, 0.3, -k])
        board[:3, :3] = np.linalg.qr(board[:3, :3])[0] * [-1.0, -1.0, -1.0]
        board[:3, :3] *= np.sign(np.linalg.det(board[:3, :3]))
        boards.append(board)
        tags = {**MIDDLES, 99: (0.3, 0.0, 0.0)}.items()
        found = [detection(cell, tag, middle, board) for tag, middle in tags]
        kind = 'apriltag_msgs/msg/AprilTagDetectionArray'
        cell.add('/detections', kind, k, 'eye', detections=found)
    (tmp_path / 'tags.yaml').write_text(
        f'board: tags\nsize: {SIDE}\ntags: {{7: [0, 0, 0], 11: [0.1, 0.02, 0]}}\n'
    )
    names = TopicNames(
        images='/detections',
        cameras=(Camera('eye', Lens([FOCAL, FOCAL], [640.0, 480.0], [])),),
        targets=(read_target('tags', tmp_path / 'tags.yaml'),),
    )
    recording = read_recording(cell.write(tmp_path), ROBOT, names)
    assert recording.images is not None and len(recording.images.pixel) == 8 * N
    made = np.array(boards)
    np.testing.assert_allclose(recording.measured.position, made[:, :3, 3], atol=2e-4)
    np.testing.assert_allclose(recording.measured.rotation, made[:, :3, :3], atol=2e-3)
