# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Say what changed, since when, and where it leads.

A change is told where it is more than chance: one false alarm in a year of weekly looks.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence

from weld_twin_nodes.cli.parsing import Adder

from .database_options import add_database, opened

EXAMPLE = 'weld-twin history changed --cell line3 --since 2026-03-31'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add = Adder(parser)
    add('--cell', 'NAME', 'whose history it is', required=True)
    add('--since', 'DATE', 'only what changed after it')
    text = (
        'largest value allowed of an effect, SI units, such as backlash=0.0017; may be given again'
    )
    add('--limit', 'EFFECT=VALUE', text, many=True)
    add('--json', 'print JSON instead of sentences')
    add_database(parser)


def run(args: argparse.Namespace) -> int:
    """Print what changed."""
    from weld_twin_nodes.wording.quantities import counted
    from weld_twin_report.history import observations
    from weld_twin_report.history.changed_words import (
        as_dict,
        forecast,
        forecast_sentence,
        sentence,
        since,
    )
    from weld_twin_report.history.entry import instant
    from weld_twin_report.history.tracking import DAY, changed

    limits = _limits(args.limit)
    with opened(args) as database:
        entries = database.entries(args.cell)
    seen = observations(entries)
    day = instant(args.since).timestamp() / DAY if args.since else None
    everything = changed(entries, seen)
    result = since(everything, day)
    ahead = [forecast(change, seen, everything, limits) for change in result]
    if args.json:
        rows = [
            {**as_dict(change), 'forecast': reported}
            for change, reported in zip(result, ahead, strict=True)
        ]
        print(json.dumps({'cell': args.cell, 'diagnoses': len(seen), 'changes': rows}, indent=2))
        return 0
    if not result:
        many = counted(len(seen), 'diagnosis', 'diagnoses')
        print(f'{args.cell}: nothing changed by more than chance in {many}')
    for change, reported in zip(result, ahead, strict=True):
        print(f'{args.cell}: {sentence(change)}')
        if reported is not None:
            print(f'{args.cell}: {forecast_sentence(change, reported)}')
    return 0


def _limits(given: Sequence[str]) -> dict[str, float]:
    from weld_twin_core.effects import REGISTRY
    from weld_twin_core.errors import DataError

    out = {}
    for text in given:
        effect, _, value = text.partition('=')
        try:
            out[effect] = float(value)
        except ValueError:
            raise DataError(
                f"--limit '{text}' is not EFFECT=VALUE, such as backlash=0.0017"
            ) from None
        if effect not in REGISTRY:
            raise DataError(
                f'--limit: there is no effect {effect!r}; known are {", ".join(sorted(REGISTRY))}'
            )
    return out
