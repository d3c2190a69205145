# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Joint origins and axes as the opened sources give them, and their plain product.

A chain is a list of (xyz [m], rpy [rad], axis), then xyz and rpy of the tool frame in the last
link. The numbers were copied from the sources by hand and know nothing of Denavit-Hartenberg.
"""

from math import pi

import numpy as np
from scipy.spatial.transform import Rotation

NONE = (0.0, 0.0, 0.0)
X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)


def minus(axis):
    """Return the axis the other way round."""
    return tuple(-value for value in axis)


def ur(shoulder, forearm, wrist_1, wrist_2, wrist_3):
    """Return the chain that default_kinematics.yaml of ur_description holds."""
    joints = [
        ((0, 0, shoulder), NONE, Z),
        (NONE, (pi / 2, 0, 0), Z),
        ((forearm, 0, 0), NONE, Z),
        (wrist_1, NONE, Z),
        ((0, wrist_2, 0), (pi / 2, 0, 0), Z),
        ((0, wrist_3, 0), (pi / 2, pi, pi), Z),
    ]
    return joints, (NONE, NONE)


def parallel(text, tool):
    """Return a chain whose frames are all parallel at zero, from the xyz and the axis of every joint."""
    joints = []
    for row in text.split('; '):
        *xyz, axis = row.split()
        way = {'x': X, 'y': Y, 'z': Z}[axis[-1]]
        joints.append((tuple(map(float, xyz)), NONE, minus(way) if axis[0] == '-' else way))
    return joints, tool


def abb(height, forward, arm, elbow, forearm, flange):
    """Return a chain of the xacro files of abb_*_support."""
    body = f'0 0 {height} z; {forward} 0 0 y; 0 0 {arm} y; 0 0 {elbow} x'
    return parallel(f'{body}; {forearm} 0 0 y; {flange} 0 0 x', (NONE, (0, pi / 2, 0)))


def kuka(height, forward, arm, forearm, flange):
    """Return a chain of the xacro files of kuka_kr16_support."""
    body = f'0 0 {height} -z; {forward} 0 0 y; {arm} 0 0 y; {forearm} -x'
    return parallel(f'{body}; 0 0 0 y; 0 0 0 -x', ((flange, 0, 0), (0, pi / 2, 0)))


CHAINS = {
    'ur3e': ur(0.15185, -0.24355, (-0.2132, 0, 0.13105), -0.08535, 0.0921),
    'ur5e': ur(0.1625, -0.425, (-0.3922, 0, 0.1333), -0.0997, 0.0996),
    'ur10e': ur(0.1807, -0.6127, (-0.57155, 0, 0.17415), -0.11985, 0.11655),
    'ur16e': ur(0.1807, -0.4784, (-0.36, 0, 0.17415), -0.11985, 0.11655),
    'ur20': ur(0.2363, -0.862, (-0.7287, 0, 0.201), -0.1593, 0.1543),
    # The source has the flange's axes parallel to those of the base; here as the AR2010.
    'yaskawa_ma2010': parallel(
        '0 0 0.505 z; 0.15 0 0 y; 0 0 0.76 -y; 0 0 0.2 -x; 1.082 0 0 -y; 0 0 0 -x',
        ((0.1, 0, 0), (pi, -pi / 2, 0)),
    ),
    'yaskawa_ma1440': (
        [
            ((0, 0, 0.45), NONE, Z),
            ((0.155, 0, 0), (-pi / 4, -pi / 2, -pi / 4), Z),
            ((0.614, 0, 0), (pi, 0, 0), Z),
            ((0.2, -0.64, 0), (-pi / 2, 0, 0), Z),
            (NONE, (pi / 2, 0, 0), Z),
            ((0, -0.1, 0), (-pi / 2, 0, 0), Z),
        ],
        # The source has no flange frame; this is that of the AR2010.
        (NONE, (pi, 0, 0)),
    ),
    'yaskawa_ar2010': (
        [
            ((0, 0, 0.505), NONE, Z),
            ((0.15, 0, 0), (pi / 2, -pi / 2, -pi), Z),
            ((0.76, 0, 0), (pi, 0, 0), Z),
            ((0.2, 0, 0), (-pi / 2, 0, 0), Z),
            ((0, 0, -1.082), (pi / 2, 0, 0), Z),
            ((0, -0.1, 0), (-pi / 2, 0, 0), Z),
        ],
        # Flange and tool0 of the source, one after the other, are half a turn about x.
        (NONE, (pi, 0, 0)),
    ),
    'fanuc_m10id12': parallel(
        '0 0 0.3035 z; 0.075 0 0.1465 y; 0 0 0.64 -y; '
        '0.2555 0 0.195 -x; 0.4445 -0.0572 0 -y; 0.075 0.0572 0 -x',
        (NONE, (pi, -pi / 2, 0)),
    ),
    'fanuc_m20id25': (
        [
            ((0, 0, 0.425), NONE, Z),
            ((0.075, 0, 0), NONE, Y),
            ((0, 0, 0.84), (0, pi / 2, 0), minus(Y)),
            ((-0.215, 0, 0.89), NONE, minus(Z)),
            (NONE, NONE, minus(Y)),
            ((0, 0, 0.09), NONE, minus(Z)),
        ],
        (NONE, NONE),
    ),
    'fanuc_m10ia': parallel(
        '0 0 0 z; 0.15 -0.04 0.45 y; 0 -0.0225 0.6 -y; '
        '0.1805 0.0625 0.2 -x; 0.4595 -0.0565 0 -y; 0.1 0.0565 0 -x',
        (NONE, (pi, -pi / 2, 0)),
    ),
    'abb_irb120': abb(0.29, 0, 0.27, 0.07, 0.302, 0.072),
    'abb_irb1600': abb(0.4865, 0.15, 0.475, 0, 0.6, 0.065),
    'kuka_kr6_r900': kuka(0.4, 0.025, 0.455, '0.42 0 0.035', 0.08),
    'abb_irb2600_12_165': abb(0.445, 0.15, 0.7, 0.115, 0.795, 0.085),
    'abb_irb4600_40_255': abb(0.495, 0.175, 1.095, 0.175, 1.27, 0.135),
    'staubli_tx2_90l': parallel(
        '0 0 0.478 z; 0.05 0 0 y; 0 0.05 0.5 y; 0 0 0 z; 0 0 0.55 y; 0 0 0.1 z',
        (NONE, NONE),
    ),
    'kuka_iiwa14': parallel(
        '0 0 0.1475 z; 0 -0.01 0.2125 y; 0 0.01 0.228 z; 0 0.0105 0.192 -y; '
        '0 -0.0105 0.2075 z; 0 -0.0707 0.1925 y; 0 0.0707 0.091 z',
        ((0, 0, 0.035), NONE),
    ),
    # The source begins 12.498 mm behind axis 1; the controller's base is on the axis.
    # The source has no flange frame; the controller tells 0, 90, 0 degrees at zero.
    'mecademic_meca500': parallel(
        '0 0 0.091 z; 0 0 0.044 y; 0 0 0.135 y; 0 0 0.038 x; 0.12 0 0 y; 0.07 0 0 x',
        (NONE, (0, pi / 2, 0)),
    ),
    'kuka_kr16_2': kuka(0.675, 0.26, 0.68, '0.67 0 -0.035', 0.158),
    'kuka_kr16_r1610_2': kuka(0.52, 0.16, 0.78, '0.655 0 0.15', 0.153),
}


def pose(xyz, rotation):
    """Return the 4 x 4 pose of a position and a scipy rotation."""
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = rotation.as_matrix(), xyz
    return out


def fixed(xyz, rpy):
    """Return the pose that a URDF origin means."""
    return pose(xyz, Rotation.from_euler('xyz', rpy))


def chain_poses(name, q):
    """Return the pose of every link and, last, of the tool in the base, shape (n + 1, 4, 4)."""
    joints, tool = CHAINS[name]
    at, out = np.eye(4), []
    for (xyz, rpy, axis), angle in zip(joints, q, strict=True):
        turned = pose(NONE, Rotation.from_rotvec(angle * np.asarray(axis)))
        at = at @ fixed(xyz, rpy) @ turned
        out.append(at)
    return np.array([*out, at @ fixed(*tool)])
