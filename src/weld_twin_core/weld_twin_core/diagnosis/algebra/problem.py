# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis problem: recordings, the model believed so far, and residuals in one layout."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ...arm.channels import Shift
from ...arm.robot import Robot
from ...arm.rotation import angle_between, rotation_matrix
from ...arrays import Array, spread_over
from ...contacts import Unknowns, places, unknowns
from ...effects.effect import Effect
from ...errors import DataError, ModelError
from ...pose_noise import Common
from ...recording import Counted, Recording
from ...twin.features import Features, Remembered
from ...twin.twin import Twin
from ..negligible import ROUNDING
from .independent_rows import by_sample, effective_share, visited

FRAMES = ('base', 'tool')
ROWS = 9000
"""Rows on which effects and changes are looked for, and what is left open: more show the same."""
LEVER = 0.5
"""Metres that a radian counts as, where turns and positions are weighed together."""
PLACES = 3
"""Places of contacts from which on each is left out as a whole. Of two, one alone would have to tell
of the other what only both together show."""


def frames_named(align: str | Iterable[str], what: str = 'align') -> frozenset[str]:
    """Return the frames to fit along, of a text or names; ModelError says ``what`` is wrong."""
    parts = align.split(',') if isinstance(align, str) else align
    frames = frozenset(name for part in parts if (name := str(part).strip()))
    for frame in sorted(frames - set(FRAMES)):
        raise ModelError(f'{what} takes base, tool or base,tool; {frame!r} is neither')
    return frames


