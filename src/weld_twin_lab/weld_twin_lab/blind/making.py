# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Make sealed cases: recordings for whoever diagnoses, truths apart.

Which case is of which kind shuffled decks say, so that every kind, family and stratum has its
share. Case number i depends on the seed and on i alone; asking for more cases extends the same
list.
"""

from __future__ import annotations

import secrets
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.twin.features import Features
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.bags import write_recording
from weld_twin_msgs_py.files.whole_files import write_text
from weld_twin_msgs_py.files.yaml_file import yaml_text
from weld_twin_msgs_py.robots import write_robot_yaml
from weld_twin_nodes.offline.output_directory import new_directory
from weld_twin_nodes.offline.task_pool import Runner, Task

from ..plant.lost_motion import FLANK_TORQUE
from ..plant.tracker import Tracker
from . import seal
from .blind_cell import (
    SPANS,
    BlindCell,
    Take,
    again,
    as_recording,
    deviation,
    draw_cell,
    fitted_out,
    floor,
    poorer,
    record,
    take,
)
from .cause_sizes import (
    CONSTRUCTIONS,
    FAMILIES,
    MOVING,
    OUTSIDE,
    Cause,
    construct,
    draw,
    plausible,
    scaled,
    site,
)
from .scoring import correlation, rms

Card = TypeVar('Card')

KINDS = {
    'single': 16,
    'double': 6,
    'triple': 3,
    'none': 4,
    'outside': 4,
    'withheld': 4,
    'ambiguous': 3,
}
"""Kinds of cases, and how many of 40 are of each."""
STRATA = ((0.3, 1.0), (1.0, 3.0), (3.0, 10.0), (10.0, 40.0))
"""Effect RMS over measurement noise."""
_STRATUM = dict.fromkeys(KINDS, (1, 2, 2, 3)) | {'single': (0, 1, 1, 2, 2, 3), 'none': (0,)}
"""Number of the stratum of each case of a kind, dealt like cards, each as often as it stands here."""
_COUNT = {'double': 2, 'triple': 3, 'none': 0}
"""Causes of a case; one where the kind is not named."""
ROBOTS = (
    'ur5',
    'ur10',
    'kuka_kr6_r900',
    'abb_irb120',
    'abb_irb1600',
    'fanuc_m10ia',
    'franka_panda',
)
MOTIONS = ('seams', 'free', 'free', 'stations')


@dataclass(frozen=True)
class Lot:
    kind: str
    robot: str
    motion: str
    families: tuple[str, ...]
    """Of the causes; the construction where the kind is 'ambiguous'."""
    strata: tuple[int, ...]
    """Which of `STRATA` each cause is to be in."""
    align: tuple[str, ...] | None = None
    """Frames that the diagnosis is to fit; drawn with the cell where left out."""
    noise_m: float | None = None
    """RMS length of the measurement noise [m]; drawn with the cell where left out."""


def lots(
    seed: int,
    count: int,
    kinds: Sequence[str] = (),
    constructions: Sequence[str] = ('',),
    shares: Mapping[str, int] = KINDS,
) -> list[Lot]:
    """Return what the first cases of a seed are to be; raises DataError of another kind, or of none."""
    for kind in kinds:
        if kind not in KINDS:
            raise DataError(f'there are no cases of kind {kind!r}; kinds are ' + ', '.join(KINDS))
    if count < 1 or seed < 0:
        raise DataError('the number of cases must be at least 1 and the seed not negative')
    chosen = {kind: shares[kind] for kind in (kinds or shares)}
    table = {'outside': OUTSIDE, 'ambiguous': tuple(constructions)}
    pattern = [kind for kind, share in chosen.items() for _ in range(share)]
    decks = {kind: Deck(table.get(kind, FAMILIES), seed, k) for k, kind in enumerate(KINDS)}
    strata = {kind: Deck(_STRATUM[kind], seed, 20 + k) for k, kind in enumerate(KINDS)}
    order, robots = Deck(pattern, seed, 50), Deck(ROBOTS, seed, 51)
    motions = Deck(MOTIONS, seed, 52)
    out = []
    for _ in range(count):
        kind = order.next()
        number = _COUNT.get(kind, 1)
        out.append(
            Lot(
                kind,
                robots.next(),
                motions.next(),
                decks[kind].several(number),
                tuple(strata[kind].next() for _ in range(number)),
            )
        )
    return out


class Deck(Generic[Card]):
    """Cards dealt in a random order, all of them before any comes again."""

    def __init__(self, cards: Sequence[Card], seed: int, number: int) -> None:
        self._cards = list(cards)
        self._rng = np.random.default_rng([seed, number])
        self._left: list[Card] = []

    def next(self) -> Card:
        if not self._left:
            self._left = [self._cards[k] for k in self._rng.permutation(len(self._cards))]
        return self._left.pop()

    def nth(self, number: int) -> Card:
        """Return the card dealt after so many others."""
        return [self.next() for _ in range(number + 1)][number]

    def several(self, count: int) -> tuple[Card, ...]:
        out: list[Card] = []
        while len(out) < count:
            card = self.next()
            if card not in out:
                out.append(card)
        return tuple(out)


SIZINGS = 6
"""Sizes and places drawn for one cause before another cell is drawn."""
ALIKE = 0.95
"""Correlation of two deviations from which they are one to whoever measures."""
NEAR = 1.15
"""A size is right when it is wrong by no more than this factor."""


class NotVisible(Exception):
    """No plausible cause of the family is as large as wanted on this motion."""


def sized(
    cell: BlindCell, causes: Sequence[Cause], taken: Take, wanted: float
) -> tuple[list[Cause], Array]:
    """Return causes grown together to so many times the noise, and their deviation; or NotVisible."""
    factor = 1.0
    for _ in range(4):
        grown = [scaled(cause, factor) for cause in causes]
        off = deviation(cell, grown, taken)
        ratio = rms(off) / cell.noise
        if 1.0 / NEAR < ratio / wanted < NEAR:
            break
        factor *= wanted / max(ratio, 1e-9)
        if not all(plausible(cell.robot, cause, factor) for cause in causes):
            names = ', '.join(cause['effect'] for cause in causes)
            raise NotVisible(f'{names} is {ratio:.3g} times the noise, wanted {wanted:.3g}')
    return grown, off


def drawn_size(stratum: tuple[float, float], rng: np.random.Generator) -> float:
    """Return how many times the noise a cause of a stratum of `STRATA` is to be."""
    return float(np.exp(rng.uniform(*np.log(stratum))))


def draw_causes(
    cell: BlindCell,
    families: Sequence[str],
    strata: Sequence[int],
    taken: Take,
    rng: np.random.Generator,
) -> tuple[list[Cause], list[float]]:
    """Return causes of the families, and how many times the noise each is; raises NotVisible."""
    causes: list[Cause] = []
    offs: list[Array] = []
    for family, stratum in zip(families, strata, strict=True):
        cause, off = _one(cell, family, STRATA[stratum], taken, offs, rng)
        if site(cause) in map(site, causes):
            raise NotVisible(f'{family} twice at one place')
        causes.append(cause)
        offs.append(off)
    return causes, [rms(off) / cell.noise for off in offs]


def _one(
    cell: BlindCell,
    family: str,
    stratum: tuple[float, float],
    taken: Take,
    others: Sequence[Array],
    rng: np.random.Generator,
) -> tuple[Cause, Array]:
    if taken.command.static and family in MOVING:
        raise NotVisible(f'{family} shows in motion only')
    span = float(taken.command.t[-1] - taken.command.t[0])
    reason = NotVisible(family)
    for _ in range(SIZINGS):
        wanted = drawn_size(stratum, rng)
        try:
            (cause,), off = sized(cell, [draw(family, cell.robot, span, rng)], taken, wanted)
        except NotVisible as error:
            reason = error
            continue
        if all(correlation(off, other) < ALIKE for other in others):
            return cause, off
        reason = NotVisible(f'{family} moves the tool as another cause does')
    raise reason


TRIES = 30
"""
Cells and motions drawn for a case before it is given up; causes that cannot show need another.
"""
MOTIONS_OF = {'both': ('stations', 'seams')}
"""Motions of the recordings of a case, where there are several."""
NO_LOAD = 1e-6
"""Load [N m, N] below which it is that of rounding."""
DECOY = 0.1
"""Share of cases with their causes in the library from which another family is taken out."""


@dataclass(frozen=True, eq=False)
class SealedCase:
    lot: Lot
    cell: BlindCell
    causes: list[Cause]
    alike: list[list[tuple[str, str | None]]]
    """Answers as right as the truth."""
    ratios: list[float]
    """Deviation of every cause over the noise, each alone."""
    excluded: tuple[str, ...]
    """Families taken out of the library."""
    train: Take
    holdout: Take
    test: Take
    fresh: bool
    """Whether hold-out and test are other motions than the training's."""
    also: tuple[Take, ...] = ()
    """Further recordings to be diagnosed with the training's."""

    def recorded(self, use: str, tracker: Tracker | None = None) -> Recording:
        """Return the recording for a use, 'train', 'holdout' or 'test', by its instrument or another."""
        return as_recording(use, record(self.cell, self.causes, getattr(self, use), tracker))

    def told(self, name: str) -> dict[str, Any]:
        """Return what it is judged by, in plain values."""
        return {
            'name': name,
            'kind': self.lot.kind,
            'robot': self.lot.robot,
            'motion': self.lot.motion,
            'causes': self.causes,
            'sites': [site(cause) for cause in self.causes],
            'alike': self.alike,
            'ratios': self.ratios,
        }


