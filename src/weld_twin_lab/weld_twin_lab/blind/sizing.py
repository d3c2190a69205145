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


def sized(
    cell: BlindCell, causes: Sequence[Cause], taken: Take, wanted: float
) -> tuple[list[Cause], Array]:
    """
    Return causes grown together until their deviation is so many times the noise, and the deviation.

    Raises NotVisible: one would have to be implausibly large or small.
    """
    factor = 1.0
    for _ in range(4):
        grown = [scaled(cause, factor) for cause in causes]
        off = deviation(cell, grown, taken)
        ratio = rms(off) / cell.noise
        if 1.0 / NEAR < ratio / wanted < NEAR:
            break
        factor *= wanted / max(ratio, 1e-9)
        if not all(plausible(cell.robot, cause, factor) for cause in causes):
            names = ', '.join(cause['effect'] for cause in causes)
            raise NotVisible(f'{names} is {ratio:.3g} times the noise, wanted {wanted:.3g}')
    return grown, off


def drawn_size(stratum: tuple[float, float], rng: np.random.Generator) -> float:
    """Return how many times the noise a cause of a stratum of `STRATA` is to be."""
    return float(np.exp(rng.uniform(*np.log(stratum))))


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
        wanted = drawn_size(stratum, rng)
        try:
            (cause,), off = sized(cell, [draw(family, cell.robot, span, rng)], taken, wanted)
        except NotVisible as error:
            reason = error
            continue
        if all(correlation(off, other) < ALIKE for other in others):
            return cause, off
        reason = NotVisible(f'{family} moves the tool as another cause does')
    raise reason
