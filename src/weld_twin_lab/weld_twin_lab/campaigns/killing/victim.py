# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
``weld-twin`` that is killed at one of its changes to files.

    python -m weld_twin_lab.campaigns.killing.victim 12 diagnose BAG --robot ur5 --out found

SIGKILL comes just before the twelfth change: a file opened for writing, renamed or removed, a folder
made or removed. With 0 nothing comes, and the last line of stderr says how many changes there were.
"""

from __future__ import annotations

import os
import signal
import sys
from typing import Any

from weld_twin_nodes.cli.main import main as weld_twin

CHANGES = {
    'os.rename',
    'os.remove',
    'os.rmdir',
    'os.mkdir',
    'os.truncate',
    'os.link',
    'os.symlink',
}
"""What Python tells of itself when files change; `open` is told too, and looked at."""
_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC


class _Changes:
    """Counts changes to files, and ends the process at one of them."""

    def __init__(self, last: int) -> None:
        self.count, self._last = 0, last

    def __call__(self, event: str, what: tuple[Any, ...]) -> None:
        if event in CHANGES or (event == 'open' and what[2] & _WRITES):
            self.count += 1
            if self.count == self._last:
                os.kill(os.getpid(), signal.SIGKILL)


def main() -> int:
    """Run the command, and be killed."""
    changes = _Changes(int(sys.argv[1]))
    sys.addaudithook(changes)
    code = weld_twin(sys.argv[2:])
    print(changes.count, file=sys.stderr)
    return code


if __name__ == '__main__':
    sys.exit(main())
