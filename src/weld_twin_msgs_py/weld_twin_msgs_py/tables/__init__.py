# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables of joint angles and measured positions or poses, as laboratories leave them."""

from .build import Table, read_table
from .contacts import quoted, read_contacts, write_touches
from .table_options import TableOptions

__all__ = [
    'Table',
    'TableOptions',
    'quoted',
    'read_contacts',
    'read_table',
    'write_touches',
]
