# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether a recording is whole: as its recorder noted, and as its streams begin and end."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

COMPLETENESS = 'completeness'
"""Key of the provenance under which a recorder notes what was sent and what it lacks of it."""
GAP = 4.0
"""A step longer than so many median steps is a gap; so is a silence at either end."""


class Ends(NamedTuple):
    """First and last stamp of a stream and its median step [ns]."""

    first: int
    last: int
    step: int


def uneven_ends(streams: Mapping[str, Ends]) -> tuple[str, ...]:
    """
    Return a sentence for each stream that begins late or ends early against the others.

    streams: of one clock, by name. Silence counts in the steps of the slower one of two streams: a
    temperature published every ten seconds begins when it pleases.
    """
    if len(streams) < 2:
        return ()
    out = []
    for name, own in streams.items():
        begun = min((s for s in streams.values() if s is not own), key=lambda s: s.first)
        ended = max((s for s in streams.values() if s is not own), key=lambda s: s.last)
        late, early = own.first - begun.first, ended.last - own.last
        if late > GAP * max(own.step, begun.step):
            out.append(f"'{name}' begins {late * 1e-9:.3f} s later than {_name(streams, begun)}")
        if early > GAP * max(own.step, ended.step):
            out.append(f"'{name}' ends {early * 1e-9:.3f} s earlier than {_name(streams, ended)}")
    return tuple(out)


def _name(streams: Mapping[str, Ends], wanted: Ends) -> str:
    return next(f"'{name}'" for name, ends in streams.items() if ends is wanted)


def never_recorded(provenance: Mapping[str, Any]) -> tuple[str, ...]:
    """Return a sentence for each topic of which its recorder noted that messages are missing."""
    noted = provenance.get(COMPLETENESS)
    rows = noted.items() if isinstance(noted, dict) else ()
    return tuple(
        f"'{name}' lacks {row['missing']:,} of the {row['sent']:,} messages sent, {row['where']}"
        for name, row in rows
        if isinstance(row, dict) and row.get('missing') and {'sent', 'where'} <= row.keys()
    )
