# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Keys made as `ros2 security` makes them, by the functions of sros2 that it calls.

Run as a module with a folder, a policy and enclaves: a process of its own sees what was built for it.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

from weld_twin_core.errors import TwinError

from .middleware import FETCH

ABSENT = 3
"""Exit code where sros2 cannot be imported; it prints why."""


def keystore(folder: Path, policy: Path, enclaves: Iterable[str]) -> Path:
    """
    Return a new keystore for the domain of the environment.

    folder: where to make it.
    policy: what each enclave may do.
    enclaves: all of them stand in the policy.

    Raises TwinError: sros2 is not here, or fails.
    """
    command = [sys.executable, '-m', __name__, str(folder), str(policy), *enclaves]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    said = (done.stderr or done.stdout).strip()
    if done.returncode == ABSENT:
        raise TwinError(f'no keys can be made without sros2: {said}')
    if done.returncode:
        raise TwinError(f'sros2 makes no keys: {said[-600:]}')
    return folder


def main(folder: str, policy: str, *enclaves: str) -> int:
    """Make the keystore; return the exit code."""
    try:
        from sros2.keystore import create_enclave, create_keystore, create_permission
    except ImportError as error:
        remedy = FETCH if error.name == 'sros2' else 'pip install "cryptography<42" lxml'
        print(f'{error}; {remedy}')
        return ABSENT
    place = Path(folder)
    create_keystore(place)
    for enclave in enclaves:
        create_enclave(place, enclave)
        create_permission(place, enclave, Path(policy))
    return 0


if __name__ == '__main__':
    raise SystemExit(main(*sys.argv[1:]))
