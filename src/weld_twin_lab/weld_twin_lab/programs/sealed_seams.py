# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A seam on an arm with sealed causes: drawn, and run by the plant."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arm.catalog import names
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError, PathError
from weld_twin_core.motion.planned_motion import plan
from weld_twin_core.motion.profiles import Smooth
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.programs import Context, controller_of
from weld_twin_nodes.offline.exporting import Speeds, export

from ..blind.blind_cell import RATE, BlindCell, as_recording, drawn_seam, record
from ..blind.making import Lot, SealedCase, draw_case, lots, one_arm
from ..plant.exponentials import Command, PlantRecording
from ..plant.plant import run
from ..plant.tracker import Tracker
from . import plain as readers
from .plain import Driven, evenly

PULSES = (1000.0, -1200.0, 1100.0, 900.0, -800.0, 700.0)
"""Per degree, of the axes of the Yaskawa arm: of the usual size, with both signs."""


class ProgramCell(NamedTuple):
    """A robot, the suffix of its programs, and an independent reader."""

    robot: str
    suffix: str
    reader: Callable[..., readers.Moves]
    maker: str = ''
    """What the bundled robots that the language drives are called."""


CELLS: dict[str, ProgramCell] = {
    'urscript': ProgramCell('ur5', '.script', readers.urscript, 'ur'),
    'krl': ProgramCell('kuka_kr16_2', '.src', readers.krl, 'kuka_kr'),
    'rapid': ProgramCell('abb_irb1600', '.mod', readers.rapid, 'abb'),
    'inform': ProgramCell('yaskawa_ma1440', '.jbi', readers.inform, 'yaskawa'),
    'fanuc-ls': ProgramCell('fanuc_m10ia', '.ls', readers.fanuc, 'fanuc'),
    'joint-trajectory': ProgramCell('ur5', '.yaml', readers.trajectory),
    'csv': ProgramCell('ur5', '.csv', readers.table),
}
"""By language."""


def robots_of(language: str) -> list[str]:
    """Return the bundled robots that a language drives; KUKA's iiwa speaks Java."""
    return [name for name in names() if name.startswith(CELLS[language].maker)]


def reader_of(language: str, robot: Robot) -> Callable[[readers.Texts], readers.Moves]:
    """Return the independent reader for a robot, whose joints have names of their own."""
    if language in ('joint-trajectory', 'csv'):
        return partial(CELLS[language].reader, joints=robot.joint_names)
    return CELLS[language].reader


def context_on(language: str, robot: Robot) -> Context:
    """Return what a program is read with on a robot that has a torch; it is tool 0 and 1."""
    flange = controller_of(robot, language).flange
    tool = np.linalg.inv(flange) @ robot.T_flange_tool
    controller = controller_of(robot, language, {'0': tool, '1': tool})
    return Context(robot, controller, np.array(PULSES))


KINDS = ('single', 'double', 'triple')
"""Cases with their causes in the library: what is at work can be known."""
SEAMS = ('line', 'arc', 'circle', 'polyline', 'spline')
"""A weave is left out: as straight pieces it has some hundreds of points."""
SPEED = (0.01, 0.04)
"""Of the tool [m/s]: gas metal arc welding is between these."""
RECORDED = 30.0
"""Length of the free motion that is recorded [s]."""
BARE = 0.5
"""What is recorded of the stay at either end of a seam [s]: over longer stays an outlier of the
instrument is taken for a tool that moves while the joints are stuck."""
DECKS, APART = 4, 10**6
"""Decks that are tried for a case, and how far apart their seeds are."""
TRIES = 40
"""Seams drawn for a robot before it is given up; many are out of its reach."""
MEASURING = frozenset(
    {
        'measurement_scale',
        'refraction',
        'drift',
        'time_delay',
        'clock_rate',
        'measurement_noise',
        'wear',
    }
)
"""Causes of the instrument, and a tip that wears on: they are recorded, and the tool that is judged has
none of them. How far it is worn when a program runs nobody knows, and whoever corrects one is told."""


