# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The evidence for a verdict, gathered from the fits and from unseen data."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...arm.robot import Robot
from ...effects.effect import Effect
from ...effects.plausible import beyond
from ...recording import Recording
from ..algebra.definite import EMPTY
from ..algebra.noise_floor import NoiseFloor
from ..beliefs import Beliefs
from ..evidence import Evidence, Search
from ..result import Family, Shrink, Site, Structure
from ..unseen.chance import chance_ratio, may_be_chance
from ..unseen.folds import ways_to_divide
from ..unseen.unseen_stretches import Unseen
from .scatter import scattered


def gathered(
    result: Search,
    unseen: Unseen,
    leftover: Structure,
    shrink: Shrink,
    floor: NoiseFloor,
    families: tuple[Family, ...] | None,
    beliefs: Beliefs,
    with_strays: float,
) -> Evidence:
    """Return the evidence for a verdict; with_strays: unseen RMS with readings that are left out [m]."""
    robot, parts = result.final.model.robot, unseen.targets[1:]
    total = parts.sum(axis=0)
    whole = max(float(total @ total), EMPTY)
    recordings = result.problem.recordings
    return Evidence(
        candidate_sets=result.candidate_sets,
        structure=leftover,
        gap=shrink.rms_before_m,
        after=shrink.rms_after_m,
        floor=floor.rms_m,
        independent=floor.independent,
        parts=tuple(float(part @ part) / whole for part in parts),
        refused=tuple(_refused(robot, e) for e in result.refused if beyond(robot, e)),
        lacking=tuple(f'{Site.of(e)}, which was taken out of the library' for e in result.lacking),
        families=families,
        leverage=_leverage(unseen, floor),
        sizes=tuple(unseen.rms(part) for part in parts),
        wandered=() if result.dense else tuple(unseen.wandered().tolist()),
        missed=() if result.dense else tuple(tuple(each) for each in unseen.missed().tolist()),
        rows=result.effective(result.small),
        travel=tuple(np.max([np.ptp(r.joints.q, axis=0) for r in recordings], axis=0).tolist()),
        strays=_named(recordings, result.scale.left_out),
        with_strays=with_strays,
        scattered=scattered(result, unseen, beliefs),
        stations=any(recording.joints.static for recording in recordings),
    )


def _named(
    recordings: Sequence[Recording], strays: Sequence[NDArray[np.bool_]]
) -> tuple[str, ...]:
    """Return where readings stand out, as people count: stations from one."""
    return tuple(
        f'station {k + 1}' if own.joints.static else f't = {own.seen.t[k]:.2f} s'
        for own, part in zip(recordings, strays, strict=True)
        for k in np.flatnonzero(part)
    )


def _leverage(unseen: Unseen, floor: NoiseFloor) -> float:
    """Return the ratio to the floor that noise hardly ever exceeds; one where there are many rows."""
    if not may_be_chance(unseen.residual.size, 0.0):
        return 1.0
    ways = ways_to_divide(unseen.problem)
    columns = unseen.columns.written_out()
    return chance_ratio(columns, unseen.precision, ways, known=floor.independent)


def _refused(robot: Robot, effect: Effect) -> str:
    units = {parameter.name: parameter.unit for parameter in effect.parameters}
    values = ', '.join(
        f'{name} {value:.3g} {units[name]} (the limit of machines is {limit:.3g})'
        for name, value, limit in beyond(robot, effect)
    )
    return f'{Site.of(effect)} with {values}'
