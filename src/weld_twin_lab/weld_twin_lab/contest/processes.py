# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How a method is started: as any program, anew for every case."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from ..benchmark.costs import cost_of

SAID = 'said.txt'
"""What a method printed while it worked."""
LIMIT = 300.0
"""Seconds an answer may take; a fit that has not ended by then has lost its way."""


class Ended(NamedTuple):
    """How a run ended."""

    seconds: float
    """Of processor time, the start of the interpreter and its imports included [s]."""
    memory_bytes: int
    trouble: str = ''
    """The last that it said where it failed; empty where it did not."""


def ended(words: Sequence[str], case: Path, place: Path) -> Ended:
    """
    Have the answer to a case written to a place.

    words: the command of a method, with {case} and {out} in it.
    """
    filled = [word.replace('{case}', str(case)).replace('{out}', str(place)) for word in words]
    with (place / SAID).open('w', encoding='utf-8') as said:
        code, cost = cost_of(filled, said=said, limit=LIMIT)
    return Ended(cost.cpu, int(cost.peak), _trouble(place, code))


def _trouble(place: Path, code: int) -> str:
    """Return the last line that a program said before it failed; nothing where it did not."""
    if code == 0:
        return ''
    lines = (place / SAID).read_text(encoding='utf-8').strip().splitlines()
    return lines[-1] if lines else f'exit code {code}'
