# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The command line, warm: everything loaded once, each command in a process of its own.

Started by `weld_twin_report.guarded`, which asks in lines of JSON on stdin and is answered on stdout. A
command runs in a fork of this process, within bounds of memory and computing time: what it does,
crash included, ends with it. Whoever asked and is gone takes the command along.
"""

import contextlib
import gc
import io
import json
import os
import resource
import select
import signal
import sys
from typing import Any, NoReturn

KIB = 1024
"""Bytes; what getrusage counts memory in on Linux."""


class Telling(io.TextIOBase):
    """A stream whose lines are sent to who asked; the last one is kept."""

    def __init__(self, out: int) -> None:
        self._out, self._rest, self.last = out, '', ''

    def writable(self) -> bool:
        """Return True."""
        return True

    def write(self, text: str) -> int:
        """Send the lines that are whole."""
        *lines, self._rest = (self._rest + text).split('\n')
        for line in filter(str.strip, lines):
            self.last = line.strip()
            answer(self._out, {'tell': self.last})
        return len(text)


def answer(out: int, what: dict[str, Any]) -> None:
    """Write a line of JSON, whole: a pipe takes so much at once."""
    data = (json.dumps(what) + '\n').encode()
    while data:
        data = data[os.write(out, data) :]


def main() -> int:
    """Run commands until nobody asks any more."""
    out = os.dup(1)
    os.dup2(2, 1)  # whatever prints must not talk into the answers
    # What a diagnosis needs, so that a fork has it already.
    from weld_twin_core import diagnosis  # noqa: F401
    from weld_twin_msgs_py import bags, robots  # noqa: F401

    from .cli.commands import diagnose  # noqa: F401
    from .report import diagnosis_files  # noqa: F401

    gc.freeze()  # the forks share these pages
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for who asked
    answer(out, {'ready': True})
    rest = b''
    while True:
        while b'\n' not in rest:
            got = os.read(0, 1 << 16)
            if not got:
                return 0
            rest += got
        line, _, rest = rest.partition(b'\n')
        ended = _in_a_fork(json.loads(line), out)
        if ended is None:
            return 0
        answer(out, ended)


def _in_a_fork(asked: dict[str, Any], out: int) -> dict[str, Any] | None:
    """Run a command; return how its process ended and what it cost, None if nobody waits for it."""
    here, there = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.close(here)
        _run(asked, out)
    os.close(there)
    # Nothing is asked before the answer, so stdin has something to read only when it ends.
    ready, _, _ = select.select([here, 0], [], [])
    gone = here not in ready
    if gone:
        os.kill(pid, signal.SIGKILL)
    os.close(here)
    _, status, used = os.wait4(pid, 0)
    if gone:
        return None
    return {'end': os.waitstatus_to_exitcode(status), 'cpu_s': used.ru_utime + used.ru_stime}


_TOO_MUCH = 'it needs more memory than is allowed'
_NO_ROOM = ('failed to map segment', 'Cannot allocate memory')
"""What the system says where a library or an array has no room."""


def _run(asked: dict[str, Any], out: int) -> NoReturn:
    """Run the command within its bounds, answer with its exit code, and end."""
    resource.setrlimit(resource.RLIMIT_AS, (asked['memory'],) * 2)
    resource.setrlimit(resource.RLIMIT_CPU, (asked['cpu_s'], asked['cpu_s'] + 1))
    resource.setrlimit(resource.RLIMIT_FSIZE, (asked['file'],) * 2)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    os.environ['WELD_TWIN_PROGRESS'] = 'lines'
    progress, printed = Telling(out), io.StringIO()
    code = 1
    try:
        if asked.get('folder'):
            os.chdir(asked['folder'])
        with contextlib.redirect_stderr(progress), contextlib.redirect_stdout(printed):
            from weld_twin_nodes.cli.main import main as command

            code = command([str(word) for word in asked['words']])
    except SystemExit as stop:
        code = stop.code if isinstance(stop.code, int) else 1
    except MemoryError:
        progress.last = _TOO_MUCH
    except BaseException as error:
        progress.last = f'{type(error).__name__}: {error}'
    # The command tells by itself of a file that it has no room for, in a sentence.
    if code and any(sign in progress.last for sign in _NO_ROOM):
        progress.last = _TOO_MUCH
    used = resource.getrusage(resource.RUSAGE_SELF)
    answer(
        out,
        {
            'code': code,
            'said': progress.last,
            'memory': used.ru_maxrss * KIB,
            'cpu_s': used.ru_utime + used.ru_stime,
        },
    )
    os._exit(0)


if __name__ == '__main__':
    try:
        sys.exit(main())
    except BrokenPipeError:  # who asked was killed
        os._exit(0)
