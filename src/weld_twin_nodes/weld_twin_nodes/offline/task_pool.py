# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Many independent tasks, on the cores of this machine or on a Dask cluster, and resumable.

A task is a function of a module and its arguments, and returns plain data (what JSON can hold,
arrays become lists). Wherever a task runs, its result passes through JSON, so that a study on one
core, on many, on a cluster and one that was resumed give identical numbers.

Results are kept by a name for the content of values: equal content, equal name, on every machine.
"""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from dataclasses import dataclass, fields, is_dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from weld_twin_core import __version__
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.whole_files import write_text

from .environment import THREADS, environment


def digest(*values: Any) -> str:
    """Return 32 hexadecimal digits that stand for plain values, arrays, functions, dataclasses."""
    state = hashlib.sha256()
    for value in values:
        _feed(state, value)
    return state.hexdigest()[:32]


def _feed(state: Any, value: Any) -> None:
    if isinstance(value, np.ndarray | np.generic):
        array = np.ascontiguousarray(value)
        state.update(f'a{array.dtype.str}{array.shape}'.encode())
        state.update(array.tobytes())
    elif value is None or isinstance(value, bool | int | float | str | bytes):
        text = repr(value).encode()
        state.update(f'{type(value).__name__}{len(text)}:'.encode() + text)
    elif isinstance(value, type) or (callable(value) and not is_dataclass(value)):
        _feed(state, f'{value.__module__}.{value.__qualname__}')
    elif is_dataclass(value):
        _feed(state, type(value))
        for field in fields(value):
            _feed(state, field.name)
            _feed(state, getattr(value, field.name))
    elif isinstance(value, Mapping):
        state.update(f'm{len(value)}'.encode())
        for key in sorted(value, key=repr):
            _feed(state, key)
            _feed(state, value[key])
    elif isinstance(value, Sequence | frozenset | set):
        items = sorted(value, key=repr) if isinstance(value, frozenset | set) else value
        state.update(f's{len(value)}'.encode())
        for item in items:
            _feed(state, item)
    else:
        raise DataError(f'a {type(value).__name__} has no content to name a task by')


Plain = Any
"""What JSON can hold."""
Tell = Callable[[int, int, str], None]
"""Called with how many tasks are done, how many there are, and what the last was."""


@dataclass(frozen=True, eq=False)
class Task:
    """A function of a module, its arguments, and what progress calls it."""

    function: Callable[..., Plain]
    arguments: tuple[Any, ...]
    label: str = ''

    @property
    def key(self) -> str:
        return digest(__version__, self.function, *self.arguments)


class Pool(Protocol):
    """Where tasks run."""

    def run(self, tasks: Sequence[Task]) -> Iterator[tuple[int, str]]:
        """Yield the number of each task and its result as JSON text, in order of completion."""

    def close(self) -> None:
        """Let go of the workers."""


class Runner:
    """Runs tasks on a pool and keeps their results in ``store``, to ask for none again."""

    def __init__(self, pool: Pool, store: Path | None = None, tell: Tell | None = None) -> None:
        self._pool, self._store, self._tell = pool, store, tell

    def __enter__(self) -> Runner:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.close()

    def run(
        self, tasks: Sequence[Task], meanwhile: Callable[[], object] | None = None
    ) -> list[Plain]:
        """Return the results in the order of the tasks; ``meanwhile``: done while others work."""
        results: list[Plain] = [None] * len(tasks)
        waiting = []
        for k, task in enumerate(tasks):
            text = self._kept(task)
            if text is None:
                waiting.append(k)
            else:
                results[k] = json.loads(text)
        done = len(tasks) - len(waiting)
        if done:
            self._report(done, len(tasks), f'{done} results were there already')
        coming = self._pool.run([tasks[k] for k in waiting])
        if meanwhile is not None:
            meanwhile()
        for place, text in coming:
            k = waiting[place]
            results[k] = json.loads(text)
            self._keep(tasks[k], text)
            done += 1
            self._report(done, len(tasks), tasks[k].label)
        return results

    def _report(self, done: int, total: int, label: str) -> None:
        if self._tell is not None:
            self._tell(done, total, label)

    def _file(self, task: Task) -> Path | None:
        return None if self._store is None else self._store / f'{task.key}.json'

    def _kept(self, task: Task) -> str | None:
        file = self._file(task)
        if file is None or not file.is_file():
            return None
        text = file.read_text(encoding='utf-8')
        try:
            json.loads(text)
        except ValueError:
            raise DataError(f"'{file}' is damaged; delete it to have it made again") from None
        return text

    def _keep(self, task: Task, text: str) -> None:
        file = self._file(task)
        if file is not None:
            write_text(file, text, overwrite=True)


@dataclass(frozen=True)
class Here:
    """The process that asks; for tests and for tasks too small to send anywhere."""

    def run(self, tasks: Sequence[Task]) -> Iterator[tuple[int, str]]:
        """Run one after the other."""
        for k, task in enumerate(tasks):
            yield k, call(task.function, task.arguments)

    def close(self) -> None:
        """Do nothing."""


class Cores:
    """
    Processes on this machine, each with one thread, that begin to import a module ``ahead``.

    The processes start anew, so that no library has chosen its threads before.
    """

    def __init__(self, workers: int = 0, ahead: str = '') -> None:
        self._workers = workers or available_cores()
        self._pool: ProcessPoolExecutor | None = None
        self._asked: list[Future[Any]] = []
        if ahead:
            self._submitted([(import_module, (ahead,))] * self._workers)

    def run(self, tasks: Sequence[Task]) -> Iterator[tuple[int, str]]:
        """Run as many at once as there are workers; they begin before a result is asked for."""
        asked = [(call, (task.function, task.arguments)) for task in tasks]
        return self._completed({future: k for k, future in enumerate(self._submitted(asked))})

    def _submitted(self, asked: Sequence[tuple[Callable[..., Any], Any]]) -> list[Future[Any]]:
        if self._pool is None:
            context = multiprocessing.get_context('spawn')
            self._pool = ProcessPoolExecutor(
                self._workers, mp_context=context, initializer=_leave_interrupts
            )
        with environment(**dict.fromkeys(THREADS, '1')):
            new = [self._pool.submit(function, *arguments) for function, arguments in asked]
        self._asked = [*(future for future in self._asked if not future.done()), *new]
        return new

    def _completed(self, futures: dict[Future[str], int]) -> Iterator[tuple[int, str]]:
        for future in as_completed(futures):
            yield futures[future], future.result()

    def close(self) -> None:
        """Stop the processes; what has not ended is given up, as nobody waits for it any more."""
        if self._pool is None:
            return
        if not all(future.done() for future in self._asked):
            for process in [*self._pool._processes.values()]:  # no public way before Python 3.14
                process.terminate()
        self._pool.shutdown(cancel_futures=True)
        self._pool, self._asked = None, []


class Cluster:
    """A Dask cluster, at the address of its scheduler, whose workers have this package."""

    def __init__(self, address: str) -> None:
        self._client, self._completed = _connected(address)

    def run(self, tasks: Sequence[Task]) -> Iterator[tuple[int, str]]:
        """Run on the cluster's workers; they begin before a result is asked for."""
        futures = {
            self._client.submit(call, task.function, task.arguments, pure=False): k
            for k, task in enumerate(tasks)
        }
        return ((futures[f], f.result()) for f in self._completed(list(futures)))

    def close(self) -> None:
        """Leave the cluster; what has not begun is not run."""
        self._client.close()