def make(
    cases: Path,
    truths: Path,
    seed: int,
    count: int,
    runner: Runner,
    kinds: Sequence[str] = (),
    spans: tuple[float, float] = SPANS,
) -> str:
    """
    Make cases and truths, and return the seal; what the same request made already stays.

    Raises DataError: the directories hold other cases, or the numbers make no sense.
    """
    asked = {'seed': seed, 'count': count, 'kinds': list(kinds), 'seconds': list(spans)}
    _refuse_other(cases, truths, asked)
    if (cases / seal.CASES).exists():
        return str(seal.read(cases / seal.CASES)['seal'])
    drawn = lots(seed, count, kinds, tuple(CONSTRUCTIONS))
    truths.mkdir(parents=True, exist_ok=True)
    seal.write(truths / seal.TRUTHS, asked, overwrite=True)
    tasks = [
        Task(make_case, (seed, k, lot, str(cases), str(truths), spans), f'case {k + 1}')
        for k, lot in enumerate(drawn)
    ]
    entries = runner.run(tasks)
    sealed = seal.seal_of(entries)
    seal.write(cases / seal.CASES, {'seal': sealed, 'cases': entries}, overwrite=True)
    seal.make_private(truths)
    return sealed


def _refuse_other(cases: Path, truths: Path, asked: dict[str, Any]) -> None:
    if cases.resolve() == truths.resolve():
        raise DataError('cases and truths must go to different directories')
    if (truths / seal.TRUTHS).exists():
        existing = seal.read(truths / seal.TRUTHS)
        if any(existing.get(key) != value for key, value in asked.items()):
            raise DataError(
                f"'{truths}' holds the truths of other cases, of seed {existing['seed']}; choose "
                'another place'
            )
    elif (cases / seal.CASES).exists():
        raise DataError(f"'{cases}' holds cases already; choose another place")


