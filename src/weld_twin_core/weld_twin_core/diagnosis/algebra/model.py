# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is believed so far: the robot with its frames and effects, and the noise of a residual."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ...arm.robot import Robot
from ...arm.rotation import rotation_matrix
from ...arrays import Array
from ...effects.effect import Effect
from ...twin.twin import Twin


@dataclass(frozen=True, eq=False)
class Scale:
    """
    Noise that residuals are measured in: position [m], orientation [rad], weight per sample.

    ``weights`` holds one array (M,) per recording, 1 for a good sample, less for an outlier.
    """

    position: float
    orientation: float
    weights: tuple[Array, ...]

    @cached_property
    def roots(self) -> list[Array]:
        """Return the square root of every weight."""
        return [np.sqrt(weight) for weight in self.weights]


class Change(NamedTuple):
    """What one recording has that the first has not, counted from the first."""

    recording: int
    """Counted from 0; never 0."""
    effect: Effect


class Alone(NamedTuple):
    """What a robot file does by itself, without the effects that it cannot hold."""

    changes: tuple[Effect, ...]
    """What the file has beside the constants of the model, so that it does well by itself; the
    effects that go with it have the same with the other sign. None where the constants of the
    model are as good."""
    recorded_m: float
    unseen_m: float
    """RMS that remains with the file alone, where it was recorded and on data not fitted [m]."""
    whole_recorded_m: float
    whole_unseen_m: float
    """The same with the whole model [m]."""

    def as_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return {**self._asdict(), 'changes': [effect.to_mapping() for effect in self.changes]}


@dataclass(frozen=True, eq=False)
class Model:
    """What is believed: the robot with its tool frame, a base frame per recording, and effects."""

    robot: Robot
    bases: tuple[Array, ...]
    """Shape (4, 4)."""
    known: tuple[Effect, ...] = ()
    found: tuple[Effect, ...] = ()
    """Effects given by the user, and those this diagnosis put in."""
    mended: tuple[str, ...] = ()
    """What was wrong with the data it stands on, and was undone."""
    changes: tuple[Change, ...] = ()
    """What differs between the recordings."""
    given: tuple[int, ...] = ()
    """Of which of the recordings given each is a part; see `Problem`."""
    mends: tuple[Mapping[str, Any], ...] = ()
    """How it was undone, as plain values to be made again; see `soundness.mending`."""
    alone: Alone | None = None
    """What its robot file does by itself; None where that is not known."""
    common: tuple[Array, ...] = ()
    """Errors that all samples of an instrument share, one array for every recording, empty where
    it has none; nothing before they are fitted."""

    def twin(self, k: int) -> Twin:
        """Return the twin of recording k."""
        effects = self.known + self.found + self.changed(k)
        return Twin(self.robot.with_frames(base=self.bases[k]), effects)

    def changed(self, k: int) -> tuple[Effect, ...]:
        """Return what recording k has that the first has not."""
        own = self.given[k] if self.given else k
        return tuple(change.effect for change in self.changes if change.recording == own)

    def moved(self, k: int, step: Array) -> Model:
        """Return the model with the base of recording k moved by (xyz, rotvec)."""
        bases = list(self.bases)
        bases[k] = _moved(bases[k], step, left=True)
        return replace(self, bases=tuple(bases))

    def retooled(self, step: Array) -> Model:
        """Return the model with the tool moved by (xyz, rotvec)."""
        tool = _moved(self.robot.T_flange_tool, step, left=False)
        return replace(self, robot=self.robot.with_frames(tool=tool))

    def shared(self, k: int, count: int) -> Array:
        """Return the errors that all samples of recording k share, shape (count,)."""
        return self.common[k] if self.common else np.zeros(count)

    def without(self, k: int) -> Model:
        """Return the model without found effect k."""
        return self.with_found(self.found[:k] + self.found[k + 1 :])

    def with_found(self, result: tuple[Effect, ...]) -> Model:
        """Return the model with other found effects."""
        return replace(self, found=result)


def _moved(frame: Array, step: Array, *, left: bool) -> Array:
    out = np.array(frame)
    turn = rotation_matrix(step[3:])
    out[:3, :3] = turn @ out[:3, :3] if left else out[:3, :3] @ turn
    out[:3, 3] += step[:3]
    return out


@dataclass(frozen=True, eq=False)
class Anchor:
    """Where the frames are believed to be."""

    bases: tuple[Array, ...]
    """Shape (4, 4)."""
    tool: Array
    """Shape (4, 4)."""
    of: frozenset[str] = frozenset({'base', 'tool'})
    """Frames of which that is believed."""
