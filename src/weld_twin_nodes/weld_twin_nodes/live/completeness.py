# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the publishers say they sent, held against what was recorded."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from .outputs import NODE, RUN, Sent, read_told

NEW = 3.0
"""Seconds a node is listened to for the first time; each tells of itself once a second. One that
has not by then is not of this project."""
STEP = 0.5
"""Longest time [s] between two looks that counts as listened: a recorder that stood still, or was
not given a processor, has not listened meanwhile."""


AT_START = 'at the start'
"""Where messages are missing that were sent before the recorder was there."""


class SentBook:
    """Keeps what every node last told of the messages it sent; each start counts by itself."""

    def __init__(self) -> None:
        self._tellers: dict[tuple[str, str], dict[str, Sent]] = {}
        self._heard: dict[str, float] = {}
        self._looked: dict[str, float] = {}
        self._listened: dict[str, float] = {}

    def take(self, values: Mapping[str, str], now: float) -> None:
        """Take the health of a node at a time [s]; what tells of no messages is passed over."""
        sent = read_told(values)
        if sent:
            node = values.get(NODE, '')
            self._tellers[node, values.get(RUN, '')] = sent
            self._heard[node] = now

    def meet(self, node: str, now: float) -> None:
        """Take note at every look [s] that a node publishes something that is recorded."""
        passed = now - self._looked.get(node, now)
        self._listened[node] = self._listened.get(node, 0.0) + min(passed, STEP)
        self._looked[node] = now

    def silent_since(self, then: float) -> list[str]:
        """Return the nodes met that tell, or may tell, of themselves and have not since [s]."""
        out = []
        for node, listened in self._listened.items():
            heard = self._heard.get(node)
            if listened < NEW if heard is None else heard < then:
                out.append(node)
        return out

    def sent(self, topic: str) -> Sent | None:
        """Return what was sent on a topic by all who told, None if nobody did."""
        rows = [told[topic] for told in self._tellers.values() if topic in told]
        if not rows:
            return None
        firsts = [row.first for row in rows if row.first is not None]
        lasts = [row.last for row in rows if row.last is not None]
        count = sum(row.number for row in rows)
        return Sent(count, min(firsts, default=None), max(lasts, default=None))


class Shortfall(NamedTuple):
    """
    What a recording lacks of a topic.

    Attributes
    ----------
    sent, recorded : int
    where : str
        'at the start', 'at the end', 'at both ends', or 'in between'.

    """

    sent: int
    recorded: int
    where: str

    def sentence(self, topic: str) -> str:
        """Return it in words."""
        return (
            f"'{topic}' is incomplete: {self.recorded:,} of {self.sent:,} messages sent are in "
            f'the bag, {self.sent - self.recorded:,} are missing {self.where}'
        )

    def to_mapping(self) -> dict[str, Any]:
        """Return plain values."""
        missing = self.sent - self.recorded
        return {
            'sent': self.sent,
            'recorded': self.recorded,
            'missing': missing,
            'where': self.where,
        }


def shortfall(sent: Sent | None, recorded: Sent) -> Shortfall | None:
    """Return what is missing of a topic; None if nothing is, or nobody told."""
    if sent is None or recorded.number >= sent.number:
        return None
    late = early = recorded.number == 0
    if None not in (sent.first, recorded.first):
        late = recorded.first > sent.first  # type: ignore[operator]
        early = recorded.last < sent.last  # type: ignore[operator]
    where = {
        (True, True): 'at both ends',
        (True, False): AT_START,
        (False, True): 'at the end',
        (False, False): 'in between',
    }[late, early]
    if recorded.number == 0:
        where = 'from the first to the last'
    return Shortfall(sent.number, recorded.number, where)
