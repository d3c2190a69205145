# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Frames and constant errors of an arm fitted to a few postures, all columns at once.

The same fit as that of `algebra.fit`, for an arm of which nothing else is known: then the columns
of all rows are a few operations on arrays. A trial of a mix-up takes thousands of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from ...arm.chain import Frames, frames
from ...arm.channels import NO_SHIFT, Channel, Shift
from ...arm.robot import Robot
from ...arm.rotation import angle_between, rotation_matrix, transform
from ...arm.vectors import cross
from ...arrays import Array
from ...effects.effect import Effect
from ...effects.joint_offset import JointOffset
from ...effects.link_length import LinkLength
from ...effects.link_offset import LinkOffset
from ...effects.link_twist import LinkTwist
from ...recording import Recording
from ..algebra.fit import descended
from ..algebra.problem import Model, Scale
from ..frames.in_turn import Track
from .mending import measured

KINDS: tuple[type[JointOffset | LinkLength | LinkOffset | LinkTwist], ...] = (
    JointOffset,
    LinkLength,
    LinkOffset,
    LinkTwist,
)
"""Errors of an arm, each on every joint, in the order of the columns."""
CHANNELS = ('q', 'a', 'd', 'alpha')
"""What each of them displaces."""


@dataclass(frozen=True, eq=False)
class Postures:
    """
    Postures of an arm, with what was measured there.

    Attributes
    ----------
    robot : Robot
        Base and tool at the origin; the model has those.
    q : array, shape (M, n) [rad or m]
    position : array, shape (3, M) [m]
    rotation : array, shape (M, 3, 3), optional
    parts : tuple of slice
        The samples of every recording.

    """

    robot: Robot
    q: Array
    position: Array
    rotation: Array | None
    parts: tuple[slice, ...]

    @classmethod
    def of(cls, recordings: Sequence[Recording], model: Model) -> Postures | None:
        """Return the postures of stations; None where more is known than the arm's numbers."""
        seen = [measured(recording) for recording in recordings]
        turns = [one.rotation for one in seen if one.rotation is not None]
        # Contacts, changes and known effects are for the fit that can do everything.
        beside = model.known or model.changes or any(r.contacts is not None for r in recordings)
        if beside or len(turns) not in (0, len(seen)):
            return None
        ends = np.cumsum([0, *(one.t.size for one in seen)])
        return cls(
            model.robot.with_frames(base=np.eye(4), tool=np.eye(4)),
            np.concatenate(
                [r.joints.at(one.t)[0] for r, one in zip(recordings, seen, strict=True)]
            ),
            np.concatenate([one.position for one in seen]).T,
            np.concatenate(turns) if turns else None,
            tuple(slice(int(a), int(b)) for a, b in pairwise(ends)),
        )

    def chain(self, errors: Array) -> tuple[Frames, Array, Array]:
        """Return the chain in base axes, and the flange: points (M, 3), rotations (M, 3, 3)."""
        if not errors.any():
            return self._given
        channels: list[Channel] = [(name, i) for name in CHANNELS for i in range(self.robot.n)]
        return self._flanged(dict(zip(channels, errors[:, None], strict=True)))

    @cached_property
    def _given(self) -> tuple[Frames, Array, Array]:
        return self._flanged(NO_SHIFT)

    def _flanged(self, shift: Shift) -> tuple[Frames, Array, Array]:
        chain, samples = frames(self.robot, self.q, shift), len(self.q)
        point = np.broadcast_to(chain.flange_point, (samples, 3))
        return chain, point, np.broadcast_to(chain.flange_rotation, (samples, 3, 3))

    @property
    def tracks(self) -> list[Track]:
        """Return one track for every recording."""
        position, turns = self.position.T, self.rotation
        _, point, turn = self._given
        return [
            Track(position[part], None if turns is None else turns[part], point[part], turn[part])
            for part in self.parts
        ]

    def at(self, model: Model) -> Place:
        """Return where a model puts the tool; what it has found are errors of `KINDS` or none."""
        errors = [float(effect.vector()[0]) for effect in model.found]
        return Place(self, model.bases, model.robot.T_flange_tool, np.array(errors))

    def fitted(
        self,
        start: Model,
        align: frozenset[str],
        scale: Scale,
        precision: Array | None = None,
        iterations: int = 8,
    ) -> Model:
        """
        Return the model with frames and errors that fit best; see `algebra.fit.fit`.

        Parameters
        ----------
        start : Model
        align : frozenset of str
            Frames that are fitted.
        scale : Scale
        precision : array, shape (K,), optional
            Prior precision of every error; left out, there is none to fit.
        iterations : int

        """
        prior = np.zeros(0) if precision is None else precision
        task = _Task(align, self._weights(scale), prior)
        place = descended(_Step(task, self.at(start)), iterations, 1e-5).place
        return place.model(start)

    def _weights(self, scale: Scale) -> Array:
        """Return what rows are multiplied by, shape (3 or 6, M)."""
        unit = np.repeat([1.0 / scale.position, 1.0 / scale.orientation], 3)
        rows = 3 if self.rotation is None else 6
        return np.asarray(unit[:rows, None] * np.sqrt(np.concatenate(scale.weights)))


