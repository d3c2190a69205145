# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where an arm stands by its joint states, whether it moves, and where its joints came from."""

from collections import deque
from collections.abc import Sequence

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.effects.curves import AT_REST
from weld_twin_core.twin.goal_correction import Start

STILL = 2e-4
"""How far a joint may move within `PAUSE` and still stand [rad, m]: encoders are steadier."""
PAUSE = 0.1
"""Time over which an arm is looked at [s]."""
CAME = 1e-4
"""Motion of a joint [rad, m] that tells where it came from: more than noise, less than play."""
MOVING = 2.0 * AT_REST
"""Speed [rad/s or m/s] from which on a direction counts for 96 %."""
SPAN = 20_000_000
"""Time over which a speed is looked at [ns]: noise of encoders counts for little then."""
REMEMBERED = 1000
"""Joint states back to which a measurement may be late: two seconds of the usual 500 a second."""


class Moving:
    """Tells afterwards whether joints moved: at rest nobody knows on which side their play is."""

    def __init__(self, columns: Sequence[int]) -> None:
        self._columns = list(columns)
        self._lately: deque[tuple[int, Array]] = deque(maxlen=REMEMBERED)

    def take(self, stamp: int, q: Array) -> None:
        """Take joint positions (n,) [rad or m] at a stamp [ns]."""
        if self._lately and stamp <= self._lately[-1][0]:
            self._lately.clear()
        self._lately.append((stamp, q[self._columns]))

    def at(self, stamp: int) -> bool:
        """Return whether all of them moved at a stamp [ns], or it is longer ago than is remembered."""
        near: tuple[int, Array] | None = None
        for at, q in reversed(self._lately):
            if near is None:
                near = (at, q) if at <= stamp else None
            elif near[0] - at >= SPAN:
                speed = np.abs(near[1] - q) / ((near[0] - at) * 1e-9)
                return bool((speed > MOVING).all())
        return True


class ArmState:
    """The arm by the joint states that came last."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Forget what was heard, as after a jump of the clock."""
        self._lately: deque[tuple[float, Array]] = deque()
        self._turned: Array | None = None
        self._came: Array | None = None

    @property
    def heard(self) -> bool:
        """Return whether a joint state came at all."""
        return bool(self._lately)

    def take(self, q: Array, now: float) -> None:
        """Take joint positions (n,) [rad or m] that came at a time [s]."""
        self._lately.append((now, q))
        while now - self._lately[0][0] > PAUSE:
            self._lately.popleft()
        if self._turned is None or self._came is None:
            self._turned, self._came = q.copy(), np.zeros_like(q)
            return
        way = q - self._turned
        ahead = way * self._came > 0.0
        turned = np.abs(way) > CAME
        self._came = np.where(turned, np.sign(way), self._came)
        # What goes on the way it came takes its mark along; the other way has to be gone first.
        self._turned = np.where(ahead | turned, q, self._turned)

    def where(self, now: float, most_age: float) -> Array | None:
        """Return where the arm stands (n,) [rad or m]; None where the last state is too old."""
        if not self._lately or now - self._lately[-1][0] > most_age:
            return None
        return self._lately[-1][1]

    def start(self, now: float, most_age: float) -> Start:
        """Return where a goal begins; nothing is known of it where the last state is too old."""
        q = self.where(now, most_age)
        if q is None:
            return Start()
        moving = any(np.abs(q - then).max() > STILL for _, then in self._lately)
        return Start(q, moving, self._came)
