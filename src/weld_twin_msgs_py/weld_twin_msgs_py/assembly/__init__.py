# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The one assembly of a cell's messages: into samples one by one, and into a `Recording`."""

from .intake import Intake, Role, Taken
from .whole_recording import Samples, assembled

__all__ = ['Intake', 'Role', 'Samples', 'Taken', 'assembled']
