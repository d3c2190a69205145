# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""All languages one after the other, each kept as soon as it is done."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from weld_twin_core import __version__
from weld_twin_msgs_py.files import markdown
from weld_twin_msgs_py.files.whole_files import write_text

from .broken import fuzz
from .cells import CELLS
from .round_trips import round_trips

RESULTS, TABLE, PARTS = 'programs.json', 'programs.md', 'parts'
SCHEMA = 'weld_twin/programs/1'
MADE = Path('test/programs/made')
"""Programs as users have them, from the top of the source tree; left out where there are none."""
SEAM_HEADS = (
    'language',
    'robot',
    'causes',
    'verdict',
    'worst before, mm',
    'after',
    'true causes',
    'RMS before, mm',
    'after',
    'true causes',
    'worst, over true causes',
)
"""Heads of the table of corrected seams."""
Tell = Callable[[str], None]


def study(
    out: Path,
    drawn: int,
    broken: int,
    seams: int,
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
    seams : int
        Seams of each language that are recorded, diagnosed, corrected and driven.
    made : Path
        Folder of programs as users have them.
    tell : callable
        Told what is being done.

    """
    (out / PARTS).mkdir(parents=True, exist_ok=True)
    trips, fuzzed = [], []
    for language in CELLS:
        trip = partial(round_trips, language, drawn)
        trips.append(_kept(out, f'round_trips_{language}', trip, tell))
        trial = partial(fuzz, language, broken, _whole(language, made))
        fuzzed.append(_kept(out, f'fuzz_{language}', trial, tell))
    driven = [
        _kept(out, f'seam_{seed}_{language}', partial(_correction, language, seed), tell)
        for seed in range(seams)
        for language in CELLS
    ]
    result = {
        'schema': SCHEMA,
        'version': __version__,
        'round_trips': trips,
        'fuzz': fuzzed,
        'corrections': driven,
    }
    write_text(out / RESULTS, json.dumps(result, indent=1) + '\n', overwrite=True)
    write_text(out / TABLE, summary(result), overwrite=True)
    return result


def _correction(language: str, seed: int) -> dict[str, Any]:
    """Return what a correction does; the simulator is loaded where it is needed."""
    from ..blind.simulator import require_simulator

    require_simulator()
    from .corrections import correction

    return correction(language, seed)


def _whole(language: str, made: Path) -> list[list[str]]:
    """Return the texts of the hand-made programs of a language."""
    main = sorted(made.glob(f'*{CELLS[language].suffix}')) if made.is_dir() else []
    out = []
    for path in main:
        files = [path, *([path.with_suffix('.dat')] if language == 'krl' else [])]
        out.append([file.read_bytes().decode('latin-1') for file in files])
    return out


def _kept(out: Path, name: str, make: Callable[[], dict[str, Any]], tell: Tell) -> dict[str, Any]:
    path = out / PARTS / f'{name}.json'
    if not path.exists():
        tell(name)
        write_text(path, json.dumps(make(), indent=1) + '\n')
    entry: dict[str, Any] = json.loads(path.read_text(encoding='utf-8'))
    return entry


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
    driven = [_seam_row(entry) for entry in result['corrections']]
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
            '## Corrected seams, run by the plant',
            '',
            markdown.table(SEAM_HEADS, *driven),
            '',
        ]
    )


def _seam_row(entry: dict[str, Any]) -> tuple[str, ...]:
    worst, rms = entry['path_error_m'], entry['rms_m']
    causes = ', '.join(f'{cause["effect"]} of {cause["joint"]}' for cause in entry['causes'])
    columns = [
        f'{1e3 * size[key]:.3f}'
        for size in (worst, rms)
        for key in ('before', 'after', 'true_causes')
    ]
    ratio = worst['after'] / max(worst['true_causes'], 1e-9)
    verdict = f'{entry["status"]}, left as it was' if entry['left'] else entry['status']
    return (entry['language'], entry['robot'], causes, verdict, *columns, f'{ratio:.2f}')
