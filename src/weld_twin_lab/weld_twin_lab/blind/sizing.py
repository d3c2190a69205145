# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Causes made as large, against the noise, as the case wants them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from weld_twin_core.arrays import Array

from .blind_cell import BlindCell, Take, deviation
from .cause_sizes import MOVING, Cause, draw, plausible, scaled, site
from .deck import STRATA
from .displacement import correlation, rms

TRIES = 6
"""Sizes and places drawn for one cause before another cell is drawn."""
ALIKE = 0.95
"""Correlation of two deviations from which they are one to whoever measures."""
NEAR = 1.15
"""A size is right when it is wrong by no more than this factor."""


class NotVisible(Exception):
    """No plausible cause of the family is as large as wanted on this motion."""


def sized(cell: BlindCell, cause: Cause, taken: Take, wanted: float) -> tuple[Cause, Array]:
    """
    Return a cause grown until its deviation is so many times the noise, and the deviation.

    Raises NotVisible: it would have to be implausibly large or small.
    """
    factor = 1.0
    for _ in range(4):
        trial = scaled(cause, factor)
        off = deviation(cell, [trial], taken)
        ratio = rms(off) / cell.noise
        if 1.0 / NEAR < ratio / wanted < NEAR:
            return trial, off
        factor *= wanted / max(ratio, 1e-9)
        if not plausible(cell.robot, cause, factor):
            raise NotVisible(
                f'{cause["effect"]} is {ratio:.3g} times the noise, wanted {wanted:.3g}'
            )
    return trial, off


def draw_causes(
    cell: BlindCell,
    families: Sequence[str],
    strata: Sequence[int],
    taken: Take,
    rng: np.random.Generator,
) -> tuple[list[Cause], list[float]]:
    """
    Return causes of the families, and how many times the noise each is.

    Raises NotVisible: a family cannot be seen on this motion.
    """
    causes: list[Cause] = []
    offs: list[Array] = []
    for family, stratum in zip(families, strata, strict=True):
        cause, off = _one(cell, family, STRATA[stratum], taken, offs, rng)
        if site(cause) in map(site, causes):
            raise NotVisible(f'{family} twice at one place')
        causes.append(cause)
        offs.append(off)
    return causes, [rms(off) / cell.noise for off in offs]


def _one(
    cell: BlindCell,
    family: str,
    stratum: tuple[float, float],
    taken: Take,
    others: Sequence[Array],
    rng: np.random.Generator,
) -> tuple[Cause, Array]:
    if taken.command.static and family in MOVING:
        raise NotVisible(f'{family} shows in motion only')
    span = float(taken.command.t[-1] - taken.command.t[0])
    reason = NotVisible(family)
    for _ in range(TRIES):
        wanted = float(np.exp(rng.uniform(*np.log(stratum))))
        try:
            cause, off = sized(cell, draw(family, cell.robot, span, rng), taken, wanted)
        except NotVisible as error:
            reason = error
            continue
        if all(correlation(off, other) < ALIKE for other in others):
            return cause, off
        reason = NotVisible(f'{family} moves the tool as another cause does')
    raise reason


def sized_together(
    cell: BlindCell, causes: Sequence[Cause], taken: Take, stratum: int, rng: np.random.Generator
) -> tuple[list[Cause], float]:
    """
    Return causes grown together, and how many times the noise their deviation is.

    Raises NotVisible: they would have to be implausibly large or small.
    """
    wanted = float(np.exp(rng.uniform(*np.log(STRATA[stratum]))))
    factor = 1.0
    for _ in range(4):
        grown = [scaled(cause, factor) for cause in causes]
        ratio = rms(deviation(cell, grown, taken)) / cell.noise
        if 1.0 / NEAR < ratio / wanted < NEAR:
            break
        factor *= wanted / max(ratio, 1e-9)
        if not all(plausible(cell.robot, cause, factor) for cause in causes):
            raise NotVisible(f'the construction is {ratio:.3g} times the noise')
    return grown, ratio
