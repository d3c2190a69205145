# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A traceback as results keep it."""

from __future__ import annotations

import re
import traceback

_BEFORE = re.compile(r'(?<=File ").*?(?=(?:weld_twin_\w+|site-packages)/)')
"""What stands before a package in the path of its file: of this machine alone."""


def traceback_told() -> str:
    """Return the traceback of the exception being handled, files as from their package on."""
    return _BEFORE.sub('', traceback.format_exc())
