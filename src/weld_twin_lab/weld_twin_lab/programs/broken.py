# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Programs broken at random: refused in words, or read so that only moved points change."""

from __future__ import annotations

import random
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from weld_twin_core.errors import TwinError
from weld_twin_core.motion.programs import travel
from weld_twin_msgs_py.programs import (
    Program,
    check_written,
    read_sources,
    rewritten,
    to_moves,
)
from weld_twin_msgs_py.programs.source import NUMBER, Source

from .cells import CELLS, context_of
from .drawn import drawn

SHIFT = 1e-4
"""By how much [m or rad] points are moved to see that nothing else is."""
RUN = 20
"""Of so many broken programs one is also followed move by move, which takes longest."""


def broken(text: str, draw: random.Random) -> str:
    """Return a text with a few of its characters lost, doubled or swapped."""
    for _ in range(draw.randint(1, 4)):
        at = draw.randrange(max(len(text), 1))
        cut = at + draw.randint(1, 12)
        letters = draw.choice('[]{}(),;:.-+eE 0x"!#\\\'\n')
        text = draw.choice(
            [
                text[:at] + text[cut:],
                text[:at] + text[at:cut] * 2 + text[cut:],
                text[:at] + letters + text[at + 1 :],
                text[:cut],
            ]
        )
    return text or ' '


def fuzz(
    language: str, count: int, whole: Sequence[Sequence[str]], seed: int = 0
) -> dict[str, Any]:
    """
    Return what became of broken programs.

    Parameters
    ----------
    language : str
    count : int
    whole : sequence of sequence of str
        Programs as users have them, broken beside drawn ones; a text for every file.
    seed : int

    """
    draw = random.Random(f'{seed} {language}')
    drawn_ones = [[drawn(language, np.random.default_rng([seed, k])).text] for k in range(20)]
    stock = [*whole, *drawn_ones]
    out = {'language': language, 'programs': count, 'refused': 0, 'read': 0}
    tracebacks: list[str] = []
    silent: list[str] = []
    for k in range(count):
        texts = [broken(text, draw) for text in draw.choice(stock)]
        try:
            why = _changed(language, texts, follow=k % RUN == 0)
        except TwinError as error:
            out['refused'] += 1  # type: ignore[operator]
            if not re.search(r'line \d+', str(error)):
                silent.append(f'{k}: refused without a line: {error}')
            continue
        except Exception as error:
            tracebacks.append(f'{k}: {type(error).__name__}: {error}')
            continue
        out['read'] += 1  # type: ignore[operator]
        if why:
            silent.append(f'{k}: {why}')
    return out | {
        'tracebacks': len(tracebacks),
        'silently_changed': len(silent),
        'wrong': [*tracebacks[:5], *silent[:5]],
    }


def _changed(language: str, texts: Sequence[str], *, follow: bool) -> str:
    """Return what changed besides the points that were moved; empty for nothing."""
    program = _read(language, texts)
    points = [point.value.copy() for point in program.points]
    if rewritten(program, points, range(len(points))) != list(texts):
        return 'it does not come back byte for byte'
    for point in points:
        point[..., -1] += [SHIFT, -SHIFT, SHIFT, 0.0] if point.ndim == 2 else SHIFT
    again = rewritten(program, points, range(len(points)))
    check_written(program, _read(language, again), points)
    if [re.sub(NUMBER, '', t) for t in again] != [re.sub(NUMBER, '', t) for t in texts]:
        return 'more than digits changed'
    if follow:
        context = context_of(language, np.eye(4))
        travel(context.robot, to_moves(program, context.robot, context.controller))
    return ''


def _read(language: str, texts: Sequence[str]) -> Program:
    context = context_of(language, np.eye(4))
    sources = [Source(f'broken{CELLS[language].suffix}', text) for text in texts]
    return read_sources(sources, context, language)
