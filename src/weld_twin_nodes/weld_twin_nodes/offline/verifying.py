# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Was a promise kept? What was measured after a correction beside what was expected of it.

After a program was corrected, the tool is measured against where the program meant it: where the
controller believes it to be, less what the correction moved the points by there. After the robot
itself was mended, it is measured against the nominal arm, which it should then be. Either way what
is left is compared with what each cause does on this motion: a cause that is still there shows with
its own size, one that went away with none, one that was entered the wrong way round with twice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from weld_twin_core import __version__
from weld_twin_core.arm.rotation import rotation_matrix
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.algebra.fit import robust_scale, stepped, trusted
from weld_twin_core.diagnosis.algebra.independent_rows import effective_share
from weld_twin_core.diagnosis.algebra.noise_floor import noise_floor
from weld_twin_core.diagnosis.algebra.problem import Model, Problem, frames_named, usable
from weld_twin_core.diagnosis.frames.aligned import aligned
from weld_twin_core.diagnosis.result import Site
from weld_twin_core.effects.dated import of_the_robot
from weld_twin_core.errors import DataError, ModelError
from weld_twin_core.recording import Measurements, Recording
from weld_twin_core.twin.twin import Twin

SCHEMA = 'weld_twin/verification/1'
GONE, STAYS = 0.35, 0.65
"""Share of a cause below which it went away, and above which it is still there. Half of it is open:
between the two it went away in part."""
GREW = 1.6
"""Share from which a cause grew: a zero that was entered the wrong way round has twice its size."""
OPEN = 0.25
"""Standard error of such a share from which a recording does not tell."""
WIDE = 1.0
"""Spread of such a share before the recording, about one half: anything from away to twice."""
ALONE = 8
"""Causes listed one by one at most; of more the kinds are listed, as pages have them."""
ROUNDS = 3
"""Times that frames are fitted anew; each leaves a thousandth of what the one before left."""
LEVER = 0.1
"""Metres of tool motion that a radian of turn counts as where places on a way are compared: two
stations at one point differ by how the torch stands."""
NEAR = 2e-3
"""Distance [m] beyond the largest correction up to which a sample belongs to a way."""
ELSEWHERE = 10.0
"""Times the gap of the diagnosis from which the set-up must stand elsewhere."""
NOT_RUN = 0.5
"""Share of the correction by which a motion is off its way, from which it was not the corrected one."""
LEAST_MOVED = 5e-5
"""Correction [m] below which no motion tells whether it was carried out."""
GUARD = 1.645
"""Standard errors of a measured RMS that count for the promise: one in twenty kept promises is called
broken by chance, as ISO 14253-1 has it."""
ASIDE = 1.5
"""Ratio to the promise up to which it counts as kept where no interval was promised."""


class Promise(NamedTuple):
    """An RMS that was promised and the interval it was to lie in [m]; None where there was none."""

    rms: float
    low: float | None
    high: float | None

    def kept(self, rms: float) -> bool:
        """Tell whether an RMS [m] is no more than was promised."""
        return rms <= (ASIDE * self.rms if self.high is None else self.high)


class Measured(NamedTuple):
    """The RMS that was measured [m]."""

    rms: float  # of a program without the instrument's noise
    least: float  # below it the true one lies with five in a hundred only
    noise: float  # what of it is the instrument's

    @classmethod
    def without_noise(cls, rms: float, noise: float, count: float) -> Measured:
        """Return an RMS of independent coordinates without a noise that is as well known as itself."""
        # A mean square of normal numbers; of the noise not more is known than of what it is part of.
        spread = GUARD * float(np.sqrt(2.0 * (rms**4 + noise**4) / max(count, 1.0)))
        square = rms**2 - noise**2
        return cls(
            float(np.sqrt(max(square, 0.0))), float(np.sqrt(max(square - spread, 0.0))), noise
        )


class RemainingCause(NamedTuple):
    """What is left of a cause."""

    sites: tuple[Site, ...]  # one, or all of a kind
    share: float
    std: float  # of the size it had: 0 for gone, 1 for as it was
    rms_m: float  # how far a whole one moves the tool on this motion

    @property
    def state(self) -> str:
        """Return 'gone', 'stays', 'partly', 'grew', 'over' (mended too far) or 'open'."""
        if self.std > OPEN:
            return 'open'
        if self.share < -GONE:
            return 'over'
        if self.share > GREW:
            return 'grew'
        return 'gone' if self.share < GONE else 'stays' if self.share > STAYS else 'partly'


