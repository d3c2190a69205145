# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables of joint angles and measured positions or poses, as laboratories leave them."""

from .build import Table, read_table
from .cameras import read_camera, read_pixels, read_target
from .contacts import read_contacts, write_touches
from .two_tables import read_two_tables
from .words import TableOptions

__all__ = [
    'Table',
    'TableOptions',
    'read_camera',
    'read_contacts',
    'read_pixels',
    'read_table',
    'read_target',
    'read_two_tables',
    'write_touches',
]
