# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Tool poses as a pair of arrays."""

from typing import NamedTuple

from .arrays import Array


class Poses(NamedTuple):
    """Tool poses in the world frame: position (..., M, 3) [m], rotation (..., M, 3, 3)."""

    position: Array
    rotation: Array
