# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Nodes as forks of one process that has them all loaded: each costs a tenth of a new interpreter."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from ..live.all_nodes import MODULES

CONTEXT = multiprocessing.get_context('forkserver')


class Forked:
    """A running node, a fork, with what the harness asks of `subprocess.Popen`."""

    def __init__(self, module: str, words: Sequence[str], log: Path) -> None:
        CONTEXT.set_forkserver_preload(list(MODULES.values()))
        # The server keeps the environment and the place that it was started with.
        given = (module, list(words), str(log), dict(os.environ), os.getcwd())
        self._process = CONTEXT.Process(target=_run, args=given)
        self._process.start()
        assert self._process.pid is not None
        self.pid = self._process.pid

    def poll(self) -> int | None:
        """Return the exit code, None while it runs."""
        return self._process.exitcode

    def wait(self, timeout: float | None = None) -> int:
        """Wait for the end [s]; return the exit code, or raise subprocess.TimeoutExpired."""
        self._process.join(timeout)
        code = self.poll()
        if code is None:
            raise subprocess.TimeoutExpired(str(self._process.name), timeout or 0.0)
        return code

    def send_signal(self, number: int) -> None:
        """Send a signal, if it still runs."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        """End it as it is."""
        self.send_signal(signal.SIGKILL)


def _run(module: str, words: list[str], log: str, variables: dict[str, str], place: str) -> None:
    """Become the program, in a session and with a log of its own."""
    os.setsid()
    file = os.open(log, os.O_WRONLY | os.O_APPEND)
    for stream in (1, 2):
        os.dup2(file, stream)
    os.environ.clear()
    os.environ.update(variables)
    os.chdir(place)
    loaded = import_module(module)
    sys.argv = [str(loaded.__file__), *words]
    raise SystemExit(loaded.main())