@dataclass(frozen=True, eq=False)
class SealedSeam:
    language: str
    case: SealedCase
    """BlindCell, causes, and the free motion."""
    context: Context
    """What programs are read with."""
    kind: str
    """Of the seam."""
    text: str
    """The program."""
    start: Array
    """Joints where the seam begins, shape (n,)."""
    points: int
    """Moves of the program."""
    speed: float
    length: float
    """[m/s, m]"""
    temperature: float | None
    """Of the arm along the seam [degC]; None where it is not recorded."""

    @property
    def cell(self) -> BlindCell:
        """Return the cell; where its base stands is known, for seams are judged in the world."""
        return replace(self.case.cell, align=())

    @property
    def robot(self) -> Robot:
        """Return the robot as whoever diagnoses it knows it."""
        return self.case.cell.robot

    def command(self, t: Array, q: Array) -> Command:
        """Return joints over time, as warm as the arm is and with nothing that pulls at the tool."""
        wrench = np.zeros((t.size, 6)) if self.cell.loaded else None
        warm = None if self.temperature is None else np.full(t.size, self.temperature)
        return Command(t, q, False, wrench, warm)

    def ran(self, t: Array, q: Array, without: frozenset[str] = MEASURING) -> PlantRecording:
        """Return where the real tool is at stamps (N,) [s], seen by an instrument free of error."""
        causes = [cause for cause in self.case.causes if cause['effect'] not in without]
        return run(
            self.robot.to_mapping(),
            [*self.cell.known, *causes],
            self.command(t, q),
            Tracker(),
            np.random.default_rng(0),
            self.cell.richness,
        )

    def recordings(self, along: Driven, seed: int) -> list[Recording]:
        """Return what the cell's instruments record of the free motion and once along the seam."""
        cell, case = self.cell, self.case
        free = record(cell, case.causes, case.train)
        taken = case.train._replace(command=self.command(*evenly(along, RATE, BARE)), seed=seed)
        seam = record(cell, case.causes, taken)
        return [as_recording('free', free), as_recording('seam', seam)]


def sealed_seam(language: str, seed: int, number: int) -> SealedSeam:
    """Return a seam of a language; raises DataError where causes cannot be seen or nothing be welded."""
    rng = np.random.default_rng([seed, number, sorted(CELLS).index(language)])
    case = _dealt(language, seed, number, rng)
    warm = case.train.command.temperature
    context = context_on(language, case.cell.robot)
    for _ in range(TRIES):
        kind, speed = str(rng.choice(SEAMS)), float(rng.uniform(*SPEED))
        q, seam, torch = drawn_seam(case.cell.robot, rng, (kind,))
        try:
            way = plan(case.cell.robot, seam, Smooth(speed=speed), torch=torch, fit=True, seed=q)
            made, text, _ = export(way, context, language, 'seam', Speeds(), 1, speed)
        except (PathError, DataError):
            continue
        at = None if warm is None else float(warm[-1])
        start, count = made.moves[0].q, len(made.moves)
        return SealedSeam(language, case, context, kind, text, start, count, speed, way.length, at)
    raise DataError(f'none of {TRIES} seams drawn for {case.cell.robot.name} can be welded')


def _dealt(language: str, seed: int, number: int, rng: np.random.Generator) -> SealedCase:
    """Return a case; causes that do not show on a robot give way to those of another deck."""
    why = DataError(language)
    for deck in range(DECKS):
        try:
            lot = lot_of(language, seed, number, deck)
            return one_arm(draw_case(lot, rng, (RECORDED, RECORDED)))
        except DataError as error:
            why = error
    raise why


def lot_of(language: str, seed: int, number: int, deck: int = 0) -> Lot:
    """Return what a case is to be: all languages draw from one deck, each its robots in turn."""
    place = sorted(CELLS).index(language)
    deal = len(CELLS) * number + place
    robots = robots_of(language)
    turn = np.random.default_rng([seed, place]).permutation(len(robots))
    robot = robots[int(turn[number % len(robots)])]
    return replace(lots(seed + APART * deck, deal + 1, KINDS)[deal], robot=robot, motion='free')


def drawn_as(seam: SealedSeam) -> dict[str, Any]:
    lot = seam.case.lot
    return {
        'language': seam.language,
        'robot': seam.robot.name,
        'kind': lot.kind,
        'causes': seam.case.causes,
        'ratios': seam.case.ratios,
        'seam': seam.kind,
        'points': seam.points,
        'speed': seam.speed,
        'length': seam.length,
    }
