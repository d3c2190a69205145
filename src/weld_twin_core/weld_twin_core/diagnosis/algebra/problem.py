# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis problem: recordings, the model believed so far, and residuals in one layout."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from ...arm.robot import Robot
from ...arm.rotation import angle_between, rotation_matrix
from ...arrays import Array
from ...contacts import Unknowns, places, unknowns
from ...effects.effect import Effect
from ...errors import DataError, ModelError
from ...recording import Measurements, Recording
from ...twin.features import Features
from ...twin.twin import Twin
from .row_layout import by_sample

FRAMES = ('base', 'tool')
PLACES = 3
"""Places of contacts from which on each is left out as a whole. Of two, one alone would have to tell
of the other what only both together show."""


def frames_named(align: str | Iterable[str], what: str = 'align') -> frozenset[str]:
    """
    Return the frames to fit along, from one text or from several names.

    Parameters
    ----------
    align : str or iterable of str
        'base', 'tool', 'base,tool', or the names as a list or a set; nothing for neither.
    what : str
        How the message names the argument.

    Raises
    ------
    ModelError
        A name is neither 'base' nor 'tool'.

    """
    parts = align.split(',') if isinstance(align, str) else align
    frames = frozenset(name for part in parts if (name := str(part).strip()))
    for frame in sorted(frames - set(FRAMES)):
        raise ModelError(f'{what} takes base, tool or base,tool; {frame!r} is neither')
    return frames


@dataclass(frozen=True, eq=False)
class Scale:
    """
    Noise that residuals are measured in: position [m], orientation [rad], weight per sample.

    ``weights`` holds one array (M,) per recording, 1 for a good sample, less for an outlier.
    """

    position: float
    orientation: float
    weights: tuple[Array, ...]


class Change(NamedTuple):
    """
    What one recording has that the first has not, counted from the first.

    Attributes
    ----------
    recording : int
        Counted from 0; never 0.
    effect : Effect

    """

    recording: int
    effect: Effect


@dataclass(frozen=True, eq=False)
class Model:
    """
    What is believed: the robot with its tool frame, a base frame per recording, and effects.

    Attributes
    ----------
    robot : Robot
    bases : tuple of array, shape (4, 4)
    known, found : tuple of Effect
        Effects given by the user, and those this diagnosis put in.
    mended : tuple of str
        What was wrong with the data it stands on, and was undone.
    changes : tuple of Change
        What differs between the recordings.

    """

    robot: Robot
    bases: tuple[Array, ...]
    known: tuple[Effect, ...] = ()
    found: tuple[Effect, ...] = ()
    mended: tuple[str, ...] = ()
    changes: tuple[Change, ...] = ()

    def twin(self, k: int) -> Twin:
        """Return the twin of recording k."""
        effects = self.known + self.found + self.changed(k)
        return Twin(self.robot.with_frames(base=self.bases[k]), effects)

    def changed(self, k: int) -> tuple[Effect, ...]:
        """Return what recording k has that the first has not."""
        return tuple(change.effect for change in self.changes if change.recording == k)

    def moved(self, k: int, step: Array) -> Model:
        """Return the model with the base of recording k moved by (xyz, rotvec)."""
        bases = list(self.bases)
        bases[k] = _moved(bases[k], step, left=True)
        return replace(self, bases=tuple(bases))

    def retooled(self, step: Array) -> Model:
        """Return the model with the tool moved by (xyz, rotvec)."""
        tool = _moved(self.robot.T_flange_tool, step, left=False)
        return replace(self, robot=self.robot.with_frames(tool=tool))

    def without(self, k: int) -> Model:
        """Return the model without found effect k."""
        return self.with_found(self.found[:k] + self.found[k + 1 :])

    def with_found(self, found: tuple[Effect, ...]) -> Model:
        """Return the model with other found effects."""
        return replace(self, found=found)


def _moved(frame: Array, step: Array, *, left: bool) -> Array:
    out = np.array(frame)
    turn = rotation_matrix(step[3:])
    out[:3, :3] = turn @ out[:3, :3] if left else out[:3, :3] @ turn
    out[:3, 3] += step[:3]
    return out


@dataclass(frozen=True, eq=False)
class Anchor:
    """
    Where the frames are believed to be.

    Attributes
    ----------
    bases : tuple of array, shape (4, 4)
    tool : array, shape (4, 4)

    """

    bases: tuple[Array, ...]
    tool: Array