@dataclass(frozen=True, eq=False)
class Verification:
    """What was promised and what was measured."""

    promised: Promise
    measured: Measured  # over the samples that count
    samples: int
    kept: bool
    causes: tuple[RemainingCause, ...]  # what moves the tool most first
    off: Array  # size of what is left at every sample that counts, shape (M,) [m]
    program: str = ''  # name of the program; empty where the robot was mended
    notes: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        low, high = self.promised.low, self.promised.high
        return {
            'schema': SCHEMA,
            'version': __version__,
            'promised': {'rms_m': self.promised.rms, 'interval_m': [low, high]},
            'measured': {
                'rms_m': self.measured.rms,
                'at_least_m': self.measured.least,
                'noise_m': self.measured.noise,
            },
            'samples': self.samples,
            'kept': self.kept,
            'program': self.program or None,
            'causes': [
                {
                    'sites': [{'effect': s.effect, 'joint': s.joint} for s in cause.sites],
                    'left': cause.share,
                    'std': cause.std,
                    'state': cause.state,
                    'rms_m': cause.rms_m,
                }
                for cause in self.causes
            ],
            'notes': list(self.notes),
        }


def _of_diagnosis(content: Mapping[str, Any]) -> tuple[float, float, Promise]:
    """Return the gap that a diagnosis found, its noise, and what is left by its promise [m]."""
    try:
        gap, shrink = content['gap'], content['shrink']
        low, high = (float(end) * float(shrink['rms_before_m']) for end in shrink['ci95'])
        promise = Promise(float(shrink['rms_after_m']), low, high)
        return float(gap['rms_m']), float(gap['noise_floor_m']), promise
    except (KeyError, TypeError, ValueError) as error:
        raise ModelError(
            f'gap or shrink of the diagnosis means nothing ({error}); diagnose again'
        ) from None


def verified(
    content: Mapping[str, Any],  # of the diagnosis
    model: Model,
    recording: Recording,  # measured after the correction
    *,
    correction: Mapping[str, Any] | None = None,  # correction.json, of a program
    align: str = '',  # frames that are fitted anew; the others are as the diagnosis had them
    setup: int = 0,  # which base frame of the diagnosis, counted from 0
) -> Verification:
    """Return what was measured after a correction beside what was promised."""
    seen = _Seen.of(model, recording, align, setup)
    wanted, notes = None, list[str]()
    if correction is not None:
        wanted = _Way(correction, seen)
        notes += wanted.carried_out()
    offs = seen.fitted(wanted)
    share = effective_share(offs.left.ravel(), (3,), (len(offs.left),))
    rms = float(np.sqrt((offs.whole**2).sum(axis=1).mean()))
    before, noise, promise = _of_diagnosis(content)
    _refuse_elsewhere(rms, before, align)
    if wanted is None:
        measured = Measured(rms, rms, noise)
    else:
        promise = _of_program(correction or {})
        own = seen.noise_m(offs.every)
        noise = noise if own is None else own
        measured = Measured.without_noise(rms, noise, share * offs.whole.size)
    return Verification(
        promise,
        measured,
        len(offs.whole),
        promise.kept(measured.least) and not notes,
        offs.causes(seen.units, share),
        np.linalg.norm(offs.whole, axis=1),
        '' if correction is None else str(correction['program']),
        tuple(notes),
    )


def _of_program(correction: Mapping[str, Any]) -> Promise:
    expected = correction['expected']['after']
    if expected is None:
        raise DataError('correction.json promises nothing; correct the program again with --model')
    # Frames are those of the recording, or fitted again: what they take up they take up here, too.
    interval = expected.get('rms_ci90_same_setup_m') or expected['rms_ci90_m']
    low, high = interval or (None, None)
    return Promise(float(expected['rms_m']), low, high)


def _refuse_elsewhere(rms: float, gap: float, align: str) -> None:
    if rms > ELSEWHERE * gap and 'base' not in align:
        raise DataError(
            f'measured and meant are {rms * 1e3:.3g} mm apart, where the diagnosis had {gap * 1e3:.3g} '
            'mm: the instrument or the reflector stands elsewhere; give --align base, or base,tool'
        )


class _Offs(NamedTuple):
    """What is off (N, 3), where that counts (M, 3) [m], and what of it no cause explains."""

    every: Array
    whole: Array
    left: Array
    columns: Array
    shares: Array
    normal: Array

    def causes(
        self, units: Sequence[tuple[Site, ...]], share: float
    ) -> tuple[RemainingCause, ...]:
        """Return what is left of every cause, what moves the tool most first."""
        count = max(share * self.left.size - len(units), 1.0)
        sigma = max(float(np.sqrt((self.left**2).sum() / self.left.size)), 1e-9)
        scale = sigma**2 * self.left.size / count
        spread = np.sqrt(np.diag(np.linalg.inv(self.normal / scale + np.eye(len(self.normal)))))
        sizes = np.sqrt((self.columns**2).sum(axis=2).mean(axis=1))
        out = [
            RemainingCause(sites, float(self.shares[k]), float(spread[k]), float(sizes[k]))
            for k, sites in enumerate(units)
        ]
        return tuple(sorted(out, key=lambda cause: -cause.rms_m))


