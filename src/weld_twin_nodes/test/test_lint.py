# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The linters of ROS 2 over this package, where they are installed."""

from ros_lint import *  # noqa: F403
