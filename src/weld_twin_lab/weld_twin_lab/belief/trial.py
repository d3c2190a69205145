# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Cases drawn, one of them diagnosed and held against its truth, in plain values.

Of the mixes of cases that belief is learned from the usual one has the robots, causes, sizes and
motions of the blind check, with a quarter of the cases outside the library or withheld from it; a
third of the motions is poor. The other has cells with one to six causes at once, as real cells have
them: every number is equally often, and in a fifth of the cases the family of one cause is taken
out of the library. The third has arms that are off by a little everywhere, as every arm is, mostly
at stations, with none to two causes besides. The fourth has such arms with something besides that
the library lacks, as every real arm has. The plant's statics are true: a spring settles where it
balances the load.
"""

from __future__ import annotations

import gzip
import json
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.diagnosis import Diagnosis, diagnose
from weld_twin_core.diagnosis.algebra.problem import Model
from weld_twin_core.diagnosis.evidence import Alternative, Evidence
from weld_twin_core.effects.registry import effects_from_list
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.files.whole_files import write_bytes

from ..blind import seal
from ..blind.blind_cell import WAYS, Take, as_recording, floor, poorer, record
from ..blind.cause_sizes import (
    CONSTRUCTIONS,
    FAMILIES,
    MOVING,
    OUTSIDE,
    Cause,
    rough_gears,
    site,
    uneven_errors,
)
from ..blind.making import KINDS, ROBOTS, Deck, Lot, SealedCase, draw_case, lots, truth_of
from ..blind.scoring import counted, gap_on, nominal_on, rms
from ..study import engine_digest
from .judged import FEW, shown, there

USUAL, SEVERAL, EVERYWHERE, FOREIGN = 'usual', 'several', 'everywhere', 'foreign'
"""Mixes of cases."""
SHARES = {**KINDS, 'outside': 6, 'withheld': 6}
"""Of 44 usual cases, how many are of each kind."""
POOR = ('', '', '', '', '', '', '', '', *WAYS)
"""How their motions are made poor: one in three; 'few' changes stations alone."""
SPANS = (15.0, 45.0)
"""Length [s] of a recording, drawn between these."""
MOST = 6
"""Causes of one of several at the most."""
COMMON = (
    'joint_offset',
    'link_length',
    'link_offset',
    'link_twist',
    'axis_parallelism',
    'backlash',
    'joint_compliance',
    'gear_ratio',
    'transmission_ripple',
)
"""Families that most arms have something of; each comes `OFTEN` times as often as any other."""
OFTEN = 5
"""Cards of a common family in the deck for one of any other. A judgement: most cells have some."""
MOTIONS = ('stations', 'stations', 'seams', 'both')
CROWDED = ('stations', 'both')
"""Motions of cases with five and six causes: stations, 40 at least, that could tell them."""
STRATA = (1, 1, 2, 2, 2, 3)
"""Numbers of the strata of `blind.making`, dealt like cards: 1 to 40 times the noise."""
ALIGN = (('base', 'tool'), ('base', 'tool'), ('base', 'tool'), ('base',), ())
"""Frames to be fitted: both in most cells, as nobody knows them."""
NOISE = (2e-5, 8e-5)
"""RMS length of the noise [m], drawn between these with even logarithms."""
WITHHELD = 5
"""One case of so many has a family taken out."""
HELD_OUT = 3
"""One case of so many brings a held-out recording; of stations it has few."""


PART = (0.05, 1.0)
"""Small errors of an arm that is off everywhere, in parts of what machines have; even logarithms."""
AT_REST = 0.7
"""Share of these arms that are measured at stations."""


class Drawn(NamedTuple):
    """A case, how its motion was made poor, and whether its held-out recording is given."""

    case: SealedCase
    poor: str = ''
    held_out: bool = True
    small: tuple[Cause, ...] = ()
    """Small errors everywhere, besides its causes."""


def drawn(seed: int, number: int, mix: str = USUAL) -> Drawn:
    """Return case ``number`` of a seed and a mix; raises DataError where no motion shows its causes."""
    if mix == SEVERAL:
        return _of_several(seed, number)
    if mix == EVERYWHERE:
        return _off_everywhere(number, np.random.default_rng([seed, 4000 + number]))
    if mix == FOREIGN:
        return _with_foreign(seed, number)
    lot = mixed(seed, number + 1)[number]
    poor = Deck(POOR, seed, 60).nth(number)
    if 'equal lag' in lot.families or (poor == 'few' and lot.motion != 'stations'):
        poor = ''
    rng = np.random.default_rng([seed, 2000 + number])
    return Drawn(draw_case(lot, rng, SPANS, poor), poor)


def mixed(seed: int, count: int) -> list[Lot]:
    """Return what the first usual cases of a seed are to be, in the shares of the mix."""
    return lots(seed, count, constructions=tuple(CONSTRUCTIONS), shares=SHARES)


def _of_several(seed: int, number: int) -> Drawn:
    rng = np.random.default_rng([seed, 3000 + number])
    lot = lot_of(seed, number, rng)
    case = draw_case(lot, rng, SPANS)
    holdout = poorer(case.holdout, 'few', rng)
    if lot.kind == 'withheld':
        case = replace(case, excluded=(str(rng.choice(lot.families)),))
    given = number % HELD_OUT == HELD_OUT - 1 and not case.also
    return Drawn(replace(case, holdout=holdout), held_out=given)


def _with_foreign(seed: int, number: int) -> Drawn:
    """Return an arm that is off everywhere beside what no name explains, by turns of three ways."""
    rng = np.random.default_rng([seed, 5000 + number])
    if number % 3 == 0:
        still = [name for name in OUTSIDE if name not in MOVING]
        return _off_everywhere(number, rng, (str(rng.choice(still)),))
    out = _off_everywhere(number, rng)
    if number % 3 == 1:
        withheld = str(rng.choice(sorted({own['effect'] for own in out.small})))
        return out._replace(case=replace(out.case, excluded=(withheld,)))
    return out._replace(small=(*out.small, *rough_gears(out.case.cell.robot, rng)))


def _off_everywhere(number: int, rng: np.random.Generator, foreign: tuple[str, ...] = ()) -> Drawn:
    align = ALIGN[int(rng.integers(len(ALIGN)))]
    cards = [name for name in COMMON if name not in {f'{frame}_pose' for frame in align}]
    own = map(str, rng.choice(cards, int(rng.integers(3)), replace=False))
    causes = (*own, *foreign)
    lot = Lot(
        'several' if causes else 'none',
        ROBOTS[number % len(ROBOTS)],
        'stations' if rng.random() < AT_REST else 'free',
        causes,
        tuple(int(rng.choice(STRATA)) for _ in causes),
        align,
        float(np.exp(rng.uniform(*np.log(NOISE)))),
    )
    case = draw_case(lot, rng, SPANS)
    there = {site(cause) for cause in case.causes}
    part = float(np.exp(rng.uniform(*np.log(PART))))
    small = [own for own in uneven_errors(case.cell.robot, rng, part) if site(own) not in there]
    return Drawn(case, held_out=False, small=tuple(small))


def lot_of(seed: int, number: int, rng: np.random.Generator) -> Lot:
    """Return what a case of the mix of several is to be."""
    count = 1 + number % MOST
    crowded = count >= MOST - 1
    motion = str(rng.choice(CROWDED if crowded else MOTIONS))
    align = ALIGN[int(rng.integers(len(ALIGN)))]
    fitted = {f'{frame}_pose' for frame in align}
    still = MOVING if motion in CROWDED else frozenset()
    cards = [name for name in (*COMMON * (OFTEN - 1), *FAMILIES) if name not in still | fitted]
    families = _families(cards, count, rng)
    withheld = (number // MOST) % WITHHELD == WITHHELD - 1
    return Lot(
        'withheld' if withheld else 'several',
        Deck(ROBOTS, seed, 71).nth(number),
        motion,
        families,
        tuple(int(rng.choice(STRATA)) for _ in range(count)),
        align,
        float(np.exp(rng.uniform(*np.log(NOISE)))),
    )


def _families(cards: Sequence[str], count: int, rng: np.random.Generator) -> tuple[str, ...]:
    """Return families; a common one may come twice, at two joints."""
    out: list[str] = []
    while len(out) < count:
        card = str(rng.choice(cards))
        if card in COMMON or card not in out:
            out.append(card)
    return tuple(out)


DIGITS = 4
"""Significant digits that are kept."""


def rounded(value: Any) -> Any:
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
    return [case.recorded(seal.TRAIN), *also]


def diagnosed(
    case: SealedCase, recordings: Sequence[Recording], *, held_out: bool = False
) -> Diagnosis:
    cell = case.cell
    return diagnose(
        recordings,
        cell.robot,
        align=frozenset(cell.align),
        known=effects_from_list([dict(item) for item in cell.known], cell.robot),
        exclude=case.excluded,
        holdout=[case.recorded(seal.HOLDOUT)] if held_out else [],
        experiment=False,
    )


def _sealed(case: SealedCase, truth: dict[str, Any], diagnosis: Diagnosis) -> dict[str, Any]:
    """Return what is left on the recording that the diagnosis never saw, RMS [m]."""
    if diagnosis.status == 'unsound':
        return {}
    test, cell = case.recorded(seal.TEST), case.cell
    good = counted(test, truth['outliers'])
    bare = nominal_on(cell.robot, diagnosis.model.known, case.recorded(seal.TRAIN), cell.align)

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
    by_site = {r.site: r for each in diagnosis.evidence.candidate_sets for r in each}

    def member(r: Alternative) -> dict[str, Any]:
        own = replace(r.fit.model, bases=r.fit.model.bases[:1], known=diagnosis.model.known)
        return {'effect': r.site.effect, 'joint': r.site.joint, 'left': remaining(own)}

    return [
        [member(by_site[site]) for site in group if site in by_site]
        for group in diagnosis.indistinguishable
    ]
