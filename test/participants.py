# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Nodes of somebody else, and what they send."""

from contextlib import contextmanager

import rclpy
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from scipy.spatial.transform import Rotation


@contextmanager
def participant(name, domain, namespace=''):
    """Yield a node in a participant of its own, as every driver is."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    node = Node(name, namespace=namespace, context=context)
    try:
        yield node
    finally:
        node.destroy_node()
        context.try_shutdown()


def placed(T, stamp, frame, child):
    """Return the message of a transform at a stamp [ns]."""
    out = TransformStamped(child_frame_id=child)
    out.header.frame_id = frame
    out.header.stamp.sec, out.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
    p, q = out.transform.translation, out.transform.rotation
    p.x, p.y, p.z = T[:3, 3].tolist()
    q.x, q.y, q.z, q.w = Rotation.from_matrix(T[:3, :3]).as_quat().tolist()
    return out
