# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A ROS domain of one's own on this machine, so that two cells never hear each other."""

from __future__ import annotations

import fcntl
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from weld_twin_core.errors import TwinError

from ..offline.environment import environment

DOMAINS = range(1, 102)
"""Domains whose ports stay clear of those Linux hands out by itself."""


@contextmanager
def own_domain() -> Iterator[int]:
    """
    Hold a domain that no other process of this machine holds in the same way.

    The environment names it meanwhile, and keeps discovery on this machine.

    Raises
    ------
    TwinError
        All of them are taken.

    """
    folder = Path(tempfile.gettempdir()) / f'weld_twin_domains_{os.getuid()}'
    folder.mkdir(exist_ok=True)
    # Start somewhere else in every process: the domain is also somebody's who holds no lock.
    start = os.getpid() % len(DOMAINS)
    for domain in (*DOMAINS[start:], *DOMAINS[:start]):
        with (folder / str(domain)).open('w') as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
            with environment(ROS_DOMAIN_ID=str(domain), ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST'):
                yield domain
            return
    raise TwinError(f'all ROS domains from {DOMAINS[0]} to {DOMAINS[-1]} are in use here')
