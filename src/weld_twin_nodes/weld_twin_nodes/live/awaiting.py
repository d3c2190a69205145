# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A node that can do nothing before it was told something."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.executors import SingleThreadedExecutor

from weld_twin_core.errors import ModelError

from .cell_node import CellNode

LOOK = 0.1
"""Seconds of one turn of the loop that waits."""


def spin_until(node: CellNode, reported: Callable[[], bool], what: str) -> None:
    """
    Serve a node until something is told; log and health say meanwhile what it waits for.

    Raises
    ------
    ModelError
        The node is stopped before.

    """
    node.wait_for(what)
    runner = SingleThreadedExecutor(context=node.context)
    runner.add_node(node)
    try:
        while not reported():
            if not node.context.ok():
                raise ModelError(f'stopped while waiting for {what}')
            runner.spin_once(timeout_sec=LOOK)
    finally:
        runner.remove_node(node)
        runner.shutdown()
    node.wait_for('')
