# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables of joint angles and measured positions or poses, as laboratories leave them."""

from .build import Table, read_table
from .contacts import read_contacts
from .table_options import TableOptions

__all__ = ['Table', 'TableOptions', 'read_contacts', 'read_table']
