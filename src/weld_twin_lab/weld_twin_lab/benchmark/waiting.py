# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What people wait for: whole commands, started cold, beside the same commands of another version."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from weld_twin_core.errors import DataError

from ..study import Study, engine_digest, tabled
from . import waiting_data as data
from .race import Cost, cost_of

Entry = dict[str, Any]
"""What one job costs, and when and with which versions that was measured."""
Keep = Callable[[Entry], None]


@dataclass(frozen=True)
class WaitingJob:
    """Something that a person waits for."""

    name: str
    words: tuple[str, ...]
    """What the interpreter is started with; '{out}' is a place that does not exist yet."""
    needs: str = ''
    """Which data must be there, as `waiting_data.MAKERS` names them; '{data}' in the words."""
    divided_by: int = 1
    """Pieces of work that one run does."""
    once: bool = False
    """Takes so long that it is run once."""


_CLI = ('-m', 'weld_twin_nodes')
_READ = """
import sys
from weld_twin_core.arm.catalog import load

try:
    from weld_twin_msgs_py.bags import read_recording
except ImportError:  # where it was in earlier versions
    from weld_twin_nodes.streams.read_recording import read_recording
read_recording(sys.argv[1], load('ur5'))
"""
CASES = 4
"""Sealed cases that are diagnosed; the time is told for one."""
JOBS = (
    WaitingJob('`weld-twin --help`', (*_CLI, '--help')),
    WaitingJob('`import weld_twin_core`', ('-c', 'import weld_twin_core')),
    WaitingJob('`import weld_twin_core.diagnosis`', ('-c', 'import weld_twin_core.diagnosis')),
    WaitingJob(
        'diagnose 60 s of motion, page included',
        (*_CLI, 'diagnose', '{data}', '--robot', 'ur5', '--out', '{out}'),
        'motion',
    ),
    WaitingJob(
        'diagnose 2,772 stations, six-dimensional, ripple of all orders',
        (*_CLI, 'diagnose', '{data}', '--robot', 'ur10', '--align', 'base', '--out', '{out}'),
        'stations',
        once=True,
    ),
    WaitingJob(
        'diagnose one hour of motion',
        (*_CLI, 'diagnose', '{data}', '--robot', 'ur5', '--out', '{out}'),
        'hour',
        once=True,
    ),
    WaitingJob('read ten minutes of bag (111,000 messages)', ('-c', _READ, '{data}'), 'minutes'),
    WaitingJob(
        'read an hour of bag (666,000 messages)', ('-c', _READ, '{data}'), 'hour', once=True
    ),
    WaitingJob(
        'import a table of 100,000 rows',
        (*_CLI, 'import', '{data}', '--robot', 'ur5', '--out', '{out}'),
        'table',
    ),
    WaitingJob(
        'pages of 200 cells with 50 diagnoses each',
        (*_CLI, 'history', 'page', '--db', '{data}/plant.db', '--out', '{out}'),
        'plant',
        once=True,
    ),
    WaitingJob(
        'sensitivity study with page',
        (*_CLI, 'sensitivity', '--robot', 'ur5', '--out', '{out}'),
        once=True,
    ),
    WaitingJob(
        'claims of the paper, 7 robots x 3 seams',
        (*_CLI, 'sensitivity', '--claims', '--out', '{out}'),
        once=True,
    ),
    WaitingJob(
        'a sealed blind case: made, diagnosed, scored',
        (
            *_CLI,
            *('blind', 'run', '--cases', str(CASES), '--seed', '99', '--workers', '1'),
            *('--kinds', 'single', '--out', '{out}'),
        ),
        divided_by=CASES,
        once=True,
    ),
)


def measured(
    base: Path | None, out: Path, runs: int, only: Sequence[str], keep: Keep
) -> list[Entry]:
    """
    Return what every job costs, here and in another checkout with an environment of its own, in turn.

    runs: pairs of runs after one to warm up.

    Raises DataError: there is no environment in ``base``, no such job, or a command fails here.
    """
    pythons = {'here': sys.executable}
    if base is not None:
        other = base / '.venv' / 'bin' / 'python'
        if not other.exists():
            raise DataError(f"there is no '{other}'; run make setup in '{base}' first")
        pythons['base'] = str(other.absolute())
    wanted = [job for job in JOBS if not only or any(part in job.name for part in only)]
    if not wanted:
        raise DataError(f'no job is called {", ".join(only)}; leave --only out to see all')
    out.mkdir(parents=True, exist_ok=True)
    versions = {'engine': engine_digest()[:16], 'commit': commit_of(Path(__file__).parent)}
    if base is not None:
        versions['base'] = commit_of(base)
    entries = []
    for job in wanted:
        # Others on the machine: with them, seconds on the clock mean little.
        about = {**versions, 'on': date.today().isoformat(), 'load': os.getloadavg()[0]}
        entries.append({**_entry(job, pythons, out, runs), 'measured': about})
        keep(entries[-1])
    return entries


def commit_of(place: Path) -> str:
    """Return the commit of a checkout, with '+' where files differ from it; '' for no checkout."""
    try:
        said = subprocess.run(
            ['git', '-C', str(place), 'describe', '--always', '--abbrev=7', '--dirty=+']
            + ['--exclude=*'],
            capture_output=True,
            text=True,
            check=False,
        )
    except OSError:  # no git here
        return ''
    return said.stdout.strip()


