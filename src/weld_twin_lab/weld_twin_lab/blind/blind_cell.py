# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The cell a case is recorded in: robot with its torch, instruments, surroundings, motions.

Its motions are weld seams one after another, free motions of the joints, or stations.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from weld_twin_core.arm import catalog
from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import matrix_from_quaternion
from weld_twin_core.arrays import Array
from weld_twin_core.errors import PathError
from weld_twin_core.motion.paths import Arc, Circle, Line, Path, Polyline, Spline, Torch, Weave
from weld_twin_core.motion.paths import default_seam as bundled_seam
from weld_twin_core.motion.planned_motion import plan
from weld_twin_core.motion.profiles import Aggressive, Profile, Smooth
from weld_twin_core.recording import JointMotion, Measurements, Recording, Signal

from ..plant.exponentials import Command, PlantRecording
from ..plant.plant import run
from ..plant.tracker import Tracker
from .cause_sizes import Cause
from .scoring import rigid, rms

KINDS = ('line', 'arc', 'circle', 'polyline', 'spline', 'weave')
SIZE = (0.1, 0.3)
"""Length of a seam [m]."""
TRIES = 40
"""Seams drawn for a robot before it is given up; many are out of its reach."""
LONGEST = 2.0
"""How many times as long as wanted a seam may take where the joints are slow."""


def seam_motion(robot: Robot, span: float, rate: float, rng: np.random.Generator) -> Array:
    """Return joint positions along one seam, (N, n); raises PathError where none drawn can be welded."""
    most = int(np.ceil(LONGEST * span * rate))
    for _ in range(TRIES):
        q, seam, torch = drawn_seam(robot, rng)
        law: Profile = Smooth(speed=seam.length / span)
        if rng.random() < 0.5:
            law = Aggressive(speed=float(rng.uniform(0.05, 0.2)), reversals=6)
        try:
            moved = plan(
                robot, seam, law, rate, torch=torch, fit=True, seed=q, most_samples=most
            ).motion.q
        except PathError:
            continue
        if len(moved) < LONGEST * span * rate:
            return np.array(moved)
    raise PathError(f'none of {TRIES} seams drawn for {robot.name} is within its reach')


def drawn_seam(
    robot: Robot, rng: np.random.Generator, kinds: Sequence[str] = KINDS
) -> tuple[Array, Path, Torch]:
    """Return a posture near the working one, shape (n,), a seam through its tool, and the torch."""
    q = working_posture(robot) + rng.uniform(-0.4, 0.4, robot.n)
    seam = _seam(str(rng.choice(kinds)), forward(robot, q), float(rng.uniform(*SIZE)), rng)
    return q, seam, Torch(work=rng.uniform(-0.2, 0.2), travel=rng.uniform(-0.2, 0.2))


