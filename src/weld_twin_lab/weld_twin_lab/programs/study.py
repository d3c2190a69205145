# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""All languages one after the other, each kept as soon as it is done."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from weld_twin_core import __version__
from weld_twin_msgs_py.files import markdown
from weld_twin_nodes.offline.output_directory import write_owned
from weld_twin_nodes.offline.task_pool import Runner, Task

from ..parts import Parts, Tell, write_results
from . import correction_table, urdf_table
from .broken import fuzz
from .cells import CELLS
from .round_trips import round_trips

RESULTS, TABLE, PARTS = 'programs.json', 'programs.md', 'parts'
CORRECTIONS, CORRECTIONS_TABLE = 'corrections.json', 'corrections.md'
URDF_ARMS, URDF_TABLE = 'urdf_arms.json', 'urdf_arms.md'
SCHEMA = 'weld_twin/programs/1'
MADE = Path('test/programs/made')
"""Programs as users have them, from the top of the source tree; left out where there are none."""


def study(
    out: Path,
    drawn: int,
    broken: int,
    made: Path = MADE,
    tell: Tell = lambda text: None,
) -> dict[str, Any]:
    """
    Try every language that was not tried yet, and write the results.

    Parameters
    ----------
    out : Path
        Keeps a file for every part; a run that was interrupted goes on from there.
    drawn, broken : int
        Programs of each language.
    made : Path
        Folder of programs as users have them.
    tell : callable
        Told what is being done.

    """
    part = Parts(out / PARTS, tell)
    trips, fuzzed = [], []
    for language in CELLS:
        trip = partial(round_trips, language, drawn)
        trips.append(part(f'round_trips_{language}', trip))
        trial = partial(fuzz, language, broken, _whole(language, made))
        fuzzed.append(part(f'fuzz_{language}', trial))
    result = {
        'schema': SCHEMA,
        'version': __version__,
        'round_trips': trips,
        'fuzz': fuzzed,
    }
    write_results(out / RESULTS, result)
    write_owned(out / TABLE, summary(result))
    return result


def corrections(
    out: Path, seed: int, seams: int, runner: Runner, engine: str, languages: Sequence[str]
) -> dict[str, Any]:
    """
    Correct sealed seams, let the plant run them, and write the results.

    Parameters
    ----------
    out : Path
    seed : int
        Decides the seams.
    seams : int
        Of each language.
    runner : Runner
        Keeps what came of every seam; a run that was interrupted goes on from there.
    engine : str
        Tells the results of one version of the core from those of another.
    languages : sequence of str

    """
    tasks = [
        Task(corrected, (language, seed, k, engine), f'{language} {k}')
        for k in range(seams)
        for language in languages
    ]
    cases = sorted(runner.run(tasks), key=lambda case: list(CELLS).index(case['language']))
    result = {
        'schema': SCHEMA,
        'version': __version__,
        'engine': engine,
        'seed': seed,
        'totals': correction_table.totals(cases),
        'cases': cases,
    }
    out.mkdir(parents=True, exist_ok=True)
    write_results(out / CORRECTIONS, result)
    write_owned(out / CORRECTIONS_TABLE, correction_table.page(result))
    return result


def urdf_arms(out: Path, seed: int, arms: int, runner: Runner, engine: str) -> dict[str, Any]:
    """
    Take arms that are given as URDFs all the way, and write the results.

    Parameters
    ----------
    out : Path
    seed : int
        Decides the arms.
    arms : int
    runner : Runner
        Keeps what came of every arm; a run that was interrupted goes on from there.
    engine : str
        Tells the results of one version of the core from those of another.

    """
    tasks = [Task(of_urdf, (seed, k, engine), f'arm {k}') for k in range(arms)]
    cases = runner.run(tasks)
    result = {
        'schema': SCHEMA,
        'version': __version__,
        'engine': engine,
        'seed': seed,
        'totals': urdf_table.totals(cases),
        'cases': cases,
    }
    out.mkdir(parents=True, exist_ok=True)
    write_results(out / URDF_ARMS, result)
    write_owned(out / URDF_TABLE, urdf_table.page(result))
    return result


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
