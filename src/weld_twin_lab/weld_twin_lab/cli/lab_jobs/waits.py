# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What people wait for: whole commands started cold, beside those of another checkout.

Runs each command here and there in turn. Ratios of pairs count: the machine's own speed drifts.
Writes waits.json and waits.md. With --only, the other rows of a waits.json in --out stay as they
are; every row says when and with which versions it was measured.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from ...study import Study, options, study

if TYPE_CHECKING:
    from ...benchmark.waiting import Entry

OPTIONS = options("""
--base DIR       another checkout, after make setup; left out, only this
--runs N         pairs of runs [default: 3]
--only TEXT ...  jobs whose name has one of these
""")


@study
def run(study: Study) -> None:
    """Measure all jobs and print the table."""
    from tempfile import TemporaryDirectory

    from ...benchmark.waiting import measured, merged, page, summary

    args = study.args
    kept = _kept(study.out / 'waits.json') if args.only else []
    base = Path(args.base) if args.base else None

    def keep(entry: Entry) -> None:
        nonlocal kept
        study.tell(f'{entry["job"]}: {entry}')
        kept = merged(kept, [entry])
        study.write('waits', kept, page(kept), say=False)

    with TemporaryDirectory() as folder:
        measured(base, Path(folder), max(args.runs, 1), args.only, keep)
    print(summary(kept))


def _kept(file: Path) -> list[Entry]:
    """Return the rows that were measured before; none where there are none."""
    from weld_twin_core.errors import DataError

    if not file.exists():
        return []
    try:
        entries: list[Entry] = json.loads(file.read_text(encoding='utf-8'))
    except ValueError:
        raise DataError(f"'{file}' is damaged; remove it to measure all jobs anew") from None
    return entries
