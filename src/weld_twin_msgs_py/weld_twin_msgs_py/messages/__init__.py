# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""ROS messages to arrays and back, serialised or as objects, and the table of topics."""
