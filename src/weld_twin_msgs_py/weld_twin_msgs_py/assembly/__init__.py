# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The one assembly of a cell's messages: into samples one by one, and into a `Recording`.

The running nodes and the reader of bags take every message through `Intake`, so that what is
refused, put together or held is the same for both.
"""

from .intake import Intake, Role, Taken
from .whole_recording import Samples, assembled

__all__ = ['Intake', 'Role', 'Samples', 'Taken', 'assembled']