def merged(kept: Sequence[Entry], new: Sequence[Entry]) -> list[Entry]:
    """Return entries of `measured` with new ones in their places; what is no job any more is out."""
    by_job = {entry['job']: entry for entry in (*kept, *new)}
    return [by_job[job.name] for job in JOBS if job.name in by_job]


def _entry(job: WaitingJob, pythons: dict[str, str], out: Path, runs: int) -> Entry:
    place = data.made(job.needs, out) if job.needs else Path()
    costs: dict[str, list[Cost]] = {name: [] for name in pythons}
    for turn in range(1 if job.once else runs + 1):
        for name, python in pythons.items():
            cost = _run([python, *job.words], place, out / 'written')
            if cost is None and name == 'here':
                raise DataError(f'the command of {job.name!r} fails; run it by hand to see why')
            if cost is not None and (turn or job.once):
                costs[name].append(cost)
    entry: Entry = {'job': job.name, 'runs': len(costs['here'])}
    for name, own in costs.items():
        if own:
            wall, cpu, peak = np.median(np.array(own), axis=0)
            shares = (float(wall) / job.divided_by, float(cpu) / job.divided_by, float(peak))
            entry[name] = dict(zip(Cost._fields, shares, strict=True))
    if costs.get('base'):
        pairs = np.array(costs['here']) / np.array(costs['base'])
        ratio = [float(v) for v in np.median(pairs, axis=0)]
        entry['ratio'] = dict(zip(Cost._fields, ratio, strict=True))
    return entry


def _run(words: Sequence[str], place: Path, written: Path) -> Cost | None:
    shutil.rmtree(written, ignore_errors=True)
    filled = [word.replace('{data}', str(place)).replace('{out}', str(written)) for word in words]
    # An installed program is compiled once, whatever the shell of this run says of that.
    odd = ('PYTHONPATH', 'PYTHONDONTWRITEBYTECODE')
    quiet = {key: value for key, value in os.environ.items() if key not in odd}
    code, cost = cost_of(filled, environment=quiet)
    shutil.rmtree(written, ignore_errors=True)
    return cost if code == 0 else None


def page(entries: Sequence[Entry]) -> str:
    return (
        '# What people wait for\n\n'
        'Whole commands, started cold, by `weld-twin lab waits`. Ratios are medians of pairs of '
        'runs; the cases, robots and effects of an earlier version are fewer, so its blind cases '
        'are not the same. Memory is that of the largest process. A row tells the day and the '
        'commit it was measured on, and how many others were at work on the machine (its load).'
        '\n\n' + summary(entries)
    )


def summary(entries: Sequence[Entry]) -> str:
    return tabled(COLUMNS, entries)


def _costs(cost: dict[str, Any] | None) -> str:
    if cost is None:
        return ''
    return f'{cost["wall"]:.3g}, {cost["cpu"]:.3g}, {_megabytes(cost["peak"])}'


def _faster(ratio: dict[str, Any] | None) -> str:
    return '' if ratio is None else f'{1 / ratio["wall"]:.2f}, {1 / ratio["cpu"]:.2f}'


def _smaller(ratio: dict[str, Any] | None) -> str:
    return '' if ratio is None or ratio['peak'] is None else f'{ratio["peak"]:.2f}'


def _megabytes(peak: float | None) -> str:
    """Return memory [bytes] in MB; '-' where only the process that measured was seen."""
    return '-' if peak is None else f'{peak / 1e6:.0f}'


def _when(entry: Entry) -> str:
    about = entry.get('measured')
    if about is None:  # entries of earlier versions do not say
        return ''
    beside = f' beside {about["base"]}' if about.get('base') else ''
    load = '' if about.get('load') is None else f', load {about["load"]:.1f}'
    return f'{about["on"]}, {about["commit"]}{beside}{load}'


COLUMNS: dict[str, Callable[[Entry], object]] = {
    'job': lambda entry: entry['job'],
    'wall [s]': lambda entry: f'{entry["here"]["wall"]:.3g}',
    'processor [s]': lambda entry: f'{entry["here"]["cpu"]:.3g}',
    'memory [MB]': lambda entry: _megabytes(entry['here']['peak']),
    'before: wall, processor, memory': lambda entry: _costs(entry.get('base')),
    'times as fast: wall, processor': lambda entry: _faster(entry.get('ratio')),
    'share of the memory': lambda entry: _smaller(entry.get('ratio')),
    'measured': _when,
}
"""Columns of the table."""


def run(study: Study) -> None:
    args = study.args
    kept = _kept(study.out / 'waits.json') if args.only else []
    base = Path(args.base) if args.base else None

    def keep(entry: Entry) -> None:
        nonlocal kept
        study.tell(f'{entry["job"]}: {entry}')
        kept = merged(kept, [entry])
        study.write('waits', kept, page(kept), say=False)

    with TemporaryDirectory() as folder:
        measured(base, Path(folder), max(args.runs, 1), args.only, keep)
    print(summary(kept))


def _kept(file: Path) -> list[Entry]:
    if not file.exists():
        return []
    try:
        entries: list[Entry] = json.loads(file.read_text(encoding='utf-8'))
    except ValueError:
        raise DataError(f"'{file}' is damaged; remove it to measure all jobs anew") from None
    return entries
