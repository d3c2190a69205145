# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Exact looks at poses in a process of their own: one takes as long as a control cycle.

A thread would not do: whoever holds the interpreter keeps the poses waiting. Run as a module it is
that process, which ends when nobody holds the other end of its socket any more.
"""

import os
import signal
import socket
import subprocess
import sys
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import Any

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.twin.pose_correction import Looked, PoseCorrection

_MODULE = 'weld_twin_nodes.streams.looks_beside'
READY = 'ready'
"""First word of the process: it has loaded what it needs."""
Answer = Looked | float | DataError
"""An exact look, how sure the model is of one [m], or why there is none."""


class LooksBeside:
    """Asks one thing at a time; nothing here waits for the answer."""

    def __init__(self) -> None:
        own, other = socket.socketpair()
        with other:
            self._process = subprocess.Popen(
                [sys.executable, '-m', _MODULE, str(other.fileno())],
                pass_fds=[other.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=sys.stderr,
            )
        self._link: Connection | None = Connection(own.detach())
        self._up = self._busy = False
        self._correction: PoseCorrection | None = None
        self._posterior: Any = None
        self._number = 0

    @property
    def up(self) -> bool:
        """Return whether the process is there and has loaded what it needs."""
        return self._up and not self.lost

    @property
    def free(self) -> bool:
        """Return whether it can be asked something: one answer is awaited at a time."""
        return self.up and not self._busy

    @property
    def lost(self) -> bool:
        """Return whether the process is gone."""
        return self._link is None

    def drop(self) -> None:
        """Forget what was asked."""
        self._number += 1

    def follow(self, correction: PoseCorrection) -> None:
        """Ask by this correction from now on; what was asked before counts no more."""
        self._correction = correction
        self.drop()
        if self._up:
            model = correction.model
            if model.posterior is not self._posterior:  # the largest part, and it seldom changes
                self._posterior = model.posterior
                self._send('posterior', model.posterior)
            bare = replace(model, posterior=None, _twins={})
            self._send('correction', (bare, correction.tool))

    def look(self, pose: Array, near: Array) -> None:
        """Ask for the exact correction of a pose (4, 4), from joints near it (n,)."""
        self._busy = True
        self._send('first', (pose, near))

    def doubt(self, looked: Looked) -> None:
        """Ask how sure the model is of an exact correction."""
        self._busy = True
        self._send('doubt', (looked,))

    def answer(self) -> Answer | None:
        """Return the answer once it is there."""
        try:
            while self._link is not None and self._link.poll():
                number, result = self._link.recv()
                if not self._up:
                    self._up = True
                    if self._correction is not None:
                        self.follow(self._correction)
                    continue
                self._busy = False
                if number == self._number:
                    answer: Answer = result
                    return answer
        except (EOFError, OSError):
            self.close()
        return None

    def close(self) -> None:
        """End the process."""
        if self._link is not None:
            self._link.close()
        self._link = None
        self._process.kill()
        self._process.wait()

    def _send(self, what: str, content: Any) -> None:
        try:
            if self._link is not None:
                self._link.send((self._number, what, content))
        except OSError:
            self.close()


def serve(link: Connection) -> None:
    """Answer until the other end is closed."""
    correction: PoseCorrection | None = None
    posterior: Any = None
    link.send((0, READY))
    while True:
        try:
            number, what, content = link.recv()
        except (EOFError, OSError):
            return
        if what == 'posterior':
            posterior = content
        elif what == 'correction':
            bare, tool = content
            correction = PoseCorrection(replace(bare, posterior=posterior), tool)
        else:
            try:
                result = getattr(correction, what)(*content)
            except DataError as error:
                result = error
            link.send((number, result))


def main() -> int:
    """Serve the socket that was handed over."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the node, which ends this
    how = os.sched_getscheduler(0)
    if how in (os.SCHED_FIFO, os.SCHED_RR):  # beside a node in real time poses go first
        given = os.sched_getparam(0).sched_priority
        os.sched_setscheduler(0, how, os.sched_param(max(given - 1, 1)))
    serve(Connection(int(sys.argv[1])))
    return 0


if __name__ == '__main__':
    # Pickle must find the classes under their real name, not under __main__.
    from weld_twin_nodes.streams.looks_beside import main as _main

    raise SystemExit(_main())