def make_case(
    seed: int, number: int, lot: Lot, cases: str, truths: str, spans: tuple[float, float]
) -> dict[str, str]:
    """Write one case and its truth; return its name and the hashes of both."""
    rng = np.random.default_rng([seed, 1000 + number])
    name = f'case_{number + 1:04d}'
    for _ in range(TRIES):
        case = draw_case(lot, rng, spans)
        with suppress(FloatingPointError):
            return _written(case, name, Path(cases), Path(truths))
    raise DataError(f'the simulator cannot move any {name} of {", ".join(lot.families)}')


def _written(case: SealedCase, name: str, cases: Path, truths: Path) -> dict[str, str]:
    with new_directory(cases / name, mark=seal.CASE) as place:
        write_case(place, name, case)
    with new_directory(truths / name, mark=seal.TRUTH) as place:
        write_truth(place, name, case)
    return {'name': name, 'case': seal.digest(cases / name), 'truth': seal.digest(truths / name)}


def draw_case(
    lot: Lot, rng: np.random.Generator, spans: tuple[float, float] = SPANS, poor: str = ''
) -> SealedCase:
    """
    Return a case that shows its causes as large as the lot wants them, or a DataError.

    poor: how the motion diagnosed is made poor, as `blind_cell.poorer` takes it.
    """
    reason: Exception = NotVisible(lot.kind)
    for attempt in range(TRIES):
        try:
            return _attempt(_eased(lot, attempt), rng, spans, poor)
        except (NotVisible, FloatingPointError) as error:
            reason = error
    raise DataError(f'no case of {", ".join(lot.families)} on {lot.robot} came about: {reason}')


def _eased(lot: Lot, attempt: int) -> Lot:
    """Return the lot with what cannot be: at rest nothing lags; later, any stratum will do."""
    motion = lot.motion
    if motion == 'stations' and (MOVING & set(lot.families) or 'equal lag' in lot.families):
        motion = 'free'
    shift = attempt // 6
    strata = tuple((k + shift) % len(STRATA) for k in lot.strata)
    return replace(lot, motion=motion, strata=strata)


