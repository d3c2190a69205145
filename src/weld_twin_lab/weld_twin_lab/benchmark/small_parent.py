# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A small process that starts a program, waits for it and tells what it cost.

Linux counts with a program what the process that started it had in memory until then. So nothing
large may start what is measured: this file needs the standard library alone, and is run by its
path as ``python -I -S small_parent.py REPORT LIMIT WORD...``. REPORT is a file descriptor that gets
a line of JSON: exit code, seconds on the clock, seconds of processor time, bytes. LIMIT is the
time after which the program is ended [s]; 0 for none.
"""

from __future__ import annotations

import os
import signal
import sys
import time

UNIT = 1 if sys.platform == 'darwin' else 1024
"""What the system counts memory in [bytes]."""
NOT_STARTED = 127
"""Exit code of a program that could not be started, as a shell tells it."""


def main() -> None:
    report, limit, words = int(sys.argv[1]), float(sys.argv[2]), sys.argv[3:]
    os.set_inheritable(report, False)
    start = time.perf_counter()
    try:
        child = os.posix_spawnp(words[0], words, os.environ)
    except OSError as error:
        print(f'{words[0]}: {error.strerror}', file=sys.stderr)
        os.write(report, f'[{NOT_STARTED}, 0.0, 0.0, 0]\n'.encode())
        return
    signal.signal(signal.SIGALRM, lambda *_: os.kill(child, signal.SIGKILL))
    signal.setitimer(signal.ITIMER_REAL, limit)
    _, status, used = os.wait4(child, 0)
    wall = time.perf_counter() - start
    code, cpu = os.waitstatus_to_exitcode(status), used.ru_utime + used.ru_stime
    os.write(report, f'[{code}, {wall}, {cpu}, {used.ru_maxrss * UNIT}]\n'.encode())


if __name__ == '__main__':
    main()
