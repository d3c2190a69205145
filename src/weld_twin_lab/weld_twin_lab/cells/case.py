# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One sealed case: a cell of the plant with one cause, told from a tracker or from pixels."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.bundle import seen_by
from weld_twin_core.cameras import Camera, Lens, Sightings, Target
from weld_twin_core.diagnosis import Diagnosis, diagnose
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Measurements, Recording

from ..blind.cause_sizes import AT_REST, Cause, draw, plausible, scaled, site
from ..blind.displacement import rms
from ..plant.exponentials import Command, Motion, compose, exp_screw, from_quaternion, inverse
from ..plant.plant import run
from ..plant.tracker import Eye, Tracker, looking, seen

KINDS = ('arm', 'track and positioner', 'two arms')
ARMS = ('ur5', 'ur10', 'kuka_iiwa14')
"""Arms of standard rows of which link masses are known, so that springs can act."""
QUARTER = float(np.sqrt(0.5))
"""Sine of half a right angle."""
RAIL = {'name': 'rail', 'type': 'prismatic', 'alpha': -np.pi / 2, 'lower': -1.5, 'upper': 1.5}
ALONG = {'xyz': [0.0, 0.0, 0.3], 'quat_xyzw': [0.5, 0.5, 0.5, 0.5]}
"""Foot of a rail that runs along x and carries an upright arm."""
TABLE: dict[str, Any] = {
    'base': {'xyz': [0.2, 1.1, 0.6], 'quat_xyzw': [0.0, QUARTER, 0.0, QUARTER]},
    'tool': {'xyz': [0.1, 0.05, 0.1]},
    'joints': [
        {'name': 'tilt', 'a': 0.05, 'd': 0.2, 'alpha': -np.pi / 2, 'lower': -1.5, 'upper': 1.5},
        {'name': 'turn', 'd': 0.15, 'lower': -3.1, 'upper': 3.1},
    ],
    'links': [{'mass': 120.0, 'com': [0.05, 0.0, 0.0]}, {'mass': 60.0, 'com': [0.05, 0.0, 0.0]}],
}
"""A positioner that tilts about a level axis and turns."""
SWING = 1.1
"""How far [rad] joints of an arm move to either side of a posture with a bent elbow."""
READY = (0.3, -1.2, 1.3, 0.4, 1.0, 0.2, 0.3)
"""That posture [rad]."""


def cell(kind: str, seed: int) -> dict[str, Any]:
    """Return the robot file of a cell of one of `KINDS`; the seed decides which arms."""
    arm = catalog.load(ARMS[seed % len(ARMS)]).to_mapping()
    arm['tool'] = {'xyz': [0.02, -0.03, 0.15]}
    if kind == 'track and positioner':
        links = [{'mass': 200.0, 'com': [0.0, 0.0, 0.0]}, *arm['links']]
        return {
            **arm,
            'base': ALONG,
            'joints': [RAIL, *arm['joints']],
            'links': links,
            'workpiece': TABLE,
        }
    if kind == 'two arms':
        other = catalog.load(ARMS[(seed + 1) % len(ARMS)]).to_mapping()
        joints = [{**joint, 'name': f'left_{joint["name"]}'} for joint in other['joints']]
        tool = {'xyz': [0.0, 0.02, 0.12]}
        base = {'xyz': [0.2, 1.3, 0.0]}
        second = {'base': base, 'tool': tool, 'joints': joints, 'links': other['links']}
        return {**arm, 'workpiece': second}
    return arm


def postures(robot: Robot, count: int, rng: np.random.Generator, swing: float = SWING) -> Array:
    """Return postures, shape (M, n) [rad or m]: arms about `READY`, all else wherever it reaches."""
    low, high = np.empty(robot.n), np.empty(robot.n)
    at = 0
    # From the foot of each branch to its end.
    for k in (*range(robot.behind)[::-1], *range(robot.behind, robot.n)):
        if robot.joint_names[k] in ('rail', 'tilt', 'turn'):
            low[k], high[k] = robot.lower[k], robot.upper[k]
            continue
        ready = READY[at % len(READY)]
        low[k] = max(ready - swing, robot.lower[k])
        high[k] = min(ready + swing, robot.upper[k])
        at += 1
    return np.asarray(rng.uniform(low, high, (count, robot.n)))


def really(
    data: Mapping[str, Any],
    names: Sequence[str],
    causes: Sequence[Cause],
    q: Array,
    rng: np.random.Generator,
) -> Motion:
    """
    Return the torch as the plant has it, seen from the workpiece where there is one.

    names: joints in the order of the postures ``q``, shape (M, n) [rad or m].
    """
    arm = {key: value for key, value in data.items() if key != 'workpiece'}
    torch = _branch(arm, names, causes, q, rng)
    if 'workpiece' not in data:
        return torch
    foot = {'name': 'workpiece', 'gravity': data['gravity'], **data['workpiece']}
    return compose(inverse(_branch(foot, names, causes, q, rng)), torch)


