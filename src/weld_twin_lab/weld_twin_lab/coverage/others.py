# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is promised of programs, of arms that touched things and of years, and what came of it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.errors import TwinError
from weld_twin_core.recording import JointMotion, Recording

from ..blind.blind_cell import at_stations
from ..blind.recorded_motion import RATE
from ..fleet.cheap_years import cheap_year
from ..fleet.full_years import CHECKS, base
from ..plant.tracker import Tracker
from ..programs.cells import CELLS
from ..programs.corrections import promised_and_true, seam_driven
from ..programs.plain_controller import evenly
from ..programs.sealed_seams import BARE, sealed_seam
from .held import twin_for
from .sealed import of_drawn, of_motion, on_an_arm
from .touched import SOCKETS, made, postures_at

YEARS = 10
"""Drawn years of a cell whose checks were diagnosed."""
PLACE = (0.3, 0.35, 0.45)
"""A place [m] that nothing touched, within reach of all arms."""
EACH = 15
"""New postures at every place, touched or not."""


def of_seam(language: str, seed: int, number: int) -> dict[str, Any] | None:
    """
    Return what is promised of an arm and of a seam before and after it is corrected, and what is true.

    None where no seam can be drawn.
    """
    try:
        seam = sealed_seam(language, seed, number)
    except TwinError:
        return None
    named, along = seam.case.causes, seam_driven(seam, seam.text)
    turn = number + sorted(CELLS).index(language)
    case = on_an_arm(replace(seam.case, cell=seam.cell), seed, turn)
    recorded = case.train._replace(command=seam.command(*evenly(along, RATE, BARE)), seed=seed)
    case = replace(case, also=(recorded,))
    entry, found = of_drawn(f'{seed} {language} {number}', case, named)
    if found is None:
        return entry
    told = promised_and_true(replace(seam, case=case), along, found)
    promises = entry['promises']
    for when, one in (told['promised'] or {}).items():
        rms, worst = told['off_m'][when]
        promises[f'program {when}'] = [{'ci90': one['ci90_m'], 'true': rms}]
        within = {'ci90': [0.0, one['sure_within_m']], 'true': worst}
        promises[f'program {when}, within (95 %)'] = [within]
    return {**entry, 'outcome': told['outcome']}


def of_touches(seed: int) -> dict[str, Any]:
    """Return what regions of poses hold that were learned by touching things alone."""
    case = made(seed)
    found = diagnose(case.recording, case.robot)
    entry = {**_plant(f'touches {seed}'), 'group': 'contacts', 'status': found.status}
    if found.posterior is None or case.cause['effect'] == 'base_pose':
        # Where the base stands touches say nothing of, and nobody asks.
        return entry
    rng = np.random.default_rng([seed, 1])
    places = [*SOCKETS, np.array(PLACE)]
    q = np.concatenate([postures_at(case.robot, place, EACH, rng) for place in places])
    real = at_stations(case.robot, [case.cause], q, Tracker(), np.random.default_rng(0))
    asked = Recording('true', JointMotion(real.t, q, static=True))
    told = twin_for(found.model, case.recording, asked).poses(asked, real.t).position
    seen = replace(real, position=_where_it_stands(real.position, told))
    return entry | of_motion(found, case.recording, asked.with_measured(seen))


def _where_it_stands(points: Array, told: Array) -> Array:
    """Return points moved as one onto those told: touches do not see where the base stands."""
    middle, goal = points.mean(axis=0), told.mean(axis=0)
    turn, _ = Rotation.align_vectors(told - goal, points - middle)
    return np.asarray(goal + turn.apply(points - middle))


def of_years(seed: int, number: int) -> dict[str, Any]:
    """Return what is foretold of the wear of a cell, and how large changes are told to be."""
    checks = [base(seed, number, check) for check in range(CHECKS)]
    promises: dict[str, list[dict[str, Any]]] = {'forecasts': [], 'changes in a year': []}
    for year in range(YEARS):
        for event in cheap_year(seed, YEARS * number + year, checks)['events']:
            if event['forecast'] is not None:
                low, _, high = event['forecast']['weeks']
                told = {'ci90': [low, high], 'true': event['forecast']['true']}
                promises['forecasts'].append(told)
            if event['size'] is not None:
                promises['changes in a year'].append(event['size'])
    return {**_plant(f'cell {number}'), 'promises': promises}


def _plant(name: str) -> dict[str, Any]:
    return {'name': name, 'source': 'plant', 'group': 'unseen'}
