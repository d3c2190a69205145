# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A ROS domain of one's own on this machine, so that two cells never hear each other."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from weld_twin_core.errors import TwinError

from ..offline.environment import environment

DOMAINS = range(1, 102)
"""Domains whose ports stay clear of those Linux hands out by itself."""
FIRST, APART = 7400, 250
"""First port of domain 0, and how many ports a domain has: section 9.6.1 of the RTPS standard."""
HELD = 5
"""Port of a domain that no participant takes: two are for multicast, its participants' begin at ten."""
TAKEN = range(10, 20)
"""Ports of the first five participants of a domain: one of them is there as long as any is new."""


@contextmanager
def own_domain() -> Iterator[int]:
    """
    Hold a domain that no other process of this machine holds in the same way, nor speaks in.

    A port of the domain is the lock, so that it holds for all users, whatever their folder for
    temporary files is, and is given back however the process ends. The environment names the
    domain meanwhile, and keeps discovery on this machine.

    Raises TwinError: all of them are taken.
    """
    # Start somewhere else in every process: the domain is also somebody's who holds no lock.
    start = os.getpid() % len(DOMAINS)
    for domain in (*DOMAINS[start:], *DOMAINS[:start]):
        first = FIRST + APART * domain
        with ExitStack() as held:
            try:
                held.enter_context(_port(first + HELD))
                for port in TAKEN:
                    _port(first + port).close()
            except OSError:
                continue
            with environment(ROS_DOMAIN_ID=str(domain), ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST'):
                yield domain
            return
    raise TwinError(f'all ROS domains from {DOMAINS[0]} to {DOMAINS[-1]} are in use here')


def _port(number: int) -> socket.socket:
    """
    Return a port that is bound.

    Raises OSError: somebody has it.
    """
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        out.bind(('', number))
    except OSError:
        out.close()
        raise
    return out