@dataclass(frozen=True, eq=False)
class Problem:
    """Recordings to explain."""

    recordings: tuple[Recording, ...]
    """Each with measurements inside its joint stream; see `usable`."""
    align: frozenset[str] = field(default_factory=frozenset)
    """Frames fitted as nuisance in every hypothesis: 'base' (one per recording), 'tool'."""
    anchor: Anchor | None = None  # where those frames are believed to be; see `fit.frame_prior`
    dated: tuple[Effect, ...] = ()
    """What may have set in at an instant that was found: hypotheses beside the library's."""
    changes: tuple[Change, ...] = ()
    """What may differ between the recordings: fitted along in every hypothesis, as frames are."""
    touched: tuple[Unknowns | None, ...] = ()
    """What contacts, one recording each, see of the tool point and their unknown places; see
    `touching`. None for a recording of an instrument, empty where it measured all."""
    given: tuple[int, ...] = ()
    """Of which of the recordings given each is a part, if places of contacts are parts; else empty."""
    loose: tuple[float, ...] = ()
    """Noise of every recording in that of the surest; empty where all are alike."""
    _taken: WeakKeyDictionary[Scale, list[tuple[Array, Array] | None]] = field(
        default_factory=WeakKeyDictionary, init=False, repr=False
    )

    @cached_property
    def rows(self) -> tuple[int, ...]:
        """Return the rows per sample of each recording: 6 for poses, 3 for points; contacts differ."""
        seen = (self.contact(k) for k in range(len(self.recordings)))
        return tuple(
            (3 if r.seen.rotation is None else 6) if own is None else own.seen.shape[1]
            for r, own in zip(self.recordings, seen, strict=True)
        )

    @property
    def at_rest(self) -> bool:
        return all(recording.joints.static for recording in self.recordings)

    @cached_property
    def stations(self) -> tuple[NDArray[np.intp] | None, ...]:
        """Return which station every sample of each recording is of; None where each is visited once."""
        out: list[NDArray[np.intp] | None] = []
        for k, recording in enumerate(self.recordings):
            own = None
            if recording.joints.static and self.contact(k) is None and self.samples[k] > 1:
                own = visited(recording.joints.at(recording.seen.t)[0])
            again = own is not None and int(own.max()) + 1 < own.size
            out.append(own if again else None)
        return tuple(out)

    def independent_share(self, residual: Array) -> float:
        """Return the share of a residual that counts as independent rows; see `effective_share`."""
        return effective_share(residual, self.rows, self.samples, self.stations)

    def contact(self, k: int) -> Unknowns | None:
        """Return what the contacts of recording k see; None where an instrument measured."""
        return self.touched[k] if self.touched else None

    @property
    def untracked(self) -> bool:
        """Return whether contacts are all there is: no instrument measured."""
        return bool(self.touched) and all(own is not None for own in self.touched)

    @property
    def places(self) -> int:
        return sum(own is not None for own in self.touched)

    @property
    def placed(self) -> bool:
        each = (r.contacts for r in self.recordings)
        return any(c is not None and c.artefact.known for c in each)

    @cached_property
    def stands(self) -> tuple[tuple[int, ...], ...]:
        """
        Return the recordings of every base that is fitted where ``align`` names 'base'.

        Each recording of an instrument has its own. Contacts at known places share one if they
        were given together; those at unknown places tell nothing of a base.
        """
        if not self.touched:
            return tuple((k,) for k in range(len(self.recordings)))
        out: dict[tuple[bool, int], list[int]] = {}
        for k, recording in enumerate(self.recordings):
            contacts = recording.contacts
            if contacts is None or contacts.artefact.known:
                key = contacts is None, self.given[k] if self.given else k
                out.setdefault(key, []).append(k)
        return tuple(tuple(group) for group in out.values())

    def stand(self, k: int) -> int:
        """Return which of `stands` recording k is of, or one more where it tells nothing of a base."""
        return next((at for at, own in enumerate(self.stands) if k in own), len(self.stands))

    @property
    def own_bases(self) -> bool:
        return 'base' in self.align and not self.touched and len(self.recordings) > 1

    @property
    def frame_count(self) -> int:
        return 6 * (('base' in self.align) * len(self.stands) + ('tool' in self.align))

    @property
    def shared_count(self) -> int:
        return sum(common.mean.size for _, common in self.common)

    @cached_property
    def common(self) -> list[tuple[int, Common]]:
        """Return the recordings whose samples share errors of their instrument, and these."""
        each = enumerate(r.seen.common for r in self.recordings)
        return [(k, common) for k, common in each if common is not None]

    def of_frames(self) -> Problem:
        return replace(self.not_shared(), changes=())

    def not_shared(self) -> Problem:
        """Return the problem without errors that samples of an instrument share."""
        if not self.common:
            return self
        pairs = ((r, r.seen) for r in self.recordings)
        bare = tuple(r.with_measured(replace(m, common=None)) for r, m in pairs)
        return replace(self, recordings=bare)

    @cached_property
    def roots(self) -> list[Array | None]:
        """Return what makes independent rows of each recording's poses; None where none is given."""
        noises = (r.seen.noise for r in self.recordings)
        return [None if noise is None else noise.root for noise in noises]

    def touching(self, model: Model) -> Problem:
        """Return the problem with its contacts as a model sees them; no contacts, no change."""
        each: list[Unknowns | None] = []
        for k, recording in enumerate(self.recordings):
            if recording.contacts is None:
                each.append(None)
                continue
            poses = model.twin(k).poses(recording, recording.seen.t)
            each.append(unknowns(recording.contacts, poses.position))
        return replace(self, touched=tuple(each) if any(each) else ())

    def seen(self, k: int, block: Array) -> Array:
        """Return what recording k shows, (..., c, M), of changes of its poses, (..., 6, M) [m, rad]."""
        own = self.contact(k)
        if own is not None:
            return np.asarray(np.einsum('mci,...im->...cm', own.seen, block[..., :3, :]))
        return block[..., : self.rows[k], :]

    def places_taken(self, scale: Scale) -> list[tuple[Array, Array] | None]:
        """
        Return what the unknown places of contacts take up of whitened rows, one per recording.

        Orthonormal directions (k, rows of the recording), and the share (k,) left of each; see
        `Unknowns.eliminated`. None for a recording of an instrument; empty without contacts.
        """
        if self.touched and scale not in self._taken:
            pairs = zip(self.touched, scale.weights, strict=True)
            self._taken[scale] = [
                None if u is None else u.eliminated(np.sqrt(w) / scale.position) for u, w in pairs
            ]
        return self._taken[scale] if self.touched else []

    def place_columns(self, scale: Scale) -> Array:
        """
        Return what places of contacts that nobody knows take up of whitened rows, (Z, rows).

        Rows have lost it, found from all postures of a place. Who fits some of them finds it anew:
        else those that are left out would be told by the place that they helped to find.
        """
        ends = np.cumsum([0, *(c * m for c, m in zip(self.rows, self.samples, strict=True))])
        out = [np.zeros((0, ends[-1]))]
        for k, own in enumerate(self.places_taken(scale)):
            if own is not None:
                ways, remaining = own
                beside = (0, 0), (ends[k], ends[-1] - ends[k + 1])
                out.append(np.pad(ways[remaining == 0.0], beside))
        return np.concatenate(out)

    @cached_property
    def samples(self) -> tuple[int, ...]:
        return tuple(r.seen.t.size for r in self.recordings)

    @cached_property
    def given_weights(self) -> list[Array]:
        """
        Return the weight of every sample that was given with the data, shape (M,) per recording.

        Of contacts and recordings that are differently sure, in shares of the surest; else one.
        """
        sigmas = [None if r.contacts is None else r.contacts.sigma for r in self.recordings]
        least = min((float(sigma.min()) for sigma in sigmas if sigma is not None), default=0.0)
        pairs = zip(sigmas, self.samples, strict=True)
        out = [np.ones(m) if sigma is None else (least / sigma) ** 2 for sigma, m in pairs]
        if not self.loose:
            return out
        return [weight / loose**2 for weight, loose in zip(out, self.loose, strict=True)]

    @property
    def size(self) -> int:
        return sum(c * m for c, m in zip(self.rows, self.samples, strict=True))

    def residuals(self, model: Model) -> list[Array]:
        """Return measured minus twin, (c, M) per recording [m, rad]; of contacts the way to them."""
        out = []
        for maker, recording in zip(self.features(model), self.recordings, strict=True):
            measured, poses = recording.seen, maker.run.poses
            if recording.contacts is not None:
                where = places(recording.contacts, poses.position)
                out.append(where.rows(poses.position)[0].T)
                continue
            parts = [(measured.position - poses.position).T]
            if measured.rotation is not None:
                parts.append(angle_between(measured.rotation, poses.rotation).T)
            out.append(np.concatenate(parts))
        for k, common in self.common:
            off = model.shared(k, common.mean.size)
            out[k] = out[k] - np.einsum('mcz,z->cm', common.change, off)
        return out

    def features(self, model: Model) -> list[Features]:
        """
        Return the feature makers of all recordings, taken at the model.

        Those of the last two models are kept: a fit asks for the residual of a model and then for
        its columns, and falls back on the model before where a step was none.
        """
        for other, makers in self._lately:
            if other is model:
                return makers
        each = zip(self.recordings, self._remembered, strict=True)
        makers = [Features(model.twin(k), r, r.seen.t, own) for k, (r, own) in enumerate(each)]
        self._lately[1:] = self._lately[:1]
        self._lately[:1] = [(model, makers)]
        return makers

    @cached_property
    def _remembered(self) -> list[dict[Remembered, list[Shift]]]:
        return [{} for _ in self.recordings]

    @cached_property
    def _lately(self) -> list[tuple[Model, list[Features]]]:
        return []

    def whitened(self, parts: list[Array], scale: Scale) -> Array:
        """
        Return residual-like parts, each (..., c, M), as one array (..., rows) in units of noise.

        Rows run over recordings, samples, components, so that a stretch of time is a stretch of rows.
        """
        out = []
        taken = self.places_taken(scale)
        for k, part in enumerate(parts):
            rows = self.in_noise(k, part, scale)
            rows = rows.reshape(*rows.shape[:-2], rows.shape[-2] * rows.shape[-1])  # of none, too
            own = taken[k] if taken else None
            if own is not None:
                ways, remaining = own
                rows = rows - ((rows @ ways.T) * (1.0 - remaining)) @ ways
            out.append(rows)
        return out[0] if len(out) == 1 else np.concatenate(out, axis=-1)

    def in_noise(self, k: int, part: Array, scale: Scale) -> Array:
        """Return a part (..., c, M) of recording k in noise, rows equally sure, (..., M, c)."""
        unit = np.full(part.shape[-2], 1.0 / scale.position)
        unit[3:] = 1.0 / scale.orientation
        turned = np.swapaxes(part, -1, -2)
        root = self.roots[k]
        if root is not None:
            turned = (root @ turned[..., None])[..., 0]
        out = np.empty(turned.shape)
        np.multiply(turned, scale.roots[k][:, None] * unit, out=out)
        return out

    def measured_rows(self, values: Array, scale: Scale) -> list[Array]:
        """Return `whitened` rows as shifts [m] and turns [rad] again, (M, c) per recording."""
        out = []
        pairs = zip(self.roots, self.by_sample(values), scale.weights, strict=True)
        for root, part, weight in pairs:
            unit = np.full(part.shape[1], scale.position)
            unit[3:] = scale.orientation
            rows = part * unit / np.sqrt(np.maximum(weight, ROUNDING))[:, None]
            out.append(rows if root is None else np.linalg.solve(root, rows[..., None])[..., 0])
        return out

    def by_sample(self, values: Array) -> list[Array]:
        return by_sample(values, self.rows, self.samples)

    def frame_columns(self, features: list[Features]) -> tuple[list[Array], list[str]]:
        """Return nuisance columns, one (P, c, M) array per recording, and their names."""
        groups = [(f'base {g[0]}', 'base', g) for g in self.stands if 'base' in self.align]
        groups += [('tool', 'tool', tuple(range(len(features))))] * ('tool' in self.align)
        sizes = [change.effect.fit.coordinates().size for change in self.changes]
        names = [f'{name}.{j}' for name, _, _ in groups for j in range(6)]
        names += [f'common {k}.{j}' for k, own in self.common for j in range(own.mean.size)]
        names += [f'change {i}.{j}' for i, size in enumerate(sizes) for j in range(size)]
        parts = []
        for k, maker in enumerate(features):
            block = np.zeros((len(names), self.rows[k], self.samples[k]))
            at, given = 0, self.given[k] if self.given else k
            for _, kind, group in groups:
                for j in range(6 if k in group else 0):
                    block[at + j] = self.seen(k, maker.column((kind, j)))
                at += 6
            for other, own in self.common:
                if other == k:
                    block[at : at + own.mean.size] = own.change.transpose(2, 1, 0)
                at += own.mean.size
            for change, size in zip(self.changes, sizes, strict=True):
                if change.recording == given:
                    columns = maker.columns(change.effect, atoms=False)
                    block[at : at + size] = self.seen(k, columns)
                at += size
            parts.append(block)
        return parts, names

    def effect_columns(
        self, features: list[Features], effect: Effect, *, atoms: bool = True
    ) -> list[Array]:
        """Return an effect's linear features, or its derivatives, (P, c, M) per recording."""
        return [self.seen(k, maker.columns(effect, atoms)) for k, maker in enumerate(features)]

    def block_labels(self, blocks: int) -> Array:
        """
        Return a block number for every row: contiguous stretches, at least one per recording.

        The numbers are the same whichever recording was given first. Recordings count by their
        length; a stretch never spans two recordings. Where each has a base of its own, block k is
        the k-th part of every one: left out whole, a short recording would lose its base. Of
        contacts each place is a stretch, where there are at least `PLACES`. Visits of one station lie
        in the stretch of the first: what a station has by itself would be known from its other visits.
        """
        if self.own_bases:
            parts = [self._stretches(k, blocks) for k in range(len(self.samples))]
            return np.concatenate([np.repeat(p, c) for p, c in zip(parts, self.rows, strict=True)])
        whole = self.places >= PLACES
        total = max(sum(self.samples), 1)
        out, start = [np.empty(0, int) for _ in self.recordings], 0
        # In an order that does not hang on which was given first.
        keys = [(r.epoch_ns, r.seen.position.tobytes()) for r in self.recordings]
        for k in sorted(range(len(keys)), key=keys.__getitem__):
            c, m = self.rows[k], self.samples[k]
            count = max(1, round(blocks * m / total))
            if whole and self.contact(k) is not None:
                count = 1
            out[k] = np.repeat(start + self._stretches(k, count), c)
            start += count
        return np.concatenate(out)

    def _stretches(self, k: int, count: int) -> NDArray[np.intp]:
        """Return in which of some stretches every sample of a recording is, (M,)."""
        m, station = self.samples[k], self.stations[k]
        at = np.arange(m)
        if station is not None:
            _, first, which = np.unique(station, return_index=True, return_inverse=True)
            if first.size >= 2 * count:
                m, at = first.size, first.argsort().argsort()[which]
        return at * count // max(m, 1)

    def thinned(self, most_rows: int) -> Problem:
        """
        Return the problem with fewer measurements when it has too many rows.

        The largest recordings give theirs up, evenly: twenty stations beside a minute at a
        kilohertz are no twentieth of what is known.
        """
        if self.size <= most_rows or self.untracked:
            return self
        sizes = np.array([c * m for c, m in zip(self.rows, self.samples, strict=True)])
        # A recording of fewer rows than an even share of what smaller ones leave stays whole.
        rising = np.sort(sizes)
        share = (most_rows - np.cumsum(rising) + rising) / np.arange(sizes.size, 0, -1)
        most = float(share[np.argmax(share < rising)])
        out = []
        for recording, size in zip(self.recordings, sizes.tolist(), strict=True):
            measured = recording.seen
            if recording.contacts is not None or size <= most:
                out.append(recording)
                continue
            count = max(2, round(measured.t.size / (size / most)))
            index = spread_over(measured.t.size, count)
            out.append(recording.with_measured(measured.take(index)))
        return replace(self, recordings=tuple(out))

    def thinned_with(self, scale: Scale, most_rows: int) -> tuple[Problem, Scale]:
        thin = self.thinned(most_rows)
        if thin is self:
            return self, scale
        each = zip(self.recordings, thin.recordings, scale.weights, strict=True)
        kept = (w[np.searchsorted(full.seen.t, part.seen.t)] for full, part, w in each)
        return thin, replace(scale, weights=tuple(kept))

    def unit_scale(self) -> Scale:
        """Return a scale before anything is known of the noise."""
        return Scale(1e-4, 1e-4 / LEVER, tuple(self.given_weights))


