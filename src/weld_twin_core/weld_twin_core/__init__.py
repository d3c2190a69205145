# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""weld_twin core: a robot's positional accuracy as arrays, without ROS and without files."""

__version__ = '0.1.0'
