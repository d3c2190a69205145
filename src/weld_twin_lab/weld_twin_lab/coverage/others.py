# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is promised of programs, of arms that touched things and of years, and what came of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from weld_twin_core.arm import catalog
from weld_twin_core.arm.chain import forward, jacobian
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.contacts import Artefact, Contact, Contacts, Tie, spreads
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.errors import TwinError
from weld_twin_core.motion.inverse.newton import STRETCHED, least_step, reaching
from weld_twin_core.recording import JointMotion, Recording

from ..blind.blind_cell import RATE, at_stations
from ..blind.cause_sizes import AT_REST, Cause, draw, scaled
from ..fleet.years import CHECKS, base, cheap_year
from ..plant.tracker import Tracker
from ..programs.corrections import promised_and_true, seam_driven
from ..programs.plain import evenly
from ..programs.sealed_seams import BARE, CELLS, sealed_seam
from .sealed import of_drawn, of_motion, on_an_arm, twin_for

YEARS = 10
"""Drawn years of a cell whose checks were diagnosed."""
PLACE = (0.3, 0.35, 0.45)
"""A place [m] that nothing touched, within reach of all arms."""
EACH = 15
"""New postures at every place, touched or not."""


def of_seam(language: str, seed: int, number: int) -> dict[str, Any] | None:
    """Return what is promised of an arm and a seam, and what is true; None where none can be drawn."""
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


ROUNDS = 4
"""Newton steps in which the plant is made to touch: each leaves a hundredth of what was off."""
TRIES = 60
"""Postures that are started from for each one wanted; some leave the limits."""
TURN = 2.5
"""Largest angle of a joint [rad] that is started from: further ones wind up cables."""
ARMS = ('ur5', 'ur10', 'kuka_iiwa14', 'franka_panda')
"""Arms of which link masses are known, so that every cause can act."""
FAMILIES = (*AT_REST, 'tool_pose', 'base_pose')
"""Causes drawn; the last one no contact sees."""
SOCKETS = np.array([[0.5, 0.1, 0.15], [0.1, 0.5, 0.35], [0.35, -0.35, 0.25]])
"""Places [m] within reach of all of them."""
APART = np.array([0.0, 0.05, 0.0])
"""From one socket of a place to the other [m]."""
TOUCHES = 10
"""Postures per socket."""
SLACK = (5e-6, 5e-5)
"""Of the ball in its socket [m], standard deviation of each coordinate."""
SIZE = (3.0, 15.0)
"""What a cause moves, in slacks."""
LARGEST = 10.0
"""Factor on a drawn cause beyond which it is larger than machines have it."""
TIES = tuple(Tie((f'{k}/0', f'{k}/1'), 0.05, 2e-5) for k in range(len(SOCKETS)))
"""The sockets of a place are 50 mm apart."""


class Sealed(NamedTuple):
    robot: Robot
    cause: Cause
    recording: Recording


def made(seed: int) -> Sealed:
    rng = np.random.default_rng(seed)
    tool = np.eye(4)
    tool[:3, 3] = [0.02, -0.03, 0.15]
    robot = catalog.load(ARMS[seed % len(ARMS)]).with_frames(tool=tool)
    cause = draw(str(rng.choice(FAMILIES)), robot, 1.0, rng)
    slack, size = float(rng.uniform(*SLACK)), float(rng.uniform(*SIZE))
    start, labels, places = _starts(robot, rng)
    recording = _touching(robot, [cause], start, labels, places, rng)
    shown = _shown(robot, recording)
    cause = scaled(cause, min(size * slack / max(shown, 1e-12), LARGEST))
    loose = places + rng.normal(0.0, slack, places.shape)
    recording = _touching(robot, [cause], start, labels, loose, rng)
    return Sealed(robot, cause, recording)


def _starts(robot: Robot, rng: np.random.Generator) -> tuple[Array, list[str], Array]:
    q, labels, places = [], [], []
    for k, middle in enumerate(SOCKETS):
        for socket in (0, 1):
            place = middle + socket * APART
            postures = postures_at(robot, place, TOUCHES, rng)
            q.append(postures)
            labels += [f'{k}/{socket}'] * len(postures)
            places.append(np.tile(place, (len(postures), 1)))
    return np.concatenate(q), labels, np.concatenate(places)


def _shown(robot: Robot, recording: Recording) -> float:
    """Return the spread of the nominal tool point per coordinate, RMS [m]."""
    assert recording.contacts is not None
    points = forward(robot, recording.joints.q)[:, :3, 3]
    away = np.concatenate(list(spreads(recording.contacts, points).values()))
    return float(np.sqrt((away**2).mean() / 3.0))


def postures_at(robot: Robot, place: Array, count: int, rng: np.random.Generator) -> Array:
    """Return nominal postures, ``count`` at most, with the tool point at a place (3,) [m]."""
    low, high = np.maximum(robot.lower, -TURN), np.minimum(robot.upper, TURN)
    start = rng.uniform(low, high, (TRIES * count, robot.n))
    q, near = reaching(robot, np.tile(place, (len(start), 1)), start)
    within = (q > low).all(axis=1) & (q < high).all(axis=1)
    return np.asarray(q[near & within][:count])


def _touching(
    robot: Robot,
    causes: Sequence[Cause],
    q: Array,
    labels: Sequence[str],
    places: Array,
    rng: np.random.Generator,
) -> Recording:
    """Return the joint readings, from postures (M, n) on, at which the plant's tool touches places."""
    for _ in range(ROUNDS):
        real = at_stations(robot, causes, q, Tracker(), rng).position
        q = q + least_step(jacobian(robot, q)[:, :3], places - real, STRETCHED)
    names = tuple(Contact(name) for name in dict.fromkeys(labels))
    motion = JointMotion(1.0 + np.arange(float(len(q))), q, static=True)
    touched = Contacts(Artefact(names, TIES), tuple(labels))
    return Recording('plant', motion, contacts=touched)
