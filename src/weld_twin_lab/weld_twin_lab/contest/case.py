# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A case: all that a method sees of it. An answer: all that it gives."""

from __future__ import annotations

import pickle
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Measurements, Recording

from ..blind.achieved import measured_of

Name = tuple[str, str | None, float]
"""Effect, joint, probability."""
Cause = tuple[Name, ...]
"""Names of which one is meant, and nothing more is known."""


@dataclass(frozen=True)
class ContestCase:
    """What a method may know."""

    robot: Robot
    """As its maker describes it."""
    train: Recording
    """What was commanded and measured."""
    ask: Recording
    """What was commanded on another occasion; nothing of what was measured then."""
    times: Array
    """When the tool's position is asked for, shape (M,) [s]."""
    align: tuple[str, ...]
    """Frames that nobody measured: 'base', 'tool'."""
    exclude: tuple[str, ...] = ()
    """Families of effects that are known not to be at work."""
    known: Path | None = None
    """The file of effects that are known, if there are any."""

    @property
    def measured(self) -> Measurements:
        """Return what was measured to learn from."""
        return measured_of(self.train)


def case_of(
    robot: Robot, train: Recording, ask: Recording, align: tuple[str, ...], **more: Any
) -> ContestCase:
    """
    Return a case that asks where the tool was whenever it was measured in another recording.

    more: what else `ContestCase` has.
    """
    times = measured_of(ask).t
    return ContestCase(robot, train, replace(ask, measured=None), times, align, **more)


@dataclass(frozen=True)
class ContestAnswer:
    """What a method says."""

    predicted: Array
    """Where the tool was at the times asked for, shape (M, 3) [m]."""
    causes: tuple[Cause, ...] = ()
    """What is at work; each is told as names that may stand for it: effect, joint, and how likely
    it is that one."""
    unknown: float = 0.0
    none: float = 0.0
    """How likely something unnamed is at work, and nothing at all."""
    sure: tuple[bool, ...] | None = None
    """Whether each cause is told as sure, then whether the whole is; left out, what is likelier
    than `blind.judging.CONFIDENT` counts as sure."""


def put(path: Path, content: ContestCase | ContestAnswer) -> None:
    """Write a case or an answer."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(pickle.dumps(content))


def case_at(path: Path) -> ContestCase:
    """Return a case."""
    content: ContestCase = pickle.loads(path.read_bytes())
    return content


def answer_at(path: Path, count: int) -> ContestAnswer:
    """
    Return an answer.

    count: positions that were asked for.

    Raises DataError: it is missing, or not as many finite positions.
    """
    if not path.is_file():
        raise DataError(f"there is no answer '{path}'")
    answer: ContestAnswer = pickle.loads(path.read_bytes())
    if answer.predicted.shape != (count, 3) or not np.isfinite(answer.predicted).all():
        raise DataError(f"'{path}' must have {count} rows of three finite numbers")
    return answer
