# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables as text that spreadsheets open: a name in them is never a formula."""

import csv
import io
from collections.abc import Iterable, Sequence
from typing import Any

_FORMULA = ('=', '+', '-', '@', '\t', '\r', '\n')
"""A cell that begins so is computed by spreadsheets; a name may come from anybody's file."""
_GUARD = "'"
"""Before such a cell: spreadsheets then show it as it is."""


def csv_text(header: Sequence[Any], rows: Iterable[Sequence[Any]]) -> str:
    """Return a table of texts and numbers as text; floats read back exactly."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator='\n')
    writer.writerow([guarded(cell) for cell in header])
    writer.writerows([guarded(cell) for cell in row] for row in rows)
    return out.getvalue()


def guarded(cell: Any) -> Any:
    """Return a cell that no spreadsheet computes; what is a number stays as it is."""
    if not isinstance(cell, str) or not cell.startswith(_FORMULA) or is_number(cell):
        return cell
    return _GUARD + cell


def unguarded(text: str) -> str:
    """Return a cell as it was before `guarded`."""
    return text[1:] if text.startswith(_GUARD) and text[1:].startswith(_FORMULA) else text


def is_number(text: str) -> bool:
    """Return whether a text is a number as Python reads it."""
    try:
        float(text)
    except ValueError:
        return False
    return True
