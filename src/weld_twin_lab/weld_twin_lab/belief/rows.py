# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The table of cases: one line of JSON each, so that belief is fitted anew without a diagnosis."""

from __future__ import annotations

import gzip
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.whole_files import write_bytes

DIGITS = 4
"""Significant digits that are kept."""


def rounded(value: Any) -> Any:
    """Return plain values with the digits that are kept."""
    if isinstance(value, float):
        return float(f'{value:.{DIGITS}g}')
    if isinstance(value, Mapping):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(item) for item in value]
    return value


def write_rows(path: Path, rows: Iterable[Mapping[str, Any]]) -> None:
    """Write a table of cases, as `judged.kept` gives them; packed where its name ends in .gz."""
    lines = (json.dumps(rounded(row), separators=(',', ':')) for row in rows)
    text = '\n'.join(lines) + '\n'
    packed = (
        gzip.compress(text.encode('utf-8'), mtime=0) if path.suffix == '.gz' else text.encode()
    )
    write_bytes(path, packed, overwrite=True)


def read_rows(path: Path) -> list[dict[str, Any]]:
    """Return a table of cases; raises DataError where there is no such table."""
    try:
        raw = path.read_bytes()
        text = (gzip.decompress(raw) if path.suffix == '.gz' else raw).decode('utf-8')
        rows = [json.loads(line) for line in text.splitlines() if line]
    except (OSError, EOFError, ValueError) as error:
        raise DataError(f"the table of cases '{path}' cannot be read: {error}") from None
    if not all(isinstance(row, dict) and 'name' in row for row in rows):
        raise DataError(f"'{path}' is no table of cases")
    return rows


def seeds_of(rows: Sequence[Mapping[str, Any]]) -> list[int]:
    """Return the seeds that cases were drawn from; a row of a real arm has none."""
    seeds = {row['name'].partition('/')[0] for row in rows}
    return sorted(int(seed) for seed in seeds if seed.isdecimal())
