# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A node as a process of its own, with its parameters and its log, in a domain of the cell alone."""

import multiprocessing
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar

import yaml

from weld_twin_core.errors import TwinError

from ..live.settings import MODULES
from ..offline.environment import environment

DOMAINS = range(1, 102)
"""Domains whose ports stay clear of those Linux hands out by itself."""
FIRST, APART = 7400, 250
"""First port of domain 0, and how many ports a domain has: section 9.6.1 of the RTPS standard."""
LOCK_PORT = 5
"""Port of a domain that no participant takes: two are for multicast, its participants' begin at ten."""
TAKEN = range(10, APART)
"""Ports of a domain's participants: all of them, since a process numbers those of all its domains in
one row, so that its first one of a domain may have any number."""


@contextmanager
def own_domain() -> Iterator[int]:
    """
    Hold a domain that no other process of this machine holds in the same way, nor speaks in.

    A port of the domain is the lock, so that it holds for all users, whatever their folder for
    temporary files is, and is given back however the process ends. The environment names the
    domain meanwhile, and keeps discovery on this machine.
    """
    # Start somewhere else in every process: the domain is also somebody's who holds no lock.
    start = os.getpid() % len(DOMAINS)
    for domain in (*DOMAINS[start:], *DOMAINS[:start]):
        first = FIRST + APART * domain
        with ExitStack() as sockets:
            try:
                sockets.enter_context(_port(first + LOCK_PORT))
                for port in TAKEN:
                    _port(first + port).close()
            except OSError:
                continue
            with environment(ROS_DOMAIN_ID=str(domain), ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST'):
                yield domain
            return
    raise TwinError(f'all ROS domains from {DOMAINS[0]} to {DOMAINS[-1]} are in use here')


def _port(number: int) -> socket.socket:
    """Return a port that is bound; raise OSError where somebody has it."""
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        out.bind(('', number))
    except OSError:
        out.close()
        raise
    return out


GRACE = 20.0
"""Seconds a process has to end after SIGINT before it is killed."""
AGAIN = 1.0
"""Seconds after which it is told to end again."""
PATIENCE = 60.0
"""Seconds in which a process ends by itself, or never will: nine that load at once on two busy cores
have taken twenty."""
LOOK = 0.02
"""Seconds between two looks at whether a process has ended."""


class NodeProcess:
    """
    A running node.

    node: a node of this package, or a whole command.
    folder: where the parameter file and the log go.

    Attributes
    ----------
    known : bool
        Whether it is a node of this package, so that ``name`` is its name on the graph.
    forked : bool
        Whether nodes of this package are forks of one process that has them all loaded; one that
        starts many cells says so of the class. Else each is an interpreter of its own.

    """

    forked: ClassVar[bool] = False

    def __init__(
        self, node: str | Sequence[str], parameters: Mapping[str, Any], folder: Path
    ) -> None:
        self._interrupted = False
        self.known = isinstance(node, str)
        self.name = node if isinstance(node, str) else Path(node[0]).name
        self._log = folder / f'{self.name}.log'
        command = _command(node)
        if parameters:
            file = folder / f'{self.name}.yaml'
            file.write_text(yaml.safe_dump({'/**': {'ros__parameters': dict(parameters)}}))
            command += ['--ros-args', '--params-file', str(file)]
        self._process: subprocess.Popen[bytes] | Forked
        with self._log.open('w') as log, _interruptible():
            if self.known and NodeProcess.forked:
                self._process = Forked(command[2], command[3:], self._log)
            else:
                self._process = subprocess.Popen(
                    command, stdout=log, stderr=subprocess.STDOUT, start_new_session=True
                )

    @property
    def log(self) -> str:
        """Return what the process has written so far."""
        return self._log.read_text(errors='replace')

    @property
    def pid(self) -> int:
        """Return the number of the process."""
        return self._process.pid

    @property
    def code(self) -> int | None:
        """Return the exit code, None while it runs."""
        return self._process.poll()

    def signal(self, number: int) -> None:
        """Send a signal."""
        self._process.send_signal(number)

    def end(self, timeout: float = PATIENCE) -> int:
        """Wait for the process to end by itself; return its exit code."""
        return self._process.wait(timeout)

    def interrupt(self) -> None:
        """Send what Ctrl-C sends, once, if the process still runs."""
        if self.code is None and not self._interrupted:
            self._interrupted = True
            self.signal(signal.SIGINT)

    def stop(self) -> int:
        """Interrupt the process, kill it if that does not help; return its exit code."""
        stop_all([self])
        return self._process.wait()

    def kill(self) -> None:
        """End the process as it is."""
        self._process.kill()


def stop_all(processes: Sequence[NodeProcess], grace: float = GRACE) -> None:
    """
    Interrupt processes, and kill those that still run after a time [s] that all have together.

    A node of this package is told again and again: a signal may come before the interpreter
    handles it. Other programs may take a second one for an order to drop everything.
    """
    for process in processes:
        process.interrupt()
    end, again = time.monotonic() + grace, time.monotonic() + AGAIN
    while any(process.code is None for process in processes):
        now = time.monotonic()
        if now > end:
            for process in processes:
                process.kill()
        elif now > again:
            again = now + AGAIN
            for process in processes:
                if process.known and process.code is None:
                    process.signal(signal.SIGINT)
        time.sleep(LOOK)


@contextmanager
def _interruptible() -> Iterator[None]:
    """Let a child be interrupted although a job in the background, as this one, is not."""
    ours = threading.current_thread() is threading.main_thread()
    if not ours or signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        yield
        return
    signal.signal(signal.SIGINT, lambda *_: None)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _command(node: str | Sequence[str]) -> list[str]:
    if not isinstance(node, str):
        return list(node)
    if node not in MODULES:
        raise TwinError(f'no node is called {node!r}; there are ' + ', '.join(MODULES))
    return [sys.executable, '-m', MODULES[node]]


__all__ = ['MODULES', 'NodeProcess', 'stop_all']


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
