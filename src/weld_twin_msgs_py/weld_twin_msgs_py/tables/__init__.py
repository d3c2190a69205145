# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables of joint angles and measured positions or poses, as laboratories leave them."""

from .build import Table, read_table
from .contacts import quoted, read_contacts, write_touches
from .table_options import TableOptions
from .two_tables import read_two_tables

<<<<<<< HEAD
__all__ = ['Table', 'TableOptions', 'read_contacts', 'read_table', 'read_two_tables']
=======
__all__ = [
    'Table',
    'TableOptions',
    'quoted',
    'read_contacts',
    'read_table',
    'write_touches',
]
>>>>>>> d580c11 (Touches: the next ones are proposed as postures in reach; from two places a fit is taken that carries over to a third; the uncertainty told with a touch counts)