@dataclass(frozen=True, eq=False)
class Place:
    """
    Where frames and errors put the tool.

    Attributes
    ----------
    postures : Postures
    bases : tuple of array, each shape (4, 4)
    tool : array, shape (4, 4)
    errors : array, shape (4 n,)
        In the order of `KINDS`, then of the joints; or none, shape (0,).

    """

    postures: Postures
    bases: tuple[Array, ...]
    tool: Array
    errors: Array

    @cached_property
    def _chain(self) -> tuple[Frames, Array, Array]:
        return self.postures.chain(self.errors)

    @cached_property
    def _tip(self) -> Array:
        """Return the tool point in base axes, shape (3, M) [m]."""
        _, point, turn = self._chain
        return np.asarray((point + turn @ self.tool[:3, 3]).T)

    def _in_world(self, columns: Array) -> Array:
        """Turn vectors in base axes, shape (..., 3, M), into world axes."""
        pairs = zip(self.bases, self.postures.parts, strict=True)
        turned = [base[:3, :3] @ columns[..., part] for base, part in pairs]
        return turned[0] if len(turned) == 1 else np.concatenate(turned, axis=-1)

    @cached_property
    def _lever(self) -> Array:
        """Return the tool point against its base in world axes, shape (3, M) [m]."""
        return self._in_world(self._tip)

    @cached_property
    def _turn(self) -> Array:
        """Return the rotation of the tool in the world, shape (M, 3, 3)."""
        turned = self._chain[2] @ self.tool[:3, :3]
        pairs = zip(self.bases, self.postures.parts, strict=True)
        return np.concatenate([base[:3, :3] @ turned[part] for base, part in pairs])

    @property
    def reached(self) -> Array:
        """Return the tool point in the world, shape (3, M) [m]."""
        pairs = zip(self.bases, self.postures.parts, strict=True)
        origin = [np.broadcast_to(b[:3, 3:], (3, part.stop - part.start)) for b, part in pairs]
        return self._lever + np.concatenate(origin, axis=1)

    @cached_property
    def residual(self) -> Array:
        """Return measured minus twin, shape (3 or 6, M) [m, rad]."""
        off = self.postures.position - self.reached
        if self.postures.rotation is None:
            return off
        return np.concatenate([off, angle_between(self.postures.rotation, self._turn).T])

    @property
    def residuals(self) -> list[Array]:
        """Return the residual of every recording."""
        return [self.residual[:, part] for part in self.postures.parts]

    @property
    def gap(self) -> float:
        """Return the median distance between measured and twin [m]."""
        return float(np.median(np.linalg.norm(self.residual[:3], axis=0)))

    def columns(self, align: frozenset[str]) -> Array:
        """Return the columns of frames and errors, shape (P, 3 or 6, M)."""
        parts = []
        if 'base' in align:
            parts += self._base_columns()
        if 'tool' in align:
            parts.append(self._tool_columns())
        if self.errors.size:
            parts.append(self._error_columns())
        rows = 3 if self.postures.rotation is None else 6
        return np.concatenate(parts)[:, :rows]

    def _base_columns(self) -> list[Array]:
        out = []
        for part in self.postures.parts:
            block = np.zeros((6, 6, self._lever.shape[1]))
            for j, axis in enumerate(np.eye(3)):
                block[j, j, part] = 1.0
                block[3 + j, :3, part] = cross(axis, self._lever[:, part])
                block[3 + j, 3 + j, part] = 1.0
            out.append(block)
        return out

    def _tool_columns(self) -> Array:
        out = np.zeros((6, 6, self._lever.shape[1]))
        out[:3, :3] = self._in_world(self._chain[2].transpose(2, 1, 0))
        out[3:, 3:] = self._turn.transpose(2, 1, 0)
        return out

    def _error_columns(self) -> Array:
        robot, rows, tip = self.postures.robot, self._chain[0].rows, self._tip
        n, samples = robot.n, tip.shape[1]
        axes = np.empty((6, 3, n, samples))
        for i, row in enumerate(rows):
            for k, axis in enumerate((row.z, row.z_point, row.x, row.x_point, row.y)):
                axes[k, :, i] = axis
        z, z_point, x, x_point, y, _ = axes
        along = x if robot.convention == 'standard' else cross(y, z)
        out = np.zeros((4, n, 6, samples))
        straight, turning = robot.prismatic, ~robot.prismatic
        moment = cross(z, tip[:, None] - z_point).swapaxes(0, 1)
        out[0, turning, :3], out[0, turning, 3:] = moment[turning], z.swapaxes(0, 1)[turning]
        out[0, straight, :3] = z.swapaxes(0, 1)[straight]
        out[1, :, :3] = along.swapaxes(0, 1)
        out[2, :, :3] = z.swapaxes(0, 1)
        out[3, :, :3] = cross(x, tip[:, None] - x_point).swapaxes(0, 1)
        out[3, :, 3:] = x.swapaxes(0, 1)
        out[:, : robot.behind] *= -1.0  # the chain passes these rows backwards
        flat = out.reshape(4 * n, 2, 3, samples)
        return self._in_world(flat).reshape(4 * n, 6, samples)

    def stepped(self, step: Array, align: frozenset[str]) -> Place:
        """Return the place after a step of frames and errors, in the order of `columns`."""
        frames = len(self.bases) * ('base' in align) + ('tool' in align)
        moves = step[: 6 * frames].reshape(frames, 6)
        turns = rotation_matrix(moves[:, 3:])
        bases, tool = list(self.bases), self.tool
        if 'base' in align:
            for k, base in enumerate(bases):
                bases[k] = transform(turns[k] @ base[:3, :3], base[:3, 3] + moves[k, :3])
        if 'tool' in align:
            tool = transform(tool[:3, :3] @ turns[-1], tool[:3, 3] + moves[-1, :3])
        return replace(
            self, bases=tuple(bases), tool=tool, errors=self.errors + step[6 * frames :]
        )

    def model(self, before: Model) -> Model:
        """Return a model with these frames and errors."""
        found: tuple[Effect, ...] = ()
        if self.errors.size:
            names = self.postures.robot.joint_names
            sites = [(kind, name) for kind in KINDS for name in names]
            pairs = zip(sites, self.errors, strict=True)
            found = tuple(kind(name, float(value)) for (kind, name), value in pairs)
        robot = before.robot.with_frames(tool=self.tool)
        return replace(before, robot=robot, bases=self.bases, found=found)


