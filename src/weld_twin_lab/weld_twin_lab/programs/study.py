# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""All languages one after the other, each kept as soon as it is done."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from weld_twin_msgs_py.files import markdown
from weld_twin_nodes.offline.task_pool import Task

from ..study import Parts, head
from .broken import fuzz
from .cells import CELLS
from .round_trips import round_trips

PARTS = 'parts'


def read(drawn: int, broken: int, made: Path, part: Parts) -> dict[str, Any]:
    """
    Return how every language is read.

    Parameters
    ----------
    drawn, broken : int
        Programs of each language.
    made : Path
        Folder of programs as users have them.
    part : Parts
        Keeps every language.

    """
    trips, fuzzed = [], []
    for language in CELLS:
        trip = partial(round_trips, language, drawn)
        trips.append(part(f'round_trips_{language}', trip))
        trial = partial(fuzz, language, broken, _whole(language, made))
        fuzzed.append(part(f'fuzz_{language}', trial))
    return head('programs/1', round_trips=trips, fuzz=fuzzed)


def seams(seed: int, count: int, engine: str) -> list[Task]:
    """Return the correction of so many sealed seams of each language, language by language."""
    return [
        Task(corrected, (language, seed, k, engine), f'{language} {k}')
        for language in CELLS
        for k in range(count)
    ]


def urdf_arms(seed: int, count: int, engine: str) -> list[Task]:
    """Return the ways of so many arms that are given as URDFs."""
    return [Task(of_urdf, (seed, k, engine), f'arm {k}') for k in range(count)]


def head_of(seed: int, engine: str, totals: Any, cases: Sequence[Any]) -> dict[str, Any]:
    """Return the results of sealed cases."""
    return head('programs/1', engine=engine, seed=seed, totals=totals, cases=cases)


def of_urdf(seed: int, number: int, engine: str) -> dict[str, Any]:
    """
    Return what becomes of one arm; the simulator is loaded where it is needed.

    Parameters
    ----------
    seed, number : int
        Decide everything random in it.
    engine : str
        Only tells the results of one version of the core from those of another.

    """
    from ..blind.simulator import require_simulator

    require_simulator()
    from .urdf_trial import tried

    return tried(seed, number)


def corrected(language: str, seed: int, number: int, engine: str) -> dict[str, Any]:
    """
    Return what a correction does to one seam; the simulator is loaded where it is needed.

    Parameters
    ----------
    language : str
    seed, number : int
        Decide everything random in it.
    engine : str
        Only tells the results of one version of the core from those of another.

    """
    from ..blind.simulator import require_simulator

    require_simulator()
    from .corrections import corrected_seam

    return corrected_seam(language, seed, number)


def _whole(language: str, made: Path) -> list[list[str]]:
    """Return the texts of the hand-made programs of a language."""
    main = sorted(made.glob(f'*{CELLS[language].suffix}')) if made.is_dir() else []
    out = []
    for path in main:
        files = [path, *([path.with_suffix('.dat')] if language == 'krl' else [])]
        out.append([file.read_bytes().decode('latin-1') for file in files])
    return out


def summary(result: dict[str, Any]) -> str:
    """Return the results as tables in Markdown."""
    trips = [
        (e['language'], str(e['programs']), str(e['moves']), str(e['identical']))
        for e in result['round_trips']
    ]
    fuzzed = [
        (
            e['language'],
            str(e['programs']),
            str(e['refused']),
            str(e['read']),
            str(e['tracebacks']),
            str(e['silently_changed']),
        )
        for e in result['fuzz']
    ]
    heads = ('language', 'broken programs', 'refused', 'read', 'tracebacks', 'silently changed')
    return '\n'.join(
        [
            '## Round trips',
            '',
            markdown.table(('language', 'programs', 'moves', 'identical'), *trips),
            '',
            '## Broken programs',
            '',
            markdown.table(heads, *fuzzed),
            '',
        ]
    )
