# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What effects, and sections of the sheet, say of themselves: the rows of tables."""

from __future__ import annotations

from weld_twin_core.effects import REGISTRY, MemoryEffect, Plausible
from weld_twin_core.effects.effect import SLIDING_UNITS, Effect
from weld_twin_report.report.sections import sections

HEADER = ('effect', 'parameter', 'unit', 'spread', 'least', 'most', 'source')
EFFECTS = ('effect', 'of', 'parameters', 'options', 'formula', 'needs', 'memory', 'derivative')


def effect_rows() -> list[tuple[str, ...]]:
    """Return a row for every effect, in the order in which they act."""
    kinds = sorted(REGISTRY.values(), key=lambda kind: (kind.stage, kind.name))
    return [
        (
            f'`{kind.name}`',
            kind.of,
            ', '.join(f'`{p.name}` {p.unit}' for p in kind.parameters),
            ', '.join(f'`{name}`' for name in kind.options),
            kind.traits.formula,
            ', '.join(sorted(kind.needs)),
            'yes' if issubclass(kind, MemoryEffect) else 'no',
            _exact(kind),
        )
        for kind in kinds
    ]


def _exact(kind: type[Effect]) -> str:
    """Return which parameters have an exact derivative."""
    without = [f'`{p.name}`' for p in kind.parameters if not p.differentiable]
    if len(without) == len(kind.parameters):
        return 'none'
    return 'all but ' + ', '.join(without) if without else 'all'


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


def word_rows() -> list[tuple[str, str]]:
    """Return the words that sections of the sheet explain themselves, with their meanings."""
    return sorted(item for section in sections() for item in section.words.items())


def _row(found: Plausible) -> tuple[str, ...]:
    ends = (f'{found.low:.4g}', f'{found.high:.4g}')
    spread = 'any' if found.sd == float('inf') else f'{found.sd:.4g}'
    return (spread, *(ends if found.by_robot is None else ('by robot',) * 2), found.source)
