# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Stamps that must go forward, without being lost for good after a restart."""

from __future__ import annotations

from weld_twin_core.errors import DataError

RESTART_AFTER = 10
"""Refusals in a row, in order among themselves, after which time has started anew."""


class Forward:
    """Lets stamps [ns] through that increase; one bad stamp costs a sample, not the stream."""

    def __init__(self) -> None:
        self.last: int | None = None
        self._behind: list[int] = []

    def restarted_at(self, stamp: int) -> bool:
        """
        Take a stamp; return whether it begins a new run, as when a bag is played again.

        Raises
        ------
        DataError
            The stamp is not after the last one.

        """
        if self.last is None or stamp > self.last:
            self.last = stamp
            self._behind.clear()
            return False
        if self._behind and stamp <= self._behind[-1]:
            self._behind.clear()
        self._behind.append(stamp)
        if len(self._behind) < RESTART_AFTER:
            raise DataError(
                f'the stamp {stamp * 1e-9:.6f} s is not after the last one, '
                f'{self.last * 1e-9:.6f} s; the sample is left out'
            )
        self.last = stamp
        self._behind.clear()
        return True
