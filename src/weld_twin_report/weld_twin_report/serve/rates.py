# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How often somebody may ask: who asks more often waits, and holds up nobody but himself."""

from __future__ import annotations

import time

A_SECOND = 100.0
"""Requests a second that are answered at once; a server makes a few hundred pages a second."""
AHEAD = 200.0
"""Requests that may come at once after a pause: twenty browsers that begin together."""
LONGEST = 5.0
"""Seconds that a request is held back at most; beyond, it is refused."""
MOST = 10_000
"""Parties that are remembered; more are forgotten, which lets them ask at once."""


class Rates:
    """Holds back who asks too often."""

    def __init__(self) -> None:
        self._free: dict[str, float] = {}  # when the last request of a party would be paid for

    def wait(self, party: str) -> float | None:
        """Return for how long a request is held back [s]; None if it is refused."""
        now = time.monotonic()
        earliest = now - AHEAD / A_SECOND
        free = max(self._free.pop(party, earliest), earliest) + 1.0 / A_SECOND
        if len(self._free) >= MOST:
            self._free.clear()
        wait = max(free - now, 0.0)
        if wait > LONGEST:
            self._free[party] = free - 1.0 / A_SECOND
            return None
        self._free[party] = free
        return wait
