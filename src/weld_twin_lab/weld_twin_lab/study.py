# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
One way to run a study: its tasks, what is kept of them, and what it writes.

A study is a function of a `Study`, and a row of the table in `cli/lab.py`; it returns False where a goal
was missed. Tasks are kept in the folder of the study as soon as they are there, so that one that was
stopped goes on.
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import weld_twin_core
from weld_twin_core import __version__
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files import markdown
from weld_twin_nodes.cli.given import Given
from weld_twin_nodes.offline.output_directory import write_owned

if TYPE_CHECKING:
    from weld_twin_nodes.offline.task_pool import Runner, Task

_COPYRIGHT = (
    b'# Copyright 2026 weld_twin contributors\n',
    b'# SPDX-FileCopyrightText: weld_twin contributors\n',
)
"""The line of copyright is no part of the engine: its older form stands in digests of earlier
studies, so that they hold for the same engine."""
MISSED = 1
"""Exit code where a goal was not met."""
DONE = 'done'
"""Folder of what is kept of the tasks of a study, with a folder of each engine that did them."""


def listed(text: str) -> list[str]:
    return [part.strip() for part in text.split(',') if part.strip()]


class Study:
    def __init__(self, args: Given) -> None:
        self.args = args
        self.out = Path(args.out or '')

    @staticmethod
    def tell(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    @contextmanager
    def runner(self, what: str, store: Path | None = None) -> Iterator[Runner]:
        """
        Yield what runs tasks, shows how far they are, and keeps what came of them.

        store: folder of what is kept; left out, it is one of this engine's own, so that what another
        engine said is not taken for what this one says.
        """
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

        from weld_twin_nodes.offline.task_pool import Runner, pool_of

        console = Console(stderr=True)
        columns = ('{task.description}', BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
        with Progress(*columns, console=console, disable=not console.is_terminal) as progress:
            bar = progress.add_task(what, total=None)

            def tell(done: int, total: int, label: str) -> None:
                progress.update(bar, completed=done, total=total)

            pool = pool_of(self.args.scheduler, self.args.workers)
            with Runner(pool, store or kept_of_engine(self.out), tell) as runner:
                yield runner

    def tasks(self, tasks: Sequence[Task], what: str, store: Path | None = None) -> list[Any]:
        with self.runner(what, store) as runner:
            return runner.run(tasks)

    def write(
        self, name: str, result: Any = None, page: str | None = None, *, say: bool = True
    ) -> None:
        """Write the results as NAME.json, and their page as NAME.md; print the page, or not."""
        if result is not None:
            write_owned(self.out / f'{name}.json', json.dumps(result, indent=1) + '\n')
        if page is not None:
            write_owned(self.out / f'{name}.md', page)
            print(page if say else '', end='')


def engine_digest() -> str:
    """Return the SHA-256 over the source of the core: another engine, another digest."""
    place = Path(weld_twin_core.__file__).parent
    files = [file.read_bytes() for file in sorted(place.rglob('*.py'))]
    whole = [hashlib.sha256(text.replace(*_COPYRIGHT, 1)).hexdigest() for text in files]
    return hashlib.sha256('\n'.join(whole).encode()).hexdigest()


def kept_of_engine(folder: Path) -> Path:
    """Return where the tasks of a study are kept that this engine has done."""
    return folder / DONE / engine_digest()[:8]


def require_simulator() -> None:
    if find_spec('mujoco') is None:
        raise DataError(
            "cases are simulated with MuJoCo; install it with: pip install 'weld-twin[bench]'"
        )


def tabled(columns: Mapping[str, Callable[[Any], object]], rows: Iterable[Any]) -> str:
    cells = [[tell(row) for tell in columns.values()] for row in rows]
    return markdown.table(tuple(columns), *cells)


def shown(*keys: Any, by: str = '{}', times: float = 0.0, none: str = '') -> Callable[[Any], str]:
    """Return a column that tells what is deep in a row, at some keys, by a format; ``none`` for None."""

    def tell(row: Any) -> str:
        for key in keys:
            row = row[key]
        return none if row is None else by.format(times * row if times else row)

    return tell


def head(schema: str, **more: Any) -> dict[str, Any]:
    """Return what the results of a study begin with: what they are and what made them."""
    return {'schema': f'weld_twin/{schema}', 'version': __version__, **more}