@dataclass(frozen=True, eq=False)
class Problem:
    """
    Recordings to explain.

    Attributes
    ----------
    recordings : tuple of Recording
        Each with measurements inside its joint stream; see `usable`.
    align : frozenset
        Frames fitted as nuisance in every hypothesis: 'base' (one per recording), 'tool'.
    anchor : Anchor, optional
        Where those frames are believed to be; see `prior`.
    dated : tuple of Effect
        What may have set in at an instant that was found: hypotheses beside the library's.
    changes : tuple of Change
        What may differ between the recordings: fitted along in every hypothesis, as frames are.
    touched : tuple of Unknowns
        Where recordings are contacts, one each: what they see of the tool point, and their
        unknown places; see `touching`. Empty where an instrument measured.

    """

    recordings: tuple[Recording, ...]
    align: frozenset[str] = field(default_factory=frozenset)
    anchor: Anchor | None = None
    dated: tuple[Effect, ...] = ()
    changes: tuple[Change, ...] = ()
    touched: tuple[Unknowns, ...] = ()
    _taken: WeakKeyDictionary[Scale, list[tuple[Array, Array]]] = field(
        default_factory=WeakKeyDictionary, init=False, repr=False
    )

    @property
    def rows(self) -> tuple[int, ...]:
        """Return the scalar rows per sample of each recording: 6 for poses, 3 for points."""
        if self.touched:
            return tuple(unknown.seen.shape[1] for unknown in self.touched)
        return tuple(3 if _measured(r).rotation is None else 6 for r in self.recordings)

    def touching(self, model: Model) -> Problem:
        """Return the problem with its contacts as a model sees them; no contacts, no change."""
        each = []
        for k, recording in enumerate(self.recordings):
            if recording.contacts is not None:
                poses = model.twin(k).poses(recording, _measured(recording).t)
                each.append(unknowns(recording.contacts, poses.position))
        return replace(self, touched=tuple(each))

    def seen(self, k: int, block: Array) -> Array:
        """
        Return what recording k shows of changes of its poses, shape (..., c, M).

        Parameters
        ----------
        k : int
            Which recording, counted from 0.
        block : array, shape (..., 6, M) [m, rad]

        """
        if self.touched:
            ways = self.touched[k].seen
            return np.asarray(np.einsum('mci,...im->...cm', ways, block[..., :3, :]))
        return block[..., : self.rows[k], :]

    def pulled(self, k: int, rows: Array) -> Array:
        """Return the pull on the tool of recording k's rows, (c, M), as (3 or 6, M): along each."""
        if self.touched:
            return np.asarray(np.einsum('mci,cm->im', self.touched[k].seen, rows))
        return rows

    def places_taken(self, scale: Scale) -> list[tuple[Array, Array]]:
        """
        Return what the unknown places of contacts take up of whitened rows, one per recording.

        Orthonormal directions (k, rows of the recording), and the share (k,) left of each; see
        `Unknowns.eliminated`. Empty without contacts.
        """
        if self.touched and scale not in self._taken:
            pairs = zip(self.touched, scale.weights, strict=True)
            self._taken[scale] = [u.eliminated(np.sqrt(w) / scale.position) for u, w in pairs]
        return self._taken[scale] if self.touched else []

    @property
    def samples(self) -> tuple[int, ...]:
        """Return the number of measurements of each recording."""
        return tuple(_measured(r).t.size for r in self.recordings)

    @cached_property
    def told_weights(self) -> list[Array]:
        """
        Return the weight of every sample that was told with the data, shape (M,) per recording.

        Of contacts whose uncertainty is known, in shares of the surest; one for all others.
        """
        told = [None if r.contacts is None else r.contacts.sigma for r in self.recordings]
        least = min((float(sigma.min()) for sigma in told if sigma is not None), default=0.0)
        pairs = zip(told, self.samples, strict=True)
        return [np.ones(m) if sigma is None else (least / sigma) ** 2 for sigma, m in pairs]

    @property
    def size(self) -> int:
        """Return the number of scalar rows."""
        return sum(c * m for c, m in zip(self.rows, self.samples, strict=True))

    def residuals(self, model: Model) -> list[Array]:
        """
        Return measured minus twin, one array (c, M) per recording [m, rad].

        Of contacts it is the way from the tool point to where the contact is, as this model and
        the lengths known put it.
        """
        out = []
        for maker, recording in zip(self.features(model), self.recordings, strict=True):
            measured, poses = _measured(recording), maker.run.poses
            if recording.contacts is not None:
                where = places(recording.contacts, poses.position)
                out.append(where.rows(poses.position)[0].T)
                continue
            parts = [(measured.position - poses.position).T]
            if measured.rotation is not None:
                parts.append(angle_between(measured.rotation, poses.rotation).T)
            out.append(np.concatenate(parts))
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
        makers = [
            Features(model.twin(k), r, _measured(r).t) for k, r in enumerate(self.recordings)
        ]
        self._lately[1:] = self._lately[:1]
        self._lately[:1] = [(model, makers)]
        return makers

    @cached_property
    def _lately(self) -> list[tuple[Model, list[Features]]]:
        return []

    def whitened(self, parts: list[Array], scale: Scale) -> Array:
        """
        Return residual-like parts, each (..., c, M), as one array (..., rows) in units of noise.

        Rows run over recordings, then samples, then components, so that a stretch of time is a
        stretch of rows.
        """
        out = []
        taken = self.places_taken(scale)
        for k, (part, weight) in enumerate(zip(parts, scale.weights, strict=True)):
            unit = np.full(part.shape[-2], 1.0 / scale.position)
            unit[3:] = 1.0 / scale.orientation
            turned = np.swapaxes(part, -1, -2)
            scaled = np.empty(turned.shape)
            np.multiply(turned, np.sqrt(weight)[:, None] * unit, out=scaled)
            rows = scaled.reshape(*part.shape[:-2], weight.size * unit.size)
            if taken:
                ways, left = taken[k]
                rows = rows - ((rows @ ways.T) * (1.0 - left)) @ ways
            out.append(rows)
        return out[0] if len(out) == 1 else np.concatenate(out, axis=-1)

    def by_sample(self, values: Array) -> list[Array]:
        """Return what `whitened` has laid out in rows as one array per recording, (M, c, ...)."""
        return by_sample(values, self.rows, self.samples)

    def frame_columns(self, features: list[Features]) -> tuple[list[Array], list[str]]:
        """Return nuisance columns, one (P, c, M) array per recording, and their names."""
        names: list[str] = []
        if 'base' in self.align:
            names += [f'base {k}.{j}' for k in range(len(self.recordings)) for j in range(6)]
        if 'tool' in self.align:
            names += [f'tool.{j}' for j in range(6)]
        parts = []
        for k, maker in enumerate(features):
            block = np.zeros((len(names), self.rows[k], self.samples[k]))
            for p, name in enumerate(names):
                kind, _, j = name.partition('.')
                if kind == f'base {k}' or kind == 'tool':
                    block[p] = self.seen(k, maker.column((kind.split()[0], int(j))))
            parts.append(np.concatenate([block, *self._change_columns(k, maker)]))
        sizes = [change.effect.coordinates().size for change in self.changes]
        names += [f'change {i}.{j}' for i, size in enumerate(sizes) for j in range(size)]
        return parts, names

    def _change_columns(self, k: int, maker: Features) -> list[Array]:
        """Return the columns of every change in recording k, zero for those of the others."""
        out = []
        for change in self.changes:
            if change.recording == k:
                out.append(self.seen(k, maker.columns(change.effect, atoms=False)))
            else:
                size = change.effect.coordinates().size
                out.append(np.zeros((size, self.rows[k], self.samples[k])))
        return out

    def effect_columns(
        self, features: list[Features], effect: Effect, *, atoms: bool = True
    ) -> list[Array]:
        """
        Return an effect's columns, one (P, c, M) array per recording.

        Parameters
        ----------
        features : list of Features
            One per recording; see `Problem.features`.
        effect : Effect
        atoms : bool
            Its linear features; else the derivatives by its fit coordinates.

        """
        return [self.seen(k, maker.columns(effect, atoms)) for k, maker in enumerate(features)]

    def block_labels(self, blocks: int) -> Array:
        """
        Return a block number for every row: contiguous stretches, at least one per recording.

        Recordings count by their length; a stretch never spans two recordings. Of contacts each
        place is a stretch, where there are at least `PLACES`.
        """
        if len(self.touched) >= PLACES:
            blocks = 1
        total = max(sum(self.samples), 1)
        out, start = [], 0
        for c, m in zip(self.rows, self.samples, strict=True):
            count = max(1, round(blocks * m / total))
            labels = start + (np.arange(m) * count) // max(m, 1)
            out.append(np.repeat(labels, c))
            start += count
        return np.concatenate(out)

    def thinned(self, most_rows: int) -> Problem:
        """Return the problem with evenly fewer measurements when it has too many rows."""
        factor = self.size / most_rows
        if factor <= 1.0 or self.touched:
            return self
        out = []
        for recording in self.recordings:
            measured = _measured(recording)
            count = max(2, round(measured.t.size / factor))
            index = np.unique(np.linspace(0, measured.t.size - 1, count).round().astype(int))
            out.append(recording.with_measured(measured.take(index)))
        return replace(self, recordings=tuple(out))

    def unit_scale(self) -> Scale:
        """Return a scale before anything is known of the noise."""
        return Scale(1e-4, 2e-4, tuple(self.told_weights))


def usable(recording: Recording) -> Recording:
    """
    Return the recording with the measurements that lie inside its joint stream.

    Its side signals are straight between samples, whatever a running twin makes of them.

    Raises
    ------
    DataError
        Nothing was measured, or no measurement falls inside the joint stream.

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


def _measured(recording: Recording) -> Measurements:
    if recording.measured is None:
        raise DataError(f'{recording.name} holds no measured poses or points')
    return recording.measured