def usable(recording: Recording) -> Recording:
    """
    Return the recording with measurements inside its joint stream, side signals straight between.

    Raises DataError: nothing was measured, or no measurement falls inside the joint stream.
    """
    measured, joints = recording.measured, recording.joints
    if measured is None or measured.t.size == 0:
        raise DataError(f'{recording.name} holds no measured poses or points')
    if joints.static:
        return recording
    inside = (measured.t >= joints.t[0]) & (measured.t <= joints.t[-1])
    if not inside.any():
        raise DataError(
            f'no measurement of {recording.name} lies inside its joint stream '
            f'({joints.t[0]:.3f} to {joints.t[-1]:.3f} s against {measured.t[0]:.3f} to '
            f'{measured.t[-1]:.3f} s); the two clocks differ'
        )
    return recording.looking_back().with_measured(measured.take(inside))


@dataclass(frozen=True, eq=False)
class Scale:
    """Noise of position [m] and orientation [rad]; weights (M,) by recording: 1 is good, 0 left out."""

    position: float
    orientation: float
    weights: tuple[Array, ...]

    @cached_property
    def roots(self) -> list[Array]:
        return [np.sqrt(weight) for weight in self.weights]

    @property
    def left_out(self) -> list[NDArray[np.bool_]]:
        return [weight == 0.0 for weight in self.weights]


