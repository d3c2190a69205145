# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Robot models: bundled ones, YAML and URDF in; YAML and URDF out."""

from .load import load_robot, own_files, read_robot_yaml, robot_names, write_robot_yaml
from .urdf_read import parse_urdf, read_urdf
from .urdf_write import write_urdf

__all__ = [
    'load_robot',
    'own_files',
    'parse_urdf',
    'read_robot_yaml',
    'read_urdf',
    'robot_names',
    'write_robot_yaml',
    'write_urdf',
]
