# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A command run on somebody's data, so that nothing it meets there harms anybody else.

A warm process (`weld_twin_report.warm`) has everything loaded and forks for each command: that
costs some ten milliseconds, not the second that a new program needs. Its answers come as lines.
"""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar
from weakref import WeakSet

from weld_twin_nodes.offline.environment import THREADS

START = 60.0
"""Seconds in which a warm process must be ready; it takes one or two."""
LONGEST = 1 << 20
"""Bytes of an answer's line; a longer one is a command gone mad."""


_CRASHES = (signal.SIGSEGV, signal.SIGBUS, signal.SIGABRT)
"""How compiled code ends that was refused memory and did not look whether it got it."""
_NO_SPACE = ('No space left on device', 'Disk quota exceeded', 'disk is full')
"""What commands say of a full disk."""


@dataclass(frozen=True)
class Limits:
    """What one command may cost."""

    memory: int = 6_000_000_000
    """Bytes of address space; a diagnosis of an hour's recording needs some 1.5 GB, most of it
    libraries."""
    cpu_s: int = 600
    wall_s: float = 1800.0  # seconds of computing, and in all
    file: int = 2_000_000_000  # bytes of any one file that it writes


@dataclass(frozen=True)
class Outcome:
    """How a command ended."""

    code: int  # its exit code; 2 is a refusal in a sentence, 1 and -1 are failures
    said: str  # the last line that it printed
    seconds: float  # it took in all
    memory: int = 0  # bytes it needed at most

    @property
    def disk_full(self) -> bool:
        """Return whether it ended since nothing more could be written."""
        return self.code != 0 and any(sign in self.said for sign in _NO_SPACE)


class Guarded:
    """Runs commands one after the other, in forks of one warm process."""

    _all: ClassVar[WeakSet[Guarded]] = WeakSet()

    def __init__(self, limits: Limits | None = None) -> None:
        self._all.add(self)
        self._limits = limits or Limits()
        self._process: subprocess.Popen[bytes] | None = None
        self._rest = b''

    def __enter__(self) -> Guarded:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def run(
        self,
        words: Sequence[object],  # the command's words
        # Called with every line that the command prints about its progress.
        tell: Callable[[str], None] = lambda text: None,
        # Where it runs: paths relative to it keep the places of this machine out of results.
        folder: Path | None = None,
    ) -> Outcome:
        """Run ``weld-twin`` with the words given."""
        began = time.monotonic()
        limits = self._limits
        asked = {
            'words': [str(word) for word in words],
            'memory': limits.memory,
            'cpu_s': limits.cpu_s,
            'file': limits.file,
            'folder': None if folder is None else str(folder.absolute()),
        }
        result: dict[str, Any] = {}
        try:
            self._ask(asked)
            for line in self._answers(time.monotonic() + limits.wall_s):
                result |= line
                if 'tell' in line:
                    tell(line['tell'])
                if 'end' in line:
                    break
        except TimeoutError:
            self.close()
            result = {'said': f'it took more than {limits.wall_s:g} s', 'end': -1}
        except (EOFError, OSError, ValueError):
            self.close()
            result = {'said': 'the process that runs commands has ended', 'end': -1}
        return self._outcome(result, time.monotonic() - began)

    def end(self) -> None:
        """End the warm process, and with it what runs there, from whichever thread."""
        if self._process is not None:
            with suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)

    @classmethod
    def end_all(cls) -> None:
        """End all warm processes of this program; who waits for one is told so."""
        for each in list(cls._all):
            each.end()

    def close(self) -> None:
        """End the warm process and let go of its pipes."""
        self.end()
        process, self._process = self._process, None
        if process is None:
            return
        process.wait()
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                pipe.close()

    def _outcome(self, result: dict[str, Any], seconds: float) -> Outcome:
        if 'code' in result:
            return Outcome(
                int(result['code']), str(result.get('said', '')), seconds, int(result['memory'])
            )
        ended = int(result.get('end', -1))
        said = str(result.get('said', ''))
        computed = float(result.get('cpu_s', 0.0)) >= self._limits.cpu_s
        if ended == -signal.SIGXCPU or (ended == -signal.SIGKILL and computed):
            said = f'it took more than {self._limits.cpu_s} s of computing'
        if ended == -signal.SIGKILL and not said:
            said = (
                'its process was killed from outside, as the system does where memory runs out; '
                'try it again'
            )
        if -ended in _CRASHES and not said:
            said = (
                f'its process crashed ({signal.Signals(-ended).name}), as when it needs more memory '
                f'than {self._limits.memory / 1e9:g} GB'
            )
        return Outcome(-1, said or f'its process ended with {ended}', seconds)

    def _ask(self, asked: dict[str, Any]) -> None:
        if self._process is None or self._process.poll() is not None:
            self.close()
            self._start()
        assert self._process is not None and self._process.stdin is not None
        self._process.stdin.write((json.dumps(asked) + '\n').encode())
        self._process.stdin.flush()

    def _start(self) -> None:
        self._rest = b''
        self._process = subprocess.Popen(
            [sys.executable, '-m', 'weld_twin_report.warm'],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,  # ended together with what it runs
            env={**os.environ, **dict.fromkeys(THREADS, '1')},
        )
        next(self._answers(time.monotonic() + START))

    def _answers(self, until: float) -> Iterator[dict[str, Any]]:
        """Yield answers until an instant; lines that are none, of a process that died, are left out."""
        assert self._process is not None and self._process.stdout is not None
        pipe = self._process.stdout.fileno()
        while True:
            while b'\n' not in self._rest:
                remaining = until - time.monotonic()
                if remaining <= 0.0 or not select.select([pipe], [], [], remaining)[0]:
                    raise TimeoutError
                got = os.read(pipe, 1 << 16)
                if not got or len(self._rest) > LONGEST:
                    raise EOFError
                self._rest += got
            line, _, self._rest = self._rest.partition(b'\n')
            try:
                answer = json.loads(line)
            except ValueError:
                continue
            if isinstance(answer, dict):
                yield answer
