# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the publishers say they sent, compared with what was recorded."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, NamedTuple

from .all_nodes import MODULES
from .words import Book, Heard, Sent, Word

NEW = 3.0
"""Seconds a node is listened to for the first time; each tells of itself once a second. One that
has not by then is not of this project."""
STEP = 0.5
"""Longest time [s] between two looks that counts as listened: a recorder that stood still, or was
not given a processor, has not listened meanwhile."""


AT_START = 'at the start'
"""Where messages are missing that were sent before the recorder was there."""


class SentBook(Book):
    """The words of nodes beside a recorder, and for how long it has listened to each of them."""

    def __init__(self) -> None:
        super().__init__()
        self._inputs: dict[str, dict[str, dict[str, tuple[Heard, int]]]] = {}
        self._looked: dict[str, float] = {}
        self._listened: dict[str, float] = {}

    def take(self, word: Word) -> None:
        """Take a word, and compare what the node has heard with what was due."""
        super().take(word)
        if word.heard:
            due = {topic: (own, self.due(topic, word.at)) for topic, own in word.heard.items()}
            self._inputs.setdefault(word.node, {})[word.run] = due

    def unheard(self, nodes: Collection[str]) -> list[str]:
        """
        Return a sentence for every input of nodes that has less than was sent.

        What they publish is as incomplete. Nodes that were started again are passed over.
        """
        out = []
        for node in sorted(nodes):
            runs = list(self._inputs.get(node, {}).values())
            for topic, (heard, due) in runs[0].items() if len(runs) == 1 else ():
                if heard.received < due:
                    out.append(
                        f"{node} has received {heard.received:,} of {due:,} messages on '{topic}': "
                        'what it publishes lacks the others'
                    )
        return out

    def silent_nodes(self) -> list[str]:
        """Return the nodes of the project that were met and have not said anything at all."""
        return [node for node in self._listened if _ours(node) and node not in self.nodes()]

    def meet(self, node: str, now: float) -> None:
        """Take note at every look [s] that a node publishes something that is recorded."""
        passed = now - self._looked.get(node, now)
        self._listened[node] = self._listened.get(node, 0.0) + min(passed, STEP)
        self._looked[node] = now

    def silent_since(self, then: float) -> list[str]:
        """Return the nodes met that tell, or may tell, of themselves and have not since [s]."""
        known, recent = self.nodes(), self.nodes(then)
        return [
            node
            for node, listened in self._listened.items()
            if node not in recent and (node in known or listened < NEW or _ours(node))
        ]


def _ours(node: str) -> bool:
    return node.rpartition('/')[2] in MODULES


class Shortfall(NamedTuple):
    """What a recording lacks of a topic."""

    sent: int
    recorded: int
    where: str  # 'at the start', 'at the end', 'at both ends', or 'in between'

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
    """Return what is missing of a topic; None if nothing is, or nobody said."""
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