def _attempt(
    lot: Lot, rng: np.random.Generator, spans: tuple[float, float], poor: str
) -> SealedCase:
    drawn = draw_cell(lot.robot, lot.motion, lot.families, rng)
    cell = fitted_out(drawn, lot.align, lot.noise_m)
    span = float(rng.uniform(*spans))
    first, *others = MOTIONS_OF.get(lot.motion, (lot.motion,))
    train = poorer(take(cell, first, span, rng), poor, rng)
    causes, alike, ratios = _causes(lot, cell, train, span, rng)
    fresh = bool(rng.random() < 0.5)
    holdout, test = (
        take(cell, first, span, rng) if fresh else again(train, rng) for _ in range(2)
    )
    excluded = _excluded(lot, rng)
    also = tuple(take(cell, other, span, rng) for other in others)
    return SealedCase(
        lot, cell, causes, alike, ratios, excluded, train, holdout, test, fresh, also
    )


def _causes(
    lot: Lot, cell: BlindCell, train: Take, span: float, rng: np.random.Generator
) -> tuple[list[Cause], list[list[tuple[str, str | None]]], list[float]]:
    if lot.kind == 'none':
        return [], [], []
    if lot.kind != 'ambiguous':
        causes, ratios = draw_causes(cell, lot.families, lot.strata, train, rng)
        return causes, [], ratios
    built = construct(lot.families[0], cell.robot, span, rng)
    if 'base' in cell.align and any(c['effect'] == 'base_pose' for c in built.causes):
        raise NotVisible('an aligned base hides what the base does')
    causes, off = sized(cell, built.causes, train, drawn_size(STRATA[lot.strata[0]], rng))
    return causes, built.alike, [rms(off) / cell.noise]


def _excluded(lot: Lot, rng: np.random.Generator) -> tuple[str, ...]:
    """Return the families taken out: the cause's own, or a decoy that means nothing."""
    if lot.kind == 'withheld':
        return lot.families
    others = [name for name in FAMILIES if name not in lot.families]
    if lot.kind in ('single', 'double', 'none') and rng.random() < DECOY:
        return (str(rng.choice(others)),)
    return ()


def one_arm(case: SealedCase) -> SealedCase:
    """
    Return the case with the friction of a gear, and the place of a hose, alike in every recording.

    Where they are not given, the plant has the one as a share of a recording's largest load, and the
    other by its range. Where there is no load at all, rounding would decide on which flank
    the gear lies.

    Raises DataError: a joint with such play carries nothing.
    """
    robot, command = case.cell.robot, case.train.command
    moved = Recording('first', JointMotion(command.t, command.q, static=command.static))
    shift = Features(Twin(robot), moved, command.t).view.shift
    causes = []
    for cause in case.causes:
        if cause['effect'] == 'loaded_play':
            most = float(np.abs(shift['tau', robot.index(str(cause['joint']))]).max())
            if most < NO_LOAD:
                raise DataError(f'{cause["joint"]} carries nothing, so no load moves its play')
            cause = {**cause, 'torque': FLANK_TORQUE * most}
        elif cause['effect'] == 'dress_pack':
            own = command.q[:, robot.index(str(cause['joint']))]
            cause = {**cause, 'middle': float(own.mean()), 'reach': float(np.ptp(own)) / 2.0}
        causes.append(cause)
    return replace(case, causes=causes)


def write_case(place: Path, name: str, case: SealedCase) -> None:
    """Write what whoever diagnoses may see."""
    cell = case.cell
    write_robot_yaml(place / seal.ROBOT, cell.robot)
    if cell.known:
        write_text(place / seal.KNOWN, yaml_text([dict(item) for item in cell.known]))
    for use in (seal.TRAIN, seal.HOLDOUT):
        write_recording(place / use, case.recorded(use), cell.robot)
    about: dict[str, Any] = {'name': name, 'align': [*cell.align], 'exclude': [*case.excluded]}
    seal.write(place / seal.CASE, {**about, 'known': bool(cell.known)})


def write_truth(place: Path, name: str, case: SealedCase) -> None:
    """Write what is sealed: the causes, and the recording that no diagnosis sees."""
    write_recording(place / seal.TEST, case.recorded(seal.TEST), case.cell.robot)
    seal.write(place / seal.TRUTH, {'salt': secrets.token_hex(16), **truth_of(name, case)})


def truth_of(name: str, case: SealedCase) -> dict[str, Any]:
    """Return the truth of a case in plain values."""
    cell = case.cell
    reachable, outliers = floor(cell, case.causes, case.test)
    every = rms(deviation(cell, case.causes, case.train)) / cell.noise if case.causes else 0.0
    return {
        **case.told(name),
        'construction': case.lot.families[0] if case.alike else None,
        'ratio': every,
        'excluded': list(case.excluded),
        'orientation': cell.tracker.orientation,
        'sigma_m': cell.tracker.sigma,
        'richness': cell.richness,
        'align': list(cell.align),
        'test': 'new motion' if case.fresh else 'same motion',
        'floor_m': reachable,
        'outliers': outliers,
    }