@dataclass(frozen=True, eq=False)
class _Seen:
    """A recording after a correction with the model, the frames and what each cause does there."""

    problem: Problem
    model: Model
    start: Model
    units: tuple[tuple[Site, ...], ...]

    @classmethod
    def of(cls, model: Model, recording: Recording, align: str, setup: int) -> _Seen:
        if recording.measured is None:
            raise DataError(f'{recording.name} holds no measured poses or points')
        frames = frames_named(align, '--align')
        causes = tuple(
            of_the_robot([e for e in model.found if e.traits.cause and not e.traits.of_setup])
        )
        own = replace(model, bases=(model.bases[setup],), found=causes, changes=(), given=())
        problem = Problem((usable(recording),), frames)
        start = own.with_found(())
        if frames:
            robot = own.robot.with_frames(base=own.bases[0])
            _, near = aligned((recording,), robot, frames, own.known)
            start = replace(start, robot=near.robot, bases=near.bases)
        sites = [Site(effect.name, effect.site) for effect in causes]
        units: list[tuple[Site, ...]] = [(site,) for site in sites]
        if len(sites) > ALONE:
            kinds = dict.fromkeys(site.effect for site in sites)
            units = [tuple(s for s in sites if s.effect == kind) for kind in kinds]
        return cls(problem, own, start, tuple(units))

    @property
    def recording(self) -> Recording:
        return self.problem.recordings[0]

    @property
    def seen(self) -> Measurements:
        seen = self.recording.measured
        assert seen is not None
        return seen

    def points(self, model: Model, without: Sequence[Site] = ()) -> Array:
        """Return where a model has the measured point, with its effects but some, (M, 3) [m]."""
        kept = [e for e in model.found if Site(e.name, e.site) not in without]
        twin = Twin(model.robot.with_frames(base=model.bases[0]), (*model.known, *kept))
        return twin.poses(self.recording, self.seen.t).position

    def fitted(self, way: _Way | None) -> _Offs:
        """Return what is off once frames that are to be fitted are fitted beside the causes."""
        start = self.start
        for _ in range(ROUNDS if self.problem.align else 1):
            whole = replace(start, found=self.model.found)
            every = self.points(whole)
            columns = np.array([every - self.points(whole, unit) for unit in self.units])
            columns = columns.reshape(len(self.units), len(every), 3)
            meant, rows = self._meant(start, way)
            off = self.seen.position - meant
            frames = self._frames(start)
            rows &= trusted(robust_scale(self.problem, [off.T]).weights)[0]
            step, shares, normal = _solved(off[rows], columns[:, rows], frames[:, rows])
            start = stepped(self.problem, start, step)
        if self.problem.align:
            meant, _ = self._meant(start, way)
            off = self.seen.position - meant
        columns = columns[:, rows]
        remaining = off[rows] - np.tensordot(shares, columns, axes=1)
        return _Offs(off, off[rows], remaining, columns, shares, normal)

    def noise_m(self, off: Array) -> float | None:
        """Return the noise that repeats or neighbours show [m], None where there are none."""
        floor = noise_floor(self.problem, [off.T])
        return floor.rms_m if floor.independent else None

    def _meant(self, start: Model, way: _Way | None) -> tuple[Array, NDArray[np.bool_]]:
        nominal = self.points(start)
        if way is None:
            return nominal, np.ones(len(nominal), dtype=bool)
        return way.meant(start, nominal), np.array(way.near)

    def _frames(self, start: Model) -> Array:
        """Return what frames to be fitted do to the points, shape (F, M, 3)."""
        (maker,) = self.problem.features(start)
        names = [
            (name, k) for name in ('base', 'tool') if name in self.problem.align for k in range(6)
        ]
        out = [maker.column(name)[:3].T for name in names]
        return np.array(out).reshape(len(names), self.seen.t.size, 3)


def _solved(off: Array, columns: Array, frames: Array) -> tuple[Array, Array, Array]:
    """Return the step of the frames, the shares of the causes, and their normal matrix."""
    causes = columns.reshape(len(columns), off.size)
    nuisance = frames.reshape(len(frames), off.size)
    target = off.ravel()
    basis = np.linalg.svd(nuisance, full_matrices=False)[2] if len(nuisance) else nuisance
    free = causes - (causes @ basis.T) @ basis if len(nuisance) else causes
    normal = free @ free.T
    noise = float(np.median(np.abs(target - np.median(target))) ** 2) or 1e-18
    shares = np.linalg.solve(
        normal / noise + np.eye(len(normal)) / WIDE**2, free @ target / noise + 0.5 / WIDE**2
    )
    rest = target - shares @ causes
    step = np.linalg.lstsq(nuisance.T, rest, rcond=1e-9)[0] if len(nuisance) else np.zeros(0)
    return step, shares, normal


