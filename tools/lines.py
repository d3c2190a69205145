# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How large the tree is: lines of every text file that ships, room by room; and of tests and proofs.

    tools/in_env python tools/lines.py           the sums
    tools/in_env python tools/lines.py --rooms   every room too

The product is what is installed without the lab: all files that git knows in a package beside its tests.
"""

from __future__ import annotations

import subprocess
import sys
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SHIPPED = ('.py', '.yaml', '.yml', '.html', '.j2', '.css', '.js')
"""Kinds of files that are counted."""


def counted() -> Counter[tuple[str, str]]:
    """Return the lines of every room, by what it is part of and its name."""
    out: Counter[tuple[str, str]] = Counter()
    listed = subprocess.run(
        ['git', 'ls-files', 'src', 'test', 'conftest.py'],
        cwd=ROOT, capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    for name in listed.splitlines():
        path = Path(name)
        if path.suffix not in SHIPPED or not (ROOT / path).is_file():
            continue
        package = path.parts[1] if path.parts[0] == 'src' else ''
        part = 'lab' if package == 'weld_twin_lab' else 'product'
        part = 'tests' if path.parts[0] != 'src' or path.parts[2] == 'test' else part
        room = '/'.join(path.parent.parts[: 5 if 'diagnosis' in path.parts else 4])
        out[part, room] += len((ROOT / path).read_text(encoding='utf-8').splitlines())
    return out


def main() -> int:
    """Print the table."""
    lines = counted()
    for part in ('product', 'lab', 'tests'):
        rooms = {room: n for (of, room), n in lines.items() if of == part}
        if '--rooms' in sys.argv:
            for room, n in sorted(rooms.items(), key=lambda item: -item[1]):
                print(f'{n:8,}  {room}')
        print(f'{sum(rooms.values()):8,}  {part}')
    commands = [n for (of, room), n in lines.items() if of == 'product' and room.endswith('/cli')]
    print(f'{sum(commands):8,}  cli/, of the product')
    return 0


if __name__ == '__main__':
    sys.exit(main())
