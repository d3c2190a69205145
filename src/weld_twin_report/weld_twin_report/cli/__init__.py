# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The commands that write pages, and what several of them do alike."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from weld_twin_nodes.cli.given import Given

if TYPE_CHECKING:
    from rich.progress import Progress

    from ..guarded import Limits

GIGABYTE = 1_000_000_000
"""Bytes."""


def limits(given: Given) -> Limits:
    """Return what one diagnosis may take, by --memory and --minutes."""
    from ..guarded import Limits

    wall = max(round(60.0 * given.minutes), 1)
    return Limits(memory=round(given.memory * GIGABYTE), cpu_s=wall, wall_s=wall)


@contextmanager
def progress(text: str) -> Iterator[tuple[Progress, Callable[..., None]]]:
    """Yield a bar, shown on a terminal, and where to tell how many are done of how many."""
    from rich import progress as rich
    from rich.console import Console

    console = Console(stderr=True, highlight=False, soft_wrap=True)
    columns = (
        *('{task.description}', rich.BarColumn(), rich.MofNCompleteColumn()),
        *(rich.TimeElapsedColumn(), rich.TimeRemainingColumn()),
    )
    with rich.Progress(*columns, console=console, disable=not console.is_terminal) as bars:
        bar = bars.add_task(text, total=None)

        def tell(done: int, total: int, label: str = text) -> None:
            bars.update(bar, completed=done, total=total, description=label)

        yield bars, tell
