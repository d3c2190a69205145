# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Sealed cells one after the other, each kept as soon as it is done."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from weld_twin_core import __version__
from weld_twin_core.errors import TwinError
from weld_twin_msgs_py.files.whole_files import write_text

from ..blind.deck import Lot, lots
from .goals import page, summary

RESULTS, TABLE, PARTS = 'investigate.json', 'investigate.md', 'parts'
SCHEMA = 'weld_twin/investigate/1'
KINDS = ('single', 'double', 'triple')
"""Cases with their causes in the library: of the others no experiment can make anybody sure."""
MOST_DRAWN = 40
"""Cells drawn for each that is wanted: most are diagnosed rightly from a poor motion."""
Tell = Callable[[str], None]


def study(
    out: Path,
    seed: int,
    wanted: int,
    tell: Tell = lambda text: None,
    *,
    alone: bool = False,
) -> dict[str, Any]:
    """
    Investigate sealed cells that poor motions leave open, and write the results.

    Parameters
    ----------
    out : Path
        Keeps a file for every cell drawn; a run that was interrupted goes on from there.
    seed : int
        Decides the cells.
    wanted : int
        Cells that poor motions leave open.
    tell : callable
        Told what is being done.
    alone : bool
        Leave out what is usual practice; a later run without this word adds it.

    """
    (out / PARTS).mkdir(parents=True, exist_ok=True)
    cases: list[dict[str, Any]] = []
    drawn = 0
    for number, lot in enumerate(lots(seed, MOST_DRAWN * wanted, KINDS)):
        if len(cases) == wanted:
            break
        drawn += 1
        entry = _kept(out, seed, number, lot, tell)
        if not entry['open']:
            continue
        cases.append({**entry, **_beside(out, seed, number, lot, entry, alone=alone)})
    result = {
        'schema': SCHEMA,
        'version': __version__,
        'seed': seed,
        'drawn': drawn,
        'summary': summary(cases),
        'cases': cases,
    }
    write_text(out / RESULTS, json.dumps(result, indent=1) + '\n', overwrite=True)
    write_text(out / TABLE, page(result), overwrite=True)
    return result


def _kept(out: Path, seed: int, number: int, lot: Lot, tell: Tell) -> dict[str, Any]:
    path = out / PARTS / f'{seed}-{number:04d}.json'
    if not path.exists():
        entry = _investigated(lot, seed, number)
        tell(f'{number}: {entry.get("end", "not open")}')
        write_text(path, json.dumps(entry, indent=1) + '\n')
    kept: dict[str, Any] = json.loads(path.read_text(encoding='utf-8'))
    return kept


def _beside(
    out: Path, seed: int, number: int, lot: Lot, entry: dict[str, Any], *, alone: bool
) -> dict[str, Any]:
    """Return what usual practice leads to, kept in a file of its own; empty where it was left out."""
    path = out / PARTS / f'{seed}-{number:04d}-beside.json'
    if not path.exists():
        if alone:
            return {}
        from ..blind.simulator import require_simulator

        require_simulator()
        from .sealed_cell import SealedCell
        from .trial import beside

        told = beside(SealedCell(lot, seed, number), entry)
        write_text(path, json.dumps(told, indent=1) + '\n')
    kept: dict[str, Any] = json.loads(path.read_text(encoding='utf-8'))
    return kept


def _investigated(lot: Lot, seed: int, number: int) -> dict[str, Any]:
    """Return what came of one cell; the simulator is loaded where it is needed."""
    from ..blind.simulator import require_simulator

    require_simulator()
    from .sealed_cell import SealedCell
    from .trial import looped, poor_at_first

    try:
        cell = SealedCell(lot, seed, number)
    except TwinError as error:
        return {'open': False, 'why': str(error)}
    first = poor_at_first(cell)
    if first is None:
        return {'open': False, 'why': 'right from the first'}
    return {'open': True, **looped(cell, *first)}