@dataclass(frozen=True, eq=False)
class _Task:
    """What stays the same during a fit: frames that are fitted, weights of rows, the prior."""

    align: frozenset[str]
    weights: Array
    prior: Array


@dataclass(frozen=True, eq=False)
class _Step:
    """A place on the way of a fit."""

    task: _Task
    place: Place

    @cached_property
    def _residual(self) -> Array:
        return np.asarray((self.task.weights * self.place.residual).ravel())

    @cached_property
    def cost(self) -> float:
        """Return the whitened sum of squares with that of the prior."""
        own = self.task.prior @ self.place.errors**2
        return float(self._residual @ self._residual + own)

    @cached_property
    def normal_equations(self) -> tuple[Array, Array]:
        """Return normal matrix and right-hand side of a step, the prior included."""
        columns = self.place.columns(self.task.align) * self.task.weights
        flat = columns.reshape(len(columns), -1)
        normal, right = flat @ flat.T, flat @ self._residual
        own = slice(len(right) - self.task.prior.size, None)
        normal[own, own] += np.diag(self.task.prior)
        right[own] -= self.task.prior * self.place.errors
        return normal, right

    def stepped(self, step: Array) -> _Step:
        """Return the place a step away."""
        return _Step(self.task, self.place.stepped(step, self.task.align))
