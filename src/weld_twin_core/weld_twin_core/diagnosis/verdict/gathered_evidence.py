# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the verdict is drawn from, gathered from the fits and the unseen stretches."""

from __future__ import annotations

from ...arm.robot import Robot
from ...effects.effect import Effect
from ...effects.plausible import beyond
from ..algebra.noise_floor import NoiseFloor
from ..beliefs import Beliefs
from ..hypotheses.search import Search
from ..many.weighed_families import weighed_families
from ..result import Shrink, Site
from ..unseen.leftover_structure import Structure
from ..unseen.unseen_stretches import Unseen
from .evidence import Evidence


def gathered(
    found: Search,
    unseen: Unseen,
    leftover: Structure,
    shrink: Shrink,
    floor: NoiseFloor,
    beliefs: Beliefs,
    least: float | None = None,
    chance: float = 1.0,
) -> Evidence:
    """
    Return the evidence for a verdict.

    Parameters
    ----------
    leftover : Structure
        What generic columns still find beside it.
    shrink : Shrink
        On held-out recordings or on stretches taking their turn.
    least : float or None
        As `borne_out` gives it.
    chance : float
        As `reached_by_chance` gives it.

    """
    robot = found.final.model.robot
    return Evidence(
        slots=found.slots,
        structure=leftover,
        gap=shrink.rms_before_m,
        after=shrink.rms_after_m,
        floor=floor.rms_m,
        fitted=unseen.rms(unseen.whole),
        independent=floor.independent,
        parts=_parts(unseen),
        refused=tuple(_refused(robot, e) for e in found.refused if beyond(robot, e)),
        lacking=tuple(_lacking(e) for e in found.refused if not beyond(robot, e)),
        families=weighed_families(found, unseen, beliefs) if found.dense else None,
        least=least,
        chance=chance,
    )


def _parts(unseen: Unseen) -> tuple[float, ...]:
    """Return the squared contribution of every effect over the square of their sum."""
    parts = unseen.targets[1:]
    total = parts.sum(axis=0)
    return tuple(float(p @ p) / max(float(total @ total), 1e-300) for p in parts)


def _refused(robot: Robot, effect: Effect) -> str:
    """Return an effect that no machine has, with the values that say so."""
    units = {parameter.name: parameter.unit for parameter in effect.parameters}
    values = ', '.join(
        f'{name} {value:.3g} {units[name]} (the limit of machines is {limit:.3g})'
        for name, value, limit in beyond(robot, effect)
    )
    return f'{Site(effect.name, effect.site)} with {values}'


def _lacking(effect: Effect) -> str:
    """Return an effect that was taken out of the library."""
    return f'{Site(effect.name, effect.site)}, which was taken out of the library'