def _branch(
    data: dict[str, Any],
    names: Sequence[str],
    causes: Sequence[Cause],
    q: Array,
    rng: np.random.Generator,
) -> Motion:
    own = [joint['name'] for joint in data['joints']]
    columns = [list(names).index(name) for name in own]
    here = [cause for cause in causes if cause.get('joint', own[0]) in own]
    command = Command(1.0 + np.arange(float(len(q))), q[:, columns], static=True)
    made = run(data, here, command, Tracker(), rng)
    assert made.quaternion is not None
    return from_quaternion(made.quaternion, made.position)


SLIDES = ('gear_ratio',)
"""Those that a track has in the plant."""
STATIONS = 60
"""Of a cell, as one measures them in an hour."""
SIGMA, TURN = 3e-5, 5e-5
"""Noise of a tracker's probe: of each coordinate [m], about each axis [rad]."""
SIZE = (3.0, 8.0)
"""What a cause moves at the tool, in noises of the instrument, once frames are fitted."""
TRIES = 60
"""Causes that are drawn for one that machines have in the size wanted."""
NEAR = 0.55
"""How far [rad] joints move while a board is to stay in view."""
PIXEL = 0.2
"""Noise of a corner's coordinate [px]."""
LENS_OFF = (1e-3, 1e-3, 0.01)
"""How far a calibration is off: focal length and centre in shares of the focal length, k1."""
CORNERS = np.array([[c, r, 0.0] for r in range(4) for c in range(5)]) * 0.035
"""Inner corners of a board of 6 by 5 squares of 35 mm [m]."""
ON_TOOL = Motion(
    np.asarray(exp_screw(np.array([1.0, 0.0, 0.0]), np.zeros(3), np.array(2.9)).rotation),
    np.array([0.03, -0.05, 0.04]),
)
"""The board on the tool: its face away from the flange."""
CellResult = dict[str, Any]


def sealed(kind: str, seed: int) -> CellResult:
    """Return what a tracker tells of one cause in a cell of one of `KINDS`, opened."""
    rng = np.random.default_rng([seed, len(kind)])
    robot, q, truly = _drawn(kind, seed, rng, SWING)
    cause, shown = _cause(robot, truly, np.sqrt(3.0) * SIGMA, rng)
    tool = truly([cause])
    turned = exp_screw_about(rng.normal(0.0, TURN, (STATIONS, 3))) @ tool.rotation
    place = tool.position + rng.normal(0.0, SIGMA, (STATIONS, 3))
    told = _told(robot, _recording(q, Measurements(_t(q), place, turned)), cause)
    return {'kind': kind, 'seed': seed, 'robot': robot.name, 'noises': shown, **told}


FRAMES = ('base', 'tool')


def beside_a_camera(seed: int) -> CellResult:
    """Return what pixels of two cameras, and a tracker at the same stations, tell of one cause."""
    rng = np.random.default_rng([seed, 77])
    robot, q, truly = _drawn('arm', seed, rng, NEAR)
    eyes = _eyes(compose(truly([]), ON_TOOL), rng)
    first = seen_by(_recording(q, None), _sightings(eyes, compose(truly([]), ON_TOOL), rng))
    assert first.measured is not None and first.measured.noise is not None
    noise = float(np.sqrt(3.0) * np.median(first.measured.noise.sigma))
    cause, shown = _cause(robot, truly, noise, rng)
    tool = truly([cause])
    pixels = seen_by(_recording(q, None), _sightings(eyes, compose(tool, ON_TOOL), rng))
    place = tool.position + rng.normal(0.0, SIGMA, (STATIONS, 3))
    kept = first.measured.t.size
    return {
        'kind': 'camera',
        'seed': seed,
        'robot': robot.name,
        'noises': shown,
        'noise_m': noise,
        'images': kept,
        'pixels': _told(robot, pixels, cause),
        'tracker': _told(robot, _recording(q, Measurements(_t(q), place)), cause),
    }


Truly = Callable[[list[Cause]], Motion]
"""Gives the torch as the plant has it with some causes."""


def _drawn(
    kind: str, seed: int, rng: np.random.Generator, swing: float
) -> tuple[Robot, Array, Truly]:
    """Return a cell, its postures, and where its torch really is there."""
    data = cell(kind, seed)
    robot = Robot.from_mapping(data)
    q = postures(robot, STATIONS, rng, swing)
    names = robot.joint_names
    return robot, q, lambda causes: really(data, names, causes, q, np.random.default_rng(seed))


def _told(robot: Robot, recording: Recording, cause: Cause) -> CellResult:
    """Return what is told of a recording with both frames open, beside the truth."""
    return opened(diagnose(recording, robot, align=FRAMES, experiment=False), site(cause))


def opened(diagnosis: Diagnosis, truth: tuple[str, str | None]) -> CellResult:
    groups = [[(s.effect, s.joint) for s in group] for group in diagnosis.indistinguishable]
    groups = groups or [[(item.effect.name, item.effect.site)] for item in diagnosis.effects]
    named = any(truth in group for group in groups)
    return {
        'truth': list(truth),
        'status': diagnosis.status,
        'sure': bool(diagnosis.sure),
        'confidence': diagnosis.confidence,
        'told': [[list(at) for at in group] for group in groups],
        'named': named,
        'right': named and len(groups) == 1,
    }


