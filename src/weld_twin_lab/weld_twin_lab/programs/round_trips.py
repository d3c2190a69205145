# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Drawn programs read again: the same moves, the same bytes; and only what was moved, moved."""

from __future__ import annotations

from typing import Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_msgs_py.programs import Program, check_written, read_sources, rewritten
from weld_twin_msgs_py.programs.source import Source

from .cells import CELLS, context_of
from .drawn import Drawn, drawn

SHIFT = 1e-4
"""By how much [m or rad] points are moved to see that nothing else is."""


def round_trips(language: str, count: int, seed: int = 0) -> dict[str, Any]:
    """
    Return how many of the programs drawn come back as they were, with the first that do not.

    Parameters
    ----------
    language : str
    count : int
    seed : int

    """
    bad: list[str] = []
    moves = 0
    for k in range(count):
        rng = np.random.default_rng([seed, k, sorted(CELLS).index(language)])
        made = drawn(language, rng)
        moves += len(made.program.moves)
        why = _wrong(language, made)
        if why:
            bad.append(f'program {k}: {why}')
    return {
        'language': language,
        'programs': count,
        'moves': moves,
        'identical': count - len(bad),
        'wrong': bad[:5],
    }


def _wrong(language: str, made: Drawn) -> str:
    """Return what is wrong with a program that was read again; empty for nothing."""
    program = _read(language, made.text, made)
    found = _places(program, language)
    wanted = [
        move.q if _by_joints(language, move.kind) else move.pose for move in made.program.moves
    ]
    if language == 'joint-trajectory':
        wanted = [m.q for m in made.program.moves for _ in range(1 + (m.dwell > 0.0))]
    if len(found) != len(wanted):
        return f'{len(found)} moves instead of {len(wanted)}'
    rounding = CELLS[language].rounding
    for k, (one, other) in enumerate(zip(found, wanted, strict=True)):
        if one.shape != other.shape or np.abs(one - other).max() > rounding:
            return f'move {k} leads elsewhere'
    if _disagrees(language, made, program):
        return 'an independent reader reads it differently'
    points = [point.value.copy() for point in program.points]
    if rewritten(program, points, range(len(points))) != [made.text]:
        return 'it does not come back byte for byte'
    for point in points:
        point[..., -1] += [SHIFT, -SHIFT, SHIFT, 0.0] if point.ndim == 2 else SHIFT
    again = rewritten(program, points, range(len(points)))
    check_written(program, _read(language, again[0], made), points)
    return ''


def _read(language: str, text: str, made: Drawn) -> Program:
    context = context_of(language, made.program.tool)
    return read_sources([Source('drawn', text)], context, language)


def _by_joints(language: str, kind: str) -> bool:
    return kind == 'joint' or language in ('inform', 'fanuc-ls', 'joint-trajectory', 'csv')


def _places(program: Program, language: str) -> list[Array]:
    """Return where every move leads: joints of the model, or the pose in the robot's frame."""
    del language
    return [program.points[step.end.point].value for step in program.steps if step.end is not None]


def _disagrees(language: str, made: Drawn, program: Program) -> bool:
    """Tell whether an independent reader has other moves."""
    plain = [places[-1] for _, places in CELLS[language].reader([made.text])]
    own = _places(program, language)
    if len(plain) != len(own):
        return True
    origin = made.program.context.controller.origin
    pairs = zip(plain, own, strict=True)
    return any(np.abs(a - (b if b.ndim == 1 else origin @ b)).max() > 1e-9 for a, b in pairs)
