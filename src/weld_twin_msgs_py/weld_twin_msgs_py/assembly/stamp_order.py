# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Stamps that must go forward, without being lost for good after a restart."""

from weld_twin_core.errors import DataError

RESTART_AFTER = 10
"""Refusals in a row, in order among themselves, after which time has started anew."""


class Late(DataError):
    """The stamp of a sample is so far [ns] behind the last one of its stream; 0 if it repeats."""

    def __init__(self, sentence: str, behind: int = 0) -> None:
        super().__init__(sentence)
        self.behind = behind


class Forward:
    """Lets stamps [ns] through that increase; one bad stamp costs a sample, not the stream."""

    def __init__(self) -> None:
        self.last: int | None = None
        self._behind: list[int] = []
        self._ended: int | None = None
        self._late = 0

    def reset(self) -> None:
        """Begin anew, as after a jump of the clock; what was under way has stamps that go on."""
        self._ended = self._ended if self.last is None else self.last
        self.last = None
        self._behind.clear()
        self._late = 0

    def restarted_at(self, stamp: int) -> bool:
        """Take a stamp; return whether it begins a new run, as of a bag played again, or raise Late."""
        if self.last is None and self._ended is not None and stamp > self._ended:
            self._late += 1
            if self._late < RESTART_AFTER:
                raise Late(f'the stamp {stamp * 1e-9:.6f} s is of before the clock jumped')
        if self.last is None or stamp > self.last:
            self.last, self._ended = stamp, None
            self._behind.clear()
            return False
        if self._behind and stamp <= self._behind[-1]:
            self._behind.clear()
        self._behind.append(stamp)
        if len(self._behind) < RESTART_AFTER:
            raise Late(
                f'the stamp {stamp * 1e-9:.6f} s is not after the last one, '
                f'{self.last * 1e-9:.6f} s; the sample is left out',
                self.last - stamp,
            )
        self.last = stamp
        self._behind.clear()
        return True