class Site(NamedTuple):
    """A family on a joint (None: the robot as a whole)."""

    effect: str
    joint: str | None

    @classmethod
    def of(cls, effect: Effect) -> Site:
        return cls(effect.name, effect.site)

    def __str__(self) -> str:
        return f'{self.effect} of {self.joint}' if self.joint else self.effect

    def as_dict(self) -> dict[str, Any]:
        return self._asdict()


class Change(NamedTuple):
    """What one recording has that the first has not, counted from the first."""

    recording: int  # counted from 0; never 0
    effect: Effect


class Alone(NamedTuple):
    """What a robot file does by itself, without the effects that it cannot hold."""

    changes: tuple[Effect, ...]
    """What the file has beside the constants of the model, so that it does well by itself; the effects
    have the same with the other sign. None where the constants are as good."""
    recorded_m: float
    unseen_m: float
    """RMS that remains with the file alone, where it was recorded and on data not fitted [m]."""
    whole_recorded_m: float
    whole_unseen_m: float  # the same with the whole model [m]

    def as_dict(self) -> dict[str, Any]:
        return {**self._asdict(), 'changes': [effect.to_mapping() for effect in self.changes]}


@dataclass(frozen=True, eq=False)
class Model:
    """What is believed: the robot with its tool frame, a base frame per recording, and effects."""

    robot: Robot
    bases: tuple[Array, ...]  # shape (4, 4)
    known: tuple[Effect, ...] = ()  # given by the user
    found: tuple[Effect, ...] = ()  # put in by this diagnosis
    mended: tuple[str, ...] = ()  # what was wrong with the data it stands on, and was undone
    changes: tuple[Change, ...] = ()  # what differs between the recordings
    given: tuple[int, ...] = ()  # of which of the recordings given each is a part; see `Problem`
    mends: tuple[Mapping[str, Any], ...] = ()
    """How it was undone, as plain values to be made again; see `soundness.mending`."""
    alone: Alone | None = None  # what its robot file does by itself; None where that is not known
    named: tuple[tuple[str, str | None], ...] | None = None
    """Name and joint of the effects found that the verdict names; None before there is one."""
    common: tuple[Array, ...] = ()
    """Errors that all samples of an instrument share, one array for every recording, empty where
    it has none; nothing before they are fitted."""
    counted: Counted | None = None
    """How the controller counts the joints, where a recording says that it does so otherwise."""

    def twin(self, k: int) -> Twin:
        effects = self.known + self.found + self.changed(k)
        return Twin(self.robot.with_frames(base=self.bases[k]), effects)

    def changed(self, k: int) -> tuple[Effect, ...]:
        own = self.given[k] if self.given else k
        return tuple(change.effect for change in self.changes if change.recording == own)

    def moved(self, k: int, step: Array) -> Model:
        bases = list(self.bases)
        bases[k] = _moved(bases[k], step, left=True)
        return replace(self, bases=tuple(bases))

    def retooled(self, step: Array) -> Model:
        tool = _moved(self.robot.T_flange_tool, step, left=False)
        return replace(self, robot=self.robot.with_frames(tool=tool))

    def shared(self, k: int, count: int) -> Array:
        """Return the errors that all samples of recording k share, shape (count,)."""
        return self.common[k] if self.common else np.zeros(count)

    def reading_map(self) -> tuple[Array, Array]:
        """Return (n, n) and (n,) [rad or m]: undoing mistakes made positions q matrix' + offset."""
        matrix, offset = np.eye(self.robot.n), np.zeros(self.robot.n)
        for entry in self.mends:
            if entry.get('do') == 'joints':
                turn = np.asarray(entry['matrix'], dtype=float)
                matrix, offset = turn @ matrix, turn @ offset + np.asarray(entry['offset'])
        return matrix, offset

    @property
    def turned(self) -> tuple[str, ...]:
        """Return the joints whose readings the controller shows with the other sign."""
        matrix, _ = self.reading_map()
        if self.counted is not None:
            matrix = matrix @ self.counted.matrix
        negative = np.flatnonzero(np.diag(matrix) < 0.0)
        return tuple(self.robot.joint_names[k] for k in negative.tolist())

    def without(self, k: int) -> Model:
        return self.with_found(self.found[:k] + self.found[k + 1 :])

    def with_found(self, result: tuple[Effect, ...]) -> Model:
        return replace(self, found=result)


def _moved(frame: Array, step: Array, *, left: bool) -> Array:
    out = np.array(frame)
    turn = rotation_matrix(step[3:])
    out[:3, :3] = turn @ out[:3, :3] if left else out[:3, :3] @ turn
    out[:3, 3] += step[:3]
    return out


@dataclass(frozen=True, eq=False)
class Anchor:
    bases: tuple[Array, ...]  # shape (4, 4)
    tool: Array  # shape (4, 4)
    of: frozenset[str] = frozenset({'base', 'tool'})  # frames of which that is believed
