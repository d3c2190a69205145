# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A pool of threads, each of which waits for a process of its own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed

from weld_twin_core.errors import DataError
from weld_twin_nodes.offline.task_pool import Task, available_cores, call

from ..guarded import Guarded


class Threads:
    """
    Runs tasks that let a process do their work.

    Parameters
    ----------
    workers : int
        0 means one for every core.

    """

    def __init__(self, workers: int = 0) -> None:
        if workers < 0:
            raise DataError(f'the number of workers must not be negative, got {workers}')
        self._pool = ThreadPoolExecutor(workers or available_cores())

    def run(self, tasks: Sequence[Task]) -> Iterator[tuple[int, str]]:
        """Yield the number of each task and its result, in order of completion."""
        futures: dict[Future[str], int] = {
            self._pool.submit(call, task.function, task.arguments): k
            for k, task in enumerate(tasks)
        }
        for future in as_completed(futures):
            yield futures.pop(future), future.result()

    def close(self) -> None:
        """Begin nothing more, and end what runs."""
        self._pool.shutdown(wait=False, cancel_futures=True)
        Guarded.end_all()
        self._pool.shutdown()
