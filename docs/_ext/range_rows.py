# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a machine can have, and what is wrong then, as the effects say it: the rows of tables."""

from __future__ import annotations

from weld_twin_core.effects import REGISTRY, Plausible
from weld_twin_core.effects.effect import SLIDING_UNITS

HEADER = ('effect', 'parameter', 'unit', 'spread', 'least', 'most', 'source')


def range_rows(*, sliding: bool) -> list[tuple[str, ...]]:
    """Return a row for every parameter that has a range."""
    return [
        (kind.name, p.name, SLIDING_UNITS.get(p.unit, p.unit) if sliding else p.unit, *_row(found))
        for kind in REGISTRY.values()
        for p in kind.parameters
        if (found := p.sliding if sliding else p.range) is not None
    ]


def cause_rows() -> list[tuple[str, str]]:
    """Return a row for every cause that a diagnosis may name, by what people call it."""
    traits = [kind.traits for kind in REGISTRY.values() if kind.traits.cause]
    return sorted((each.title, each.meaning) for each in traits)


def _row(found: Plausible) -> tuple[str, ...]:
    ends = (f'{found.low:.4g}', f'{found.high:.4g}')
    spread = 'any' if found.sd == float('inf') else f'{found.sd:.4g}'
    return (spread, *(ends if found.by_robot is None else ('by robot',) * 2), found.source)