class _Way:
    """The way of a corrected program, and where on it every measurement was made."""

    def __init__(self, correction: Mapping[str, Any], seen: _Seen) -> None:
        pieces = correction.get('way')
        if not pieces:
            raise DataError(
                'correction.json does not hold the way of the program; correct it again'
            )
        self.name = str(correction['program'])
        self.commanded = np.concatenate([np.array(p['commanded'], dtype=float) for p in pieces])
        meant = np.concatenate([np.array(p['meant'], dtype=float) for p in pieces])
        lengths = [len(p['meant']) for p in pieces]
        self.piece = np.repeat(np.arange(len(pieces)), lengths)
        self.tool = np.array(pieces[0]['tool'], dtype=float)
        if any(np.abs(np.array(p['tool']) - self.tool).max() > 1e-9 for p in pieces):
            raise DataError(f'{self.name} works with several tools; verify its parts one by one')
        self.moved = meant[:, :3] - self.commanded[:, :3]
        self.turned = rotation_matrix(meant[:, 3:]) @ np.swapaxes(
            rotation_matrix(self.commanded[:, 3:]), -1, -2
        )
        bare = seen.start.robot.with_frames(base=np.eye(4), tool=self.tool)
        poses = Twin(bare).poses(seen.recording, seen.seen.t)
        self.rotation, self.position = poses.rotation, poses.position
        self._match()

    def _match(self) -> None:
        """Find the nearest place of the way for every measurement, and what was moved there."""
        own = np.concatenate(
            [self.commanded[:, :3], self._axes(rotation_matrix(self.commanded[:, 3:]))], 1
        )
        here = np.concatenate([self.position, self._axes(self.rotation)], 1)
        nearest = cKDTree(own).query(here)[1]
        best = np.full(len(here), np.inf)
        self.shift, self.turn = np.zeros((len(here), 3)), np.tile(np.eye(3), (len(here), 1, 1))
        for step in (-1, 1):
            other = np.clip(nearest + step, 0, len(own) - 1)
            other = np.where(self.piece[other] == self.piece[nearest], other, nearest)
            line, toward = own[other] - own[nearest], here - own[nearest]
            size = np.maximum((line**2).sum(axis=1), 1e-18)
            along = np.clip((line * toward).sum(axis=1) / size, 0.0, 1.0)[:, None]
            away = np.linalg.norm((toward - along * line)[:, :3], axis=1)
            better = away < best
            moved = (1.0 - along) * self.moved[nearest] + along * self.moved[other]
            self.shift[better], best[better] = moved[better], away[better]
            self.turn[better] = self.turned[nearest][better]
        self.away = best
        self.near = best < float(np.linalg.norm(self.moved, axis=1).max()) + NEAR
        if not self.near.any():
            raise DataError(
                f'no measurement was made on the way of {self.name}: give the recording of the '
                'corrected program, and the robot and frames that it runs with'
            )

    @staticmethod
    def _axes(rotation: Array) -> Array:
        return LEVER * rotation[:, :, :2].reshape(len(rotation), 6)

    def carried_out(self) -> list[str]:
        """Return that the motion was not that of the corrected program; nothing where it was."""
        # Usual ones: moves that lead to the way and from it come near it as well.
        moved = float(np.median(np.linalg.norm(self.shift[self.near], axis=1)))
        off = float(np.median(self.away[self.near]))
        if moved < LEAST_MOVED or off < NOT_RUN * moved:
            return []
        return [
            f'The motion is not that of the corrected {self.name}: it is {off * 1e3:.3f} mm off its '
            f'way, and the correction is {moved * 1e3:.3f} mm. Run the program of the folder that '
            'was given.'
        ]

    def meant(self, start: Model, nominal: Array) -> Array:
        """Return where the measured point was meant to be, shape (M, 3) [m]."""
        base = start.bases[0]
        tip = self.position + self.shift
        # A reflector beside the tool centre point goes along with the tool.
        beside = (np.linalg.inv(self.tool) @ start.robot.T_flange_tool)[:3, 3]
        tip = tip + np.einsum('nij,njk,k->ni', self.turn, self.rotation, beside)
        return np.asarray(tip @ base[:3, :3].T + base[:3, 3])
