# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What can be wrong with a cell: every flaw is a function, and says which part of the cell it is in.

A flaw is known to the plant by standing in a file of this folder:

    @flaw('tool')
    def wear(entry, here): ...

| part | the function takes | and returns |
|---|---|---|
| joint | entry, `Here` | how far the link is from its motor, (M,) [rad or m] |
| axis | entry, `Here` | how far the joint's axis leans, (M,) [rad] |
| base, tool | entry, `Here` | shift and turn of that frame, in its own axes, (M, 6) [m, rad] |
| hand | entry, `Here`, pose | the tool as it hangs at the arm |
| stand, sight | entry, `Here`, pose | the pose from where the instrument stands; then as it is seen |

What acts through masses and springs is worked out together, in `drives`, `compliance` and `tree`;
these flaws, and the plain ones of geometry and gearing, are listed in `textbook_effects`.
"""

from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any, NamedTuple

import numpy as np

from . import exponentials
from .exponentials import Arm, Entry, Motion
from .textbook_effects import LIBRARY, Causes

PARTS = ('joint', 'axis', 'base', 'tool', 'hand', 'stand', 'sight')
_FLAWS: dict[str, dict[str, Callable[..., Any]]] = {part: {} for part in PARTS}
"""By part and by name."""


class Here(NamedTuple):
    """What a flaw may look at: the cell at some instants."""

    causes: Causes
    arm: Arm
    t: np.ndarray
    """Since the recording's first stamp, shape (M,) [s]."""
    q: np.ndarray
    """Motor side, shape (M, n); a sequence in time."""
    richness: float
    rng: np.random.Generator
    wrench: np.ndarray | None = None
    """On the tool, in its frame, shape (M, 6) [N, N m]; what a pose is seen with."""
    torque: Callable[[], np.ndarray] = lambda: np.zeros((0, 0))
    """Gives the load torque, shape (M, n), to what displaces a joint; asked only where needed."""


F = Callable[..., Any]


def flaw(part: str) -> Callable[[F], F]:
    """Return what makes a function known as a flaw of a part, by its own name."""

    def keep(function: F) -> F:
        _FLAWS[part][function.__name__] = function
        return function

    return keep


@cache
def known() -> frozenset[str]:
    """Return the names of all flaws that an effects file may have."""
    for file in iter_modules([str(Path(__file__).parent)]):
        try:
            import_module(f'.{file.name}', __package__)
        except ModuleNotFoundError as error:
            if error.name != 'mujoco':  # without it nothing is simulated, and all can be named
                raise
    return LIBRARY.union(*_FLAWS.values())


def _of(part: str, causes: Causes) -> list[tuple[F, list[Entry]]]:
    """Return the flaws of a part that are at work, in the order of their names."""
    each = [(_FLAWS[part][name], list(causes.of(name))) for name in sorted(_FLAWS[part])]
    return [(function, items) for function, items in each if items]


def on_joints(here: Here, part: str = 'joint') -> np.ndarray:
    """Return the displacement of all links, or the lean of all axes, shape (M, n) [rad or m]."""
    out = np.zeros_like(here.q)
    for item in here.causes.items:
        function = _FLAWS[part].get(item['effect'])
        if function is not None:
            out[:, here.causes.joint(item['joint'])] += function(item, here)
    return out


def any_on_joints(causes: Causes) -> bool:
    """Return whether a flaw of the joints is at work."""
    return bool(_of('joint', causes))


def frame(part: str, here: Here) -> Motion:
    """Return how far the base or the tool is from where the arm's file has it, (M,)."""
    total = exponentials.identity()
    for function, items in _of(part, here.causes):
        moved = sum(function(item, here) for item in items)
        total = exponentials.compose(total, exponentials.from_rotvec(moved[:, 3:], moved[:, :3]))
    return total


def seen(here: Here, pose: Motion, *parts: str) -> Motion:
    """Return a pose as the flaws of some parts leave it, one part after the other."""
    for part in parts:
        for function, items in _of(part, here.causes):
            for item in items:
                pose = function(item, here, pose)
    return pose
