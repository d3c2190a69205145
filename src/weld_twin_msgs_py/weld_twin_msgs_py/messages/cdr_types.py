# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages as `cdr_read` reads them: immutable, with the names and fields of the standard types."""

from collections import namedtuple

Time = namedtuple('Time', 'sec nanosec')
"""Or a duration."""
Header = namedtuple('Header', 'stamp frame_id')
String = namedtuple('String', 'data')

Xyz = namedtuple('Xyz', 'x y z')
"""A Point or a Vector3."""
Xyzw = namedtuple('Xyzw', 'x y z w')
"""A Quaternion."""
Pose = namedtuple('Pose', 'position orientation')
PoseStamped = namedtuple('PoseStamped', 'header pose')
PoseWithCovariance = namedtuple('PoseWithCovariance', 'pose covariance')
PoseWithCovarianceStamped = namedtuple('PoseWithCovarianceStamped', 'header pose')
PointStamped = namedtuple('PointStamped', 'header point')
Vector3Stamped = namedtuple('Vector3Stamped', 'header vector')
Wrench = namedtuple('Wrench', 'force torque')
WrenchStamped = namedtuple('WrenchStamped', 'header wrench')
Transform = namedtuple('Transform', 'translation rotation')
TransformStamped = namedtuple('TransformStamped', 'header child_frame_id transform')
TFMessage = namedtuple('TFMessage', 'transforms')
Path = namedtuple('Path', 'header poses')

Temperature = namedtuple('Temperature', 'header temperature variance')
JointState = namedtuple('JointState', 'header name position velocity effort', defaults=((),))
TrajectoryPoint = namedtuple(
    'TrajectoryPoint', 'positions velocities accelerations effort time_from_start'
)
JointTrajectory = namedtuple('JointTrajectory', 'header joint_names points')