def working_posture(robot: Robot) -> Array:
    """Return a posture that bends the arm and stays away from the limits, shape (n,)."""
    bare = robot.with_frames(tool=np.eye(4))
    key = json.dumps(bare.to_mapping())
    if key not in _POSTURES:
        q = plan(bare, bundled_seam(bare, 'line'), 'smooth', 10.0, fit=True).motion.q
        _POSTURES[key] = np.asarray(q[len(q) // 2])
    return np.array(_POSTURES[key])


_POSTURES: dict[str, Array] = {}
"""By what robots say of themselves: every case has an object of its own."""


def _seam(kind: str, pose: Array, size: float, rng: np.random.Generator) -> Path:
    """Return a seam through the tool's place, on work that faces the torch."""
    centre, normal = pose[:3, 3], -pose[:3, 2]
    turn = rng.uniform(0.0, 2.0 * np.pi)
    along = np.cos(turn) * pose[:3, 0] + np.sin(turn) * pose[:3, 1]
    across = np.cross(normal, along)

    def points(*plane: tuple[float, float]) -> Array:
        local = size * np.array(plane)
        return np.asarray(centre + local[:, :1] * along + local[:, 1:] * across)

    start, end = points((-0.5, 0.0), (0.5, 0.0))
    line = Line(start, end, normal)
    if kind == 'arc':
        first, middle, last = points((-0.45, -0.15), (0.0, 0.15), (0.45, -0.15))
        return Arc(first, middle, last, normal)
    if kind == 'circle':
        return Circle(centre, 0.3 * size, normal, along)
    if kind == 'polyline':
        corners = points((-0.4, -0.2), (-0.4, 0.2), (0.0, 0.0), (0.4, 0.2), (0.4, -0.2))
        return Polyline(corners, 0.03 * size, normal)
    if kind == 'spline':
        bends = points((-0.5, 0.0), (-0.25, 0.15), (0.0, 0.0), (0.25, -0.15), (0.5, 0.0))
        return Spline(bends, normal)
    return Weave(line, 0.01 * size, 0.05 * size) if kind == 'weave' else line


RATE = 125.0
"""Joint states a second."""
STATION_PAUSE = 2.0
"""Seconds from one station to the next."""
AIR_SPEED = 0.5
"""Mean joint speed [rad/s] from one seam to the next."""
RAMP = 2.0
"""Seconds in which a free motion sets in."""


class Motion(NamedTuple):
    """Stamps (N,) [s], joint positions (N, n), and whether each is a station at rest."""

    t: Array
    q: Array
    static: bool = False


def motion(kind: str, robot: Robot, span: float, rng: np.random.Generator) -> Motion:
    """Return 'seams', 'free' or 'stations' drawn at random, about so long [s]; 2 s for every station."""
    return {'seams': _seams, 'free': _free, 'stations': _stations}[kind](robot, span, rng)


def _seams(robot: Robot, span: float, rng: np.random.Generator) -> Motion:
    """Return seams at random places, with motion through the air between them."""
    pieces: list[Array] = []
    while sum(map(len, pieces)) < 0.8 * span * RATE:
        piece = seam_motion(robot, 0.35 * span, RATE, rng)
        if pieces:
            pieces.append(_air(pieces[-1][-1], piece[0]))
        pieces.append(piece)
    q = np.concatenate(pieces)
    return Motion(np.arange(len(q)) / RATE, q)


def _air(start: Array, end: Array) -> Array:
    """Return a quintic from rest to rest between two postures, without its ends, (N, n)."""
    count = max(int(RATE * np.abs(end - start).max() / AIR_SPEED), 12)
    s = np.arange(1, count) / count
    return start + (end - start) * (s**3 * (10.0 - 15.0 * s + 6.0 * s * s))[:, None]


def _free(robot: Robot, span: float, rng: np.random.Generator) -> Motion:
    """Return sums of slow sines about a working posture, every joint on its own."""
    t = np.arange(0.0, span, 1.0 / RATE)
    centre = working_posture(robot)
    ramp = np.clip(t / RAMP, 0.0, 1.0)
    ramp = ramp * ramp * (3.0 - 2.0 * ramp)
    waves = np.zeros((t.size, robot.n))
    for i in range(robot.n):
        for _ in range(3):
            rate, size = rng.uniform(0.03, 0.35), rng.uniform(0.05, 0.25)
            waves[:, i] += size * np.sin(2.0 * np.pi * rate * t + rng.uniform(0.0, 2.0 * np.pi))
    q = centre + rng.uniform(-0.3, 0.3, robot.n) + waves * ramp[:, None]
    return Motion(t, _inside(robot, q))


def _stations(robot: Robot, span: float, rng: np.random.Generator) -> Motion:
    count = max(int(2.5 * span), 40)
    spread = np.minimum(0.4 * (robot.upper - robot.lower), 1.2)
    q = working_posture(robot) + rng.uniform(-1.0, 1.0, (count, robot.n)) * spread
    t = np.linspace(0.0, STATION_PAUSE * (count - 1), count)
    return Motion(t, _inside(robot, q), static=True)


def _inside(robot: Robot, q: Array) -> Array:
    """Return the motion squeezed about its middle where it would leave a joint's range."""
    low, high = q.min(axis=0), q.max(axis=0)
    room = 0.95 * (robot.upper - robot.lower)
    middle = 0.5 * (low + high)
    squeeze = np.minimum(1.0, room / np.maximum(high - low, 1e-9))
    reach = 0.5 * squeeze * (high - low)
    edge = 0.02 * (robot.upper - robot.lower)
    centre = np.clip(middle, robot.lower + reach + edge, robot.upper - reach - edge)
    return np.asarray(centre + squeeze * (q - middle))


SPANS = (20.0, 60.0)
"""Length [s] of a recording, drawn between these."""
RICHNESS = (0.0, 1.0)
"""How far the physics goes beyond the textbook, drawn between these."""
DISTANCE = (3.5, 8.0)
"""How far [m] a tracker stands from the arm where its line of sight matters, drawn between
these; an arm and its torch reach up to 2 m."""
GROSS = 6.0
"""Standard deviations from which a measurement is an outlier."""


@dataclass(frozen=True, eq=False)
class BlindCell:
    robot: Robot
    tracker: Tracker
    known: tuple[Cause, ...] = ()
    """At work and told to the diagnosis."""
    align: tuple[str, ...] = ()
    """Frames that the diagnosis is to fit."""
    loaded: bool = False
    warming: bool = False
    """Whether a wrench, or a temperature, is at work and recorded."""
    richness: float = 1.0
    """How far the plant's physics goes beyond the textbook."""

    @property
    def noise(self) -> float:
        """Return the RMS length of the measurement noise [m]."""
        return float(np.sqrt(3.0)) * self.tracker.sigma


class Take(NamedTuple):
    """One run of a motion: the command and the seed of everything random in it."""

    command: Command
    seed: int


def draw_cell(
    robot: str, kind: str, families: Sequence[str], rng: np.random.Generator
) -> BlindCell:
    """Return a cell in which causes of these families can be seen."""
    arm = catalog.load(robot).with_frames(tool=_torch(rng))
    known: tuple[Cause, ...] = ()
    if 'payload' in families:
        arm = replace(arm, payload_mass=float(rng.uniform(1.0, 4.0)))
        known = _springs(arm.joint_names[1:4], rng)
    elif 'hose_pull' in families:
        known = _springs(arm.joint_names[:4], rng)
    if 'refraction' in families:
        arm = arm.with_frames(base=_far(rng))
    spring = {'joint_compliance', 'loaded_play'} & set(families)
    return BlindCell(
        arm,
        _tracker(kind, rng),
        known,
        align=('base',) if rng.random() < 0.1 and 'base_pose' not in families else (),
        loaded='cartesian_compliance' in families or (bool(spring) and rng.random() < 0.5),
        warming='thermal_growth' in families or rng.random() < 0.2,
        # Springs given as known are exactly what they are said to be.
        richness=0.0 if known else float(rng.uniform(*RICHNESS)),
    )


def fitted_out(cell: BlindCell, align: tuple[str, ...] | None, noise_m: float | None) -> BlindCell:
    """Return a cell with other frames to fit, and an instrument of another noise, RMS length [m]."""
    if align is not None:
        cell = replace(cell, align=align)
    if noise_m is not None:
        cell = replace(cell, tracker=replace(cell.tracker, sigma=noise_m / float(np.sqrt(3.0))))
    return cell


def _springs(joints: Sequence[str], rng: np.random.Generator) -> tuple[Cause, ...]:
    """Return joints that give under a load, by how much being known."""
    return tuple(
        {
            'effect': 'joint_compliance',
            'joint': joint,
            'compliance': float(rng.uniform(1e-5, 3e-5)),
        }
        for joint in joints
    )


def _far(rng: np.random.Generator) -> Array:
    """Return a base as far from the instrument, in its frame, as trackers stand, (4, 4)."""
    base, way = np.eye(4), rng.uniform(-np.pi, np.pi)
    base[:3, :3] = Rotation.from_euler('z', rng.uniform(-np.pi, np.pi)).as_matrix()
    base[:3, 3] = [*(rng.uniform(*DISTANCE) * np.array([np.cos(way), np.sin(way)])), -1.0]
    return base


def _torch(rng: np.random.Generator) -> Array:
    tool = np.eye(4)
    tool[:3, :3] = Rotation.from_euler('y', rng.uniform(0.2, 0.8)).as_matrix()
    tool[:3, 3] = [rng.uniform(0.0, 0.12), rng.uniform(-0.03, 0.03), rng.uniform(0.1, 0.35)]
    return tool


def _tracker(kind: str, rng: np.random.Generator) -> Tracker:
    """Return instruments between a laser tracker and a camera."""
    sigma = float(np.exp(rng.uniform(np.log(1e-5), np.log(5e-5))))
    orientation = bool(rng.random() < 0.7)
    still = {'rate': None, 'drop': 0.0, 'jitter': 0.0}
    moving = {
        'rate': 60.0,
        'drop': float(rng.uniform(0.0, 0.03)),
        'jitter': float(rng.choice([0.0, 2e-5, 5e-5])),
        'joint_jitter': float(rng.choice([0.0, 2e-5])),
        'velocity': bool(rng.random() < 0.8),
    }
    return Tracker(
        sigma=sigma,
        sigma_orientation=float(rng.uniform(3e-5, 2e-4)),
        orientation=orientation,
        outlier_share=float(rng.choice([0.0, 0.002, 0.01])),
        outlier_size=float(rng.uniform(1e-3, 5e-3)),
        wrench_sigma=0.2,
        temperature_rate=1.0,
        temperature_lag=float(rng.uniform(0.0, 5.0)),
        temperature_sigma=0.03,
        **(still if kind == 'stations' else moving),
    )


def take(cell: BlindCell, kind: str, span: float, rng: np.random.Generator) -> Take:
    """Return a motion of a kind in this cell, with what surrounds it."""
    return of_motion(cell, motion(kind, cell.robot, span, rng), rng)


def of_motion(cell: BlindCell, moved: Motion, rng: np.random.Generator) -> Take:
    """Return a given motion in this cell, with what surrounds it."""
    return Take(_command(cell, moved, rng), _seed(rng))


def again(first: Take, rng: np.random.Generator) -> Take:
    """Return the same motion to be recorded another time."""
    return Take(first.command, _seed(rng))


def _seed(rng: np.random.Generator) -> int:
    return int(rng.integers(2**31))


def _command(cell: BlindCell, moved: Motion, rng: np.random.Generator) -> Command:
    t = moved.t
    since, span = t - t[0], t[-1] - t[0]
    wrench = temperature = None
    if cell.loaded:
        wrench = np.zeros((t.size, 6))
        for k in range(3):
            turn = rng.uniform(0.0, 2.0 * np.pi)
            rate = 2.0 * np.pi * rng.uniform(2.0, 8.0) / span
            wrench[:, k] = rng.uniform(10.0, 40.0) * np.sin(rate * since + turn)
    if cell.warming:
        warm = 1.0 - np.exp(-since / (rng.uniform(0.2, 0.6) * span))
        temperature = rng.uniform(19.0, 25.0) + rng.uniform(5.0, 15.0) * warm
    return Command(t, moved.q, moved.static, wrench, temperature)


def record(
    cell: BlindCell, causes: Sequence[Cause], taken: Take, tracker: Tracker | None = None
) -> PlantRecording:
    """Return what the cell with these causes records; the same take gives the same again."""
    rng = np.random.default_rng(taken.seed)
    effects = [*cell.known, *causes]
    return run(
        cell.robot.to_mapping(),
        effects,
        taken.command,
        tracker or cell.tracker,
        rng,
        cell.richness,
    )


def at_stations(
    robot: Robot, causes: Sequence[Cause], q: Array, tracker: Tracker, rng: np.random.Generator
) -> Measurements:
    """Return where the plant's instrument sees the tool of an arm with causes at stations, (M, n)."""
    command = Command(1.0 + np.arange(float(len(q))), q, static=True)
    seen = run(robot.to_mapping(), list(causes), command, tracker, rng)
    return Measurements(command.t, seen.position)


def exact(tracker: Tracker) -> Tracker:
    """Return the instruments without their errors, sampling at the same instants."""
    return replace(
        tracker,
        sigma=0.0,
        sigma_orientation=0.0,
        orientation=True,
        jitter=0.0,
        outlier_share=0.0,
        joint_jitter=0.0,
        wrench_sigma=0.0,
        temperature_sigma=0.0,
    )


def as_recording(name: str, made: PlantRecording) -> Recording:
    rotation = None if made.quaternion is None else matrix_from_quaternion(made.quaternion)
    return Recording(
        name,
        JointMotion(made.t_joint, made.q, None if made.static else made.qd, made.static),
        Measurements(made.t_measured, made.position, rotation),
        _signal(made.wrench_t, made.wrench),
        'tool',
        _signal(made.temperature_t, made.temperature),
    )


def _signal(t: Array | None, value: Array | None) -> Signal | None:
    return None if t is None or value is None else Signal(t, value)


def deviation(cell: BlindCell, causes: Sequence[Cause], taken: Take) -> Array:
    """
    Return how far the causes move the measured position, free of noise, shape (M, 3) [m].

    Samples are compared by their stamps, as whoever measures must.
    """
    moved, ideal = record(cell, causes, taken, exact(cell.tracker)), _ideal(cell, taken)
    off = moved.position - at_stamps(ideal, moved.t_measured)
    return off - rigid(ideal.position, off) if 'base' in cell.align else off


@lru_cache(maxsize=2)
def _ideal(cell: BlindCell, taken: Take) -> PlantRecording:
    """Return what the cell records without a cause and without noise; sizing asks for it often."""
    return record(cell, (), taken, exact(cell.tracker))


def at_stamps(made: PlantRecording, t: Array) -> Array:
    """Return the positions of a recording at other stamps, shape (M, 3) [m]."""
    if made.static:
        return made.position
    return np.asarray(CubicSpline(made.t_measured, made.position)(t))


def floor(cell: BlindCell, causes: Sequence[Cause], taken: Take) -> tuple[float, list[int]]:
    """Return what is left when causes are known, RMS without outliers [m], and the outliers."""
    seen = record(cell, causes, taken)
    quiet = replace(cell.tracker, sigma=0.0, sigma_orientation=0.0, outlier_share=0.0)
    true = record(cell, causes, taken, quiet).position
    noise = seen.position - true
    gross = np.linalg.norm(noise, axis=1) > GROSS * cell.noise
    remaining = noise if seen.static else noise - _by_jitter(cell, causes, taken, seen)
    return rms(remaining[~gross]), [int(k) for k in np.nonzero(gross)[0]]


def _by_jitter(
    cell: BlindCell, causes: Sequence[Cause], taken: Take, seen: PlantRecording
) -> Array:
    """Return how far the tool moves between true instants and their stamps, shape (M, 3) [m]."""
    steady = record(cell, causes, taken, exact(cell.tracker))
    velocity = CubicSpline(steady.t_measured, steady.position)(steady.t_measured, 1)
    return np.asarray(velocity * (seen.t_measured - steady.t_measured)[:, None])


WAYS = ('small', 'still', 'few', 'one')
"""How a motion is made poor."""


def poorer(taken: Take, poor: str, rng: np.random.Generator) -> Take:
    """
    Return the run with less motion.

    poor: one of `WAYS`, or empty for the run as it is: 'small' moves all joints little, 'still'
    holds some of them, 'one' moves one alone, 'few' keeps few of the stations.
    """
    q, command = taken.command.q.copy(), taken.command
    middle = np.median(q, axis=0)
    if poor == 'small':
        q = middle + float(rng.choice([0.02, 0.1, 0.3])) * (q - middle)
    elif poor == 'still':
        still = rng.choice(q.shape[1], int(rng.integers(1, q.shape[1] - 1)), replace=False)
        q[:, still] = middle[still]
    elif poor == 'one':
        moving = int(rng.integers(q.shape[1]))
        q = np.where(np.arange(q.shape[1]) == moving, q, middle)
    elif poor == 'few' and command.static:
        count = int(rng.integers(15, 40))
        wrench = None if command.wrench is None else command.wrench[:count]
        warm = None if command.temperature is None else command.temperature[:count]
        return taken._replace(
            command=replace(
                command, t=command.t[:count], q=q[:count], wrench=wrench, temperature=warm
            )
        )
    return taken._replace(command=replace(command, q=q))
