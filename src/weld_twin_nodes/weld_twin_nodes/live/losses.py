# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What an input of a running node lacks: by the counts of those who tell them, else by its stamps."""

from __future__ import annotations

from collections import deque

from ..streams.stamp_watch import Seen
from .health import Input
from .words import Sent, Word

TELLS = 4
"""
Counts in a row that must all be short before messages are missing. They come once a second, and
what was lost on the way to a reliable reader is sent again within 3 s (Fast DDS).
"""
OVER = 4.0
"""Seconds without another missing message after which a loss is over."""


SETTLES = 3.0
"""Seconds within which a loss that still grows is reported: a burst is over by then, and the number is
that of all of it."""


class Counted:
    """What came of a topic, compared with what its publishers say they sent."""

    def __init__(self, state: Input) -> None:
        self._state = state
        self._sent: dict[tuple[str, str], Sent] = {}
        self._base = (0, 0)
        self._short: deque[int] = deque(maxlen=TELLS)
        self._heard = False
        self._before = self._now = 0

    @property
    def tellers(self) -> list[str]:
        """Return the nodes that tell counts."""
        return sorted({node for node, _ in self._sent})

    @property
    def sent(self) -> int:
        """Return how many messages were sent since they are counted."""
        return self._total() - self._base[0]

    def tell(self, word: Word) -> None:
        """Take what a node, in one of its runs, has sent by the time that this is heard."""
        teller, state = (word.node, word.run), self._state
        sent, new = word.sent[state.topic], teller not in self._sent
        alone = not self._sent
        self._sent[teller] = sent
        self._heard = True
        if new or not state.matched:  # what was sent before the two met is no loss
            whole = alone and sent.first is not None and sent.first == state.first
            self._base = (0, 0) if whole else (self._total(), state.received)
            self._before, self._now = self._before + self._now, 0
            self._short.clear()
        self._short.append(self._lack())

    def look(self) -> int:
        """Return how many messages are missing for good; to be called once a second."""
        if not self._heard and self._sent:
            self._short.append(self._lack())
        self._heard = False
        if len(self._short) == TELLS:
            self._now = max(min(self._short), 0)  # what is sent again comes after all
        return self._before + self._now

    def _total(self) -> int:
        return sum(sent.number for sent in self._sent.values())

    def _lack(self) -> int:
        return self.sent - (self._state.received - self._base[1])


class Losses:
    """The losses of one input, and, as long as they go on, what to report: `telling`."""

    def __init__(self, state: Input) -> None:
        self._state = state
        self._counted = Counted(state)
        self.tell = self._counted.tell
        self._by_stamps = 0
        self._grew = self._since = 0.0
        self._said = False
        self.telling = ''

    def look(self, now: float) -> list[str]:
        """Return sentences at a time [s], on what went missing since the last look and on stamps."""
        topic, seen, tellers = self._state.topic, self._state.stamps.look(), self._counted.tellers
        out = [f'{topic}: {sentence}' for sentence in _of_clock(seen)]
        if tellers and self._state.senders <= set(tellers):
            lost = self._counted.look()
            said = (
                f'{topic}: {lost:,} of {self._counted.sent:,} messages that '
                f'{" and ".join(tellers)} sent did not arrive'
            )
        else:
            self._by_stamps += seen.missing
            lost = self._by_stamps
            said = (
                f'{topic}: {lost:,} missing messages, by the gaps between its stamps (one is '
                f'due every {seen.step * 1e3:.3g} ms): they were lost on the way, or never sent'
            )
        grown = lost > self._state.lost
        if grown:
            self._since = self._since if self.telling else now
            self._grew, self.telling = now, said
        self._state.lost = lost
        if self.telling and not self._said and (not grown or now - self._since > SETTLES):
            self._said = True
            out.append(self.telling)
        if self.telling and now - self._grew > OVER:
            self.telling, self._said = '', False
            out.append(f'{topic}: no more messages go missing; {lost:,} are missing in all')
        return out

    def ended(self) -> list[str]:
        """Return what to report about a loss that the end of the node cuts short."""
        if not self.telling:
            return []
        return [f'{self._state.topic}: {self._state.lost:,} messages are missing in all']


def _of_clock(seen: Seen) -> list[str]:
    """Return what to report about stamps that jumped."""
    if seen.back:
        return [f'the stamps begin anew, {seen.back:,.1f} s behind the last one']
    if seen.ahead:
        return [
            f'the stamps jumped forwards by {seen.ahead:,.1f} s: a clock was set, or another '
            'recording is played'
        ]
    return []
