# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the proof of the gate tries: drawn recordings, and those of real arms."""

from __future__ import annotations

from collections.abc import Sequence

from weld_twin_nodes.offline.task_pool import Task

from .measured import ARMS, NOT_HERE, ONE_PLACE, SPLITS, axis_spared, found_out, spared
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


def real(
    places: Sequence[str], kinds: Sequence[str], draws: int, sound: int, engine: str
) -> list[Task]:
    """
    Return mistakes in stations of two real arms, then poor parts of them and a servo axis.

    Parameters
    ----------
    places : sequence of str
        Directories of the UR5, of the UR10 and of the servo axis.
    kinds : sequence of str
    draws : int
        Of every kind and arm.
    sound : int
        Draws of stations of either arm, besides its splits.
    engine : str

    """
    arms = list(zip(places, ARMS, strict=False))
    wrong = [
        Task(found_out, (folder, arm, kind, number, engine), f'{kind} {arm}')
        for kind in kinds
        for folder, arm in arms
        for number in range(draws)
        if kind not in NOT_HERE and (kind, arm) not in ONE_PLACE
    ]
    poor = [
        Task(spared, (folder, arm, number, engine), arm)
        for folder, arm in arms
        for number in range(SPLITS + sound)
    ]
    return [*wrong, *poor, Task(axis_spared, (places[-1], engine), 'servo axis')]