def pool_of(scheduler: str = '', workers: int = 0, ahead: str = '') -> Pool:
    """Return the cluster at an address, or so many cores of this machine, all of them for 0."""
    if workers < 0:
        raise DataError(f'the number of workers must not be negative, got {workers}')
    return Cluster(scheduler) if scheduler else Cores(workers, ahead)


def _leave_interrupts() -> None:
    """
    Leave Ctrl-C to the process that asks, which ends this one.

    A worker interrupted while it takes a task keeps the lock of the queue: nobody would end.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def available_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, 'sched_getaffinity'):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def call(function: Callable[..., Plain], arguments: tuple[Any, ...]) -> str:
    """Return the result of a task as JSON text; every float reads back exactly."""
    return json.dumps(function(*arguments), default=_plain)


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise TypeError(f'a task returned a {type(value).__name__}, which JSON cannot hold')


def _connected(address: str) -> tuple[Any, Callable[..., Any]]:
    try:
        from distributed import Client, as_completed
    except ImportError:
        raise DataError(
            "--scheduler needs Dask; install it with: pip install 'weld-twin[cluster]'"
        ) from None
    try:
        return Client(address, timeout='10s'), as_completed
    except (OSError, ValueError) as error:
        raise DataError(f"no Dask scheduler answers at '{address}': {error}") from None
