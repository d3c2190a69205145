# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One case drawn, diagnosed and held against its truth, in plain values."""

from __future__ import annotations

import gzip
import json
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from weld_twin_core.diagnosis import Diagnosis, diagnose
from weld_twin_core.diagnosis.algebra.problem import Model
from weld_twin_core.diagnosis.evidence import Alternative, Evidence
from weld_twin_core.effects.registry import effects_from_list
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.files.whole_files import write_bytes

from ..blind import seal
from ..blind.blind_cell import Take, as_recording, floor, record
from ..blind.cause_sizes import Cause
from ..blind.displacement import counted, gap_on, nominal_on, rms
from ..blind.making import SealedCase, truth_of
from ..study import engine_digest
from .levels_of_truth import FEW
from .mix import EVERYWHERE, SEVERAL, USUAL, drawn
from .visible import shown, there

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


def tried(seed: int, number: int, mix: str = USUAL) -> dict[str, Any]:
    """Return the row of one case: its truth, what was said of it, and on what evidence."""
    name = f'{seed}/{number}'
    try:
        case, poor, held_out, small = drawn(seed, number, mix)
    except Exception as error:
        return {'name': name, 'error': f'not drawn: {error}'}
    row = {'poor': poor, **row_of(name, case, held_out=held_out, small=small)}
    if not small and (mix == SEVERAL or row['truth']['kind'] in FEW):
        row['truth']['shown'] = shown(case)
    return row


def row_of(
    name: str, case: SealedCase, *, held_out: bool = True, small: Sequence[Cause] = ()
) -> dict[str, Any]:
    """Return the row of a case, with small errors everywhere besides its causes or without."""
    row: dict[str, Any] = {
        'name': name,
        'engine': engine_digest()[:16],
        'truth': truth_of(name, case),
    }
    case = replace(case, causes=[*case.causes, *small])
    start = time.process_time()
    try:
        diagnosis = diagnosed(case, recordings_of(case), held_out=held_out)
    except Exception as error:
        return {**row, 'error': f'{type(error).__name__}: {error}'}
    row['seconds'] = time.process_time() - start
    if small and diagnosis.status != 'unsound':
        row['there'] = there(case, diagnosis)
        row['truth']['kind'] = EVERYWHERE
        row['truth']['floor_m'], row['truth']['outliers'] = floor(
            case.cell, case.causes, case.test
        )
    return {
        **row,
        'error': None,
        **said(diagnosis),
        'sealed': _sealed(case, row['truth'], diagnosis),
    }


def said(diagnosis: Diagnosis) -> dict[str, Any]:
    whole = diagnosis.as_dict()
    return {
        'verdict': whole['verdict'],
        'model': [(e['effect'], e.get('joint')) for e in (whole['model'] or {}).get('found', ())],
        'unsound': [item['kind'] for item in whole['unsound']],
        'statements': [vars(one) for one in diagnosis.statements],
    }


def recordings_of(case: SealedCase, more: Sequence[Take] = ()) -> list[Recording]:
    """Return the recordings of a case that are to be diagnosed, with more of the same truth."""
    also = [
        as_recording(f'{seal.TRAIN}_{k + 2}', record(case.cell, case.causes, taken))
        for k, taken in enumerate((*case.also, *more))
    ]
    return [_recorded(case, seal.TRAIN), *also]


def diagnosed(
    case: SealedCase, recordings: Sequence[Recording], *, held_out: bool = False
) -> Diagnosis:
    """Return the diagnosis of recordings of a case, its held-out recording given or not."""
    cell = case.cell
    return diagnose(
        recordings,
        cell.robot,
        align=frozenset(cell.align),
        known=effects_from_list([dict(item) for item in cell.known], cell.robot),
        exclude=case.excluded,
        holdout=[_recorded(case, seal.HOLDOUT)] if held_out else [],
        experiment=False,
    )


def _recorded(case: SealedCase, use: str) -> Recording:
    taken = {seal.TRAIN: case.train, seal.HOLDOUT: case.holdout, seal.TEST: case.test}[use]
    return as_recording(use, record(case.cell, case.causes, taken))


def _sealed(case: SealedCase, truth: dict[str, Any], diagnosis: Diagnosis) -> dict[str, Any]:
    """Return what is left on the recording that the diagnosis never saw, RMS [m]."""
    if diagnosis.status == 'unsound':
        return {}
    test = _recorded(case, seal.TEST)
    good = counted(test, truth['outliers'])
    cell, train = case.cell, _recorded(case, seal.TRAIN)
    bare = nominal_on(cell.robot, diagnosis.model.known, train, cell.align)

    def remaining(model: Model) -> float:
        return rms(gap_on(model, test)[good])

    return {
        'before': remaining(bare),
        'after': remaining(diagnosis.model),
        'floor': truth['floor_m'],
        'members': _members(diagnosis, remaining),
    }


def _members(diagnosis: Diagnosis, remaining: Any) -> list[list[dict[str, Any]]]:
    """Return what each member of every set leaves in its place, the rest as it is."""
    if not isinstance(diagnosis.evidence, Evidence) or diagnosis.families:
        return []
    by_site = {
        r.site: r for candidate_set in diagnosis.evidence.candidate_sets for r in candidate_set
    }
    out = []
    for group in diagnosis.indistinguishable:
        alternatives: Sequence[Alternative] = [by_site[site] for site in group if site in by_site]
        out.append(
            [
                {
                    'effect': r.site.effect,
                    'joint': r.site.joint,
                    'left': remaining(
                        replace(
                            r.fit.model, bases=r.fit.model.bases[:1], known=diagnosis.model.known
                        )
                    ),
                }
                for r in alternatives
            ]
        )
    return out
