# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the proof of the gate tries: drawn recordings, and those of real arms."""

from __future__ import annotations

from collections.abc import Sequence

from weld_twin_nodes.offline.task_pool import Task

from .mistakes import MOVING_ONLY
from .trials import WAYS, complaint, mistake


def drawn(seed: int, kinds: Sequence[str], draws: int, sound: int, engine: str) -> list[Task]:
    """Return mistakes of every kind as bags and as tables, then sound recordings."""
    wrong = [
        Task(mistake, (seed, kind, way, number, engine), f'{kind} {way}')
        for kind in kinds
        for way in WAYS
        for number in range(draws)
        if not (way == 'table' and kind in MOVING_ONLY)
    ]
    return [*wrong, *(Task(complaint, (seed, n, engine), 'sound') for n in range(sound))]