def _cause(
    robot: Robot, truly: Truly, noise: float, rng: np.random.Generator
) -> tuple[Cause, float]:
    """Return a cause that moves the tool by a size drawn in noises, and that size."""
    plain = truly([])
    for _ in range(TRIES):
        family = str(rng.choice(AT_REST))
        cause = draw(family, robot, 1.0, rng)
        slides = cause['joint'] in {
            name for name, p in zip(robot.joint_names, robot.prismatic, strict=True) if p
        }
        if slides and family not in SLIDES:
            continue
        if family == 'joint_coupling' and _apart(robot, cause):
            continue
        moved = truly([cause])
        remaining = rms(beyond_frames(plain, moved.position - plain.position)) / noise
        wanted = float(rng.uniform(*SIZE))
        if remaining > 0.0 and plausible(robot, cause, wanted / remaining):
            return scaled(cause, wanted / remaining), wanted
    raise DataError(f'no cause of {robot.name} is as large as wanted')


def _apart(robot: Robot, cause: Cause) -> bool:
    """Return whether a joint and the one it follows are of two branches, or slide."""
    at = [robot.index(cause[key]) for key in ('joint', 'source')]
    return (at[0] < robot.behind) != (at[1] < robot.behind) or bool(robot.prismatic[at].any())


def beyond_frames(tool: Motion, off: Array) -> Array:
    """Return the part of displacements (M, 3) [m] that moved frames of base and tool leave."""
    count = len(off)
    turns = [np.cross(axis, tool.position) for axis in np.eye(3)]
    base = [*turns, *(np.tile(axis, (count, 1)) for axis in np.eye(3))]
    ways = [*base, *np.moveaxis(tool.rotation, -1, 0)]
    design = np.stack([way.ravel() for way in ways], axis=1)
    fitted = np.linalg.lstsq(design, off.ravel(), rcond=None)[0]
    return np.asarray(off - (design @ fitted).reshape(off.shape))


def exp_screw_about(turns: Array) -> Array:
    """Return rotations (M, 3, 3) by small rotation vectors (M, 3) [rad]."""
    angle = np.linalg.norm(turns, axis=1)
    return np.asarray(exp_screw(turns / angle[:, None], np.zeros(3), angle).rotation)


def _t(q: Array) -> Array:
    return 5.0 * np.arange(float(len(q)))


def _recording(q: Array, measured: Measurements | None) -> Recording:
    return Recording('sealed', JointMotion(_t(q), q, static=True), measured)


def _eyes(board: Motion, rng: np.random.Generator) -> tuple[Eye, Eye]:
    """Return two cameras that look at where a board is, from two sides."""
    aim = board.position.mean(axis=0)
    faced = -board.rotation[:, :, 2].mean(axis=0)
    faced = faced / np.linalg.norm(faced)
    aside = np.cross(faced, [0.0, 0.0, 1.0])
    out = []
    for side in (-0.6, 0.6):
        place = aim + 1.5 * faced + side * aside + [0.0, 0.0, rng.uniform(-0.2, 0.3)]
        focal = np.full(2, rng.uniform(2000.0, 2400.0))
        centre = np.array([1224.0, 1024.0]) + rng.normal(0.0, 15.0, 2)
        bent = (rng.uniform(-0.15, 0.0), rng.uniform(0.0, 0.1), *rng.normal(0.0, 4e-4, 2))
        out.append(Eye(focal, centre, bent, looking(place, aim), (2448, 2048)))
    return out[0], out[1]


def _sightings(eyes: tuple[Eye, Eye], board: Motion, rng: np.random.Generator) -> Sightings:
    """Return what both see, with lenses as a calibration had them."""
    cameras, rows = [], []
    for c, eye in enumerate(eyes):
        off = np.random.default_rng([c, int(eye.centre[0] * 1e3)]).normal(size=5)
        bent = np.array([eye.bent[0] + LENS_OFF[2] * off[4], *eye.bent[1:]])
        focal = eye.focal * (1.0 + LENS_OFF[0] * off[0])
        lens = Lens(focal, eye.centre + LENS_OFF[1] * eye.focal * off[1:3], bent)
        cameras.append(Camera(f'camera {c + 1}', lens, 'world', eye.size))
        pixel = seen(eye, board, CORNERS, PIXEL, rng)
        image, point = np.nonzero(np.isfinite(pixel[..., 0]))
        rows.append((image, np.full(image.size, c), point, pixel[image, point]))
    image, camera, point, pixel = (np.concatenate(part) for part in zip(*rows, strict=True))
    labels = tuple(str(k) for k in range(len(CORNERS)))
    board_points = Target('board', labels, CORNERS, 'tool')
    stamps, image = np.unique(image, return_inverse=True)
    t = _t(board.position)[stamps]
    target = np.zeros_like(image)
    return Sightings(tuple(cameras), (board_points,), t, image, camera, target, point, pixel)
