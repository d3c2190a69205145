# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Before any cause: is the data sound?

Each check is one function of a `Case` in one table; it finds, names and never mends.
"""

from __future__ import annotations

from ..algebra.problem import Model, Problem
from ..frames.alignment import refined
from ..result import Check
from .clocks import clocks
from .evidence import Case, Checker
from .mixups import mixups
from .orientation import orientation
from .outliers import outliers
from .quantity import quantity
from .repeats import repeats
from .richness import motion
from .setup_change import Settling, Step, changes, moved_setup, settling, setup
from .source import source
from .stamp_regularity import stamps

__all__ = ['CHECKS', 'Settling', 'Step', 'changes', 'check', 'moved_setup', 'settling']

CHECKS: dict[str, tuple[Checker, str]] = {
    'quantity': (quantity, 'There is enough to work on.'),
    'units, signs, joints, robot': (mixups, 'Joints, positions and robot belong together.'),
    'orientation': (orientation, 'Orientations turn as the joints say.'),
    'clocks': (clocks, 'Joint and measurement stamps belong to one clock.'),
    'stamps': (stamps, 'Stamps come regularly and without gaps.'),
    'repeats': (repeats, 'Nothing was recorded twice.'),
    'source of the joints': (source, 'Joint positions are not plainly those of a command.'),
    'motion': (motion, 'Every joint moves, both ways, and the frames can be told apart.'),
    'outliers': (outliers, 'No measurement lies far off the rest.'),
    'set-up': (setup, 'The set-up did not move while it was measured.'),
}
"""Every check by name: the function, and what it says when it finds nothing."""
FIT_ROWS = 6000


def check(problem: Problem, model: Model) -> tuple[Check, ...]:
    """
    Return what was found in the data, check by check.

    Parameters
    ----------
    problem : Problem
    model : Model
        After `initial_frames`.

    Raises
    ------
    DataError
        There is nothing to work on.

    """
    if problem.align:
        model = refined(problem.thinned(FIT_ROWS), model)
    case = Case(problem, model)
    out: list[Check] = []
    for name, (look, passed) in CHECKS.items():
        found = [Check(name, f.level, f.sentence) for f in look(case)]
        out += found or [Check(name, 'ok', passed)]
    return tuple(out)
