# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Cells with one cause, told from a tracker or from pixels; a real arm told from its pixels."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.arm import catalog
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.bundle import seen_by
from weld_twin_core.cameras import Camera, Lens, Sightings, Target
from weld_twin_core.diagnosis import Diagnosis, diagnose
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_msgs_py.files import markdown
from weld_twin_msgs_py.tables import read_camera, read_pixels, read_target
from weld_twin_nodes.offline.task_pool import Task

from ..blind.cause_sizes import AT_REST, Cause, draw, plausible, scaled, site
from ..blind.scoring import explained, moves_of, rms
from ..plant.exponentials import Command, Motion, compose, exp_screw, from_quaternion, inverse
from ..plant.plant import run as run_plant
from ..plant.tracker import Eye, Tracker, looking, seen
from ..real_arms.sources import motoman
from ..real_arms.unseen import ALIGN, PLAIN, plain_fit, residual
from ..study import Study, head, require_simulator, tabled

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
    """Return the torch as the plant has it at postures, seen from a workpiece if there is one."""
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
    made = run_plant(data, here, command, Tracker(), rng)
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
CaseResult = Mapping[str, Any]


def sealed(kind: str, seed: int) -> CaseResult:
    """Return what a tracker tells of one cause in a cell of one of `KINDS`, opened."""
    rng = np.random.default_rng([seed, len(kind)])
    robot, q, truly = _drawn(kind, seed, rng, SWING)
    cause, shown = _cause(robot, truly, np.sqrt(3.0) * SIGMA, rng)
    tool = truly([cause])
    turned = exp_screw_about(rng.normal(0.0, TURN, (STATIONS, 3))) @ tool.rotation
    place = tool.position + rng.normal(0.0, SIGMA, (STATIONS, 3))
    told = _told(robot, _recording(q, Measurements(_t(q), place, turned)), cause)
    return {'kind': kind, 'seed': seed, 'robot': robot.name, 'noises': shown, **told}


def beside_a_camera(seed: int) -> CaseResult:
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
    data = cell(kind, seed)
    robot = Robot.from_mapping(data)
    q = postures(robot, STATIONS, rng, swing)
    names = robot.joint_names
    return robot, q, lambda causes: really(data, names, causes, q, np.random.default_rng(seed))


def _told(robot: Robot, recording: Recording, cause: Cause) -> CaseResult:
    return opened(diagnose(recording, robot, align=ALIGN, experiment=False), site(cause))


def opened(diagnosis: Diagnosis, truth: tuple[str, str | None]) -> CaseResult:
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
    ways = [*moves_of(tool.position), *np.moveaxis(tool.rotation, -1, 0)]
    return off - explained(ways, off)


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


PARTS = 5
"""Stretches of time, each left out in turn."""
CAMERAS = {'1': 'camera_1.yaml', '2': 'camera_2.yaml'}


def part(data: str, which: int) -> dict[str, object]:
    """
    Return what is left on a stretch of time that was not fitted, by the tracker [mm RMS].

    Frames of base and tool are the tracker's, of the other stretches; all else is told from their
    pixels alone, or from their tracker by a plain fit of the geometry.
    """
    folder = Path(data)
    robot = motoman(folder, masses=False).robot
    here = folder / 'motoman_left'
    cameras = [read_camera(name, here / file) for name, file in CAMERAS.items()]
    target = read_target('hand', here / 'left_markers.csv')
    seen = read_pixels(here / 'left_hand.csv', robot, cameras, [target]).recording
    assert seen.images is not None
    place = _tracked(here / 'left_hand.csv')
    test = np.array_split(np.arange(len(place)), PARTS)[which]
    rest = np.setdiff1d(np.arange(len(place)), test)
    bare = replace(seen, measured=None, images=None, notes=())
    pixels = seen_by(bare, seen.images.take(np.isin(seen.images.image, rest)))
    diagnosis = diagnose(pixels, robot, align=ALIGN, experiment=False)
    train, judged = (_of(bare, place, rows) for rows in (rest, test))
    geometry = plain_fit(train, robot, PLAIN['geometry'], ALIGN).found
    known = {'frames': (), 'pixels': diagnosis.model.found, 'tracker': geometry}
    models = {name: plain_fit(train, robot, (), ALIGN, own) for name, own in known.items()}
    left = {name: rms(residual(own, train, judged)[:3].T) for name, own in models.items()}
    return {'part': which, 'status': diagnosis.status, **{k: 1e3 * v for k, v in left.items()}}


def _tracked(path: Path) -> Array:
    """Return where the tracker saw the hand, pose by pose, (M, 3) [m]; NaN where it did not."""
    with path.open(newline='') as stream:
        rows = {row['pose']: row for row in csv.DictReader(stream)}
    texts = [[row[f'leica_{axis} [m]'] or 'nan' for axis in 'xyz'] for row in rows.values()]
    return np.array(texts, dtype=float)


def _of(bare: Recording, place: Array, rows: NDArray[np.intp]) -> Recording:
    kept = rows[np.isfinite(place[rows]).all(axis=1)]
    return replace(bare, measured=Measurements(bare.joints.t[kept], place[kept]))


AS_TRACKED = 0.8
"""Goal: share of the causes named beside a tracker that pixels name, too."""


def page(
    cases: Sequence[CaseResult], pixels: Sequence[CaseResult], real: Sequence[CaseResult]
) -> str:
    lines = ['# Whole cells, and cameras', '']
    if cases:
        kinds = dict.fromkeys(case['kind'] for case in cases)
        groups = {kind: [case for case in cases if case['kind'] == kind] for kind in kinds}
        lines += ['One cause of 3 to 8 noises, told with the frames of base and tool fitted:', '']
        lines += [_counts('cell', groups), '']
    if pixels:
        ways = {way: [one[way] for one in pixels] for way in ('tracker', 'pixels')}
        share = f'{100.0 * named_as_tracked(pixels):.0f} %'
        lines += ['The same stations told from pixels of two cameras, and from a tracker:', '']
        lines += [
            _counts('told from', ways),
            f'Of what the tracker names, pixels name {share}.',
            '',
        ]
    if real:
        lines += ['A real arm told from pixels alone, and judged by a tracker [mm RMS]:', '']
        lines += [_real(real), '']
    return '\n'.join(lines)


def named_as_tracked(pixels: Sequence[CaseResult]) -> float:
    """Return the share of causes named beside a tracker that pixels name, too."""
    both = [one['pixels']['named'] for one in pixels if one['tracker']['named']]
    return float(np.mean(both)) if both else 1.0


def _counts(what: str, groups: Mapping[str, Sequence[CaseResult]]) -> str:
    def number(key: str) -> Callable[[Any], int]:
        return lambda row: sum(bool(one[key]) for one in row[1])

    columns: dict[str, Callable[[Any], object]] = {
        what: lambda row: row[0],
        'cases': lambda row: len(row[1]),
        'named': number('named'),
        'nothing else': number('right'),
        'sure': number('sure'),
        'sure and wrong': lambda row: sum(one['sure'] and not one['right'] for one in row[1]),
    }
    return tabled(columns, groups.items())


def _real(real: Sequence[CaseResult]) -> str:
    keys = ('frames', 'pixels', 'tracker')
    rows = [(str(k + 1), *(f'{fold[key]:.3f}' for key in keys)) for k, fold in enumerate(real)]
    means = [float(np.mean([fold[key] for fold in real])) for key in keys]
    rows.append(('mean', *(f'{mean:.3f}' for mean in means)))
    rows.append(('over frames', *(f'{mean / means[0]:.2f}' for mean in means)))
    head = ('part', 'frames alone', 'told from pixels', 'told from the tracker itself')
    return markdown.table(head, *rows)


def run(study: Study) -> bool:
    require_simulator()
    args = study.args
    seeds = range(args.seed, args.seed + args.cells)
    kinds = [Task(sealed, (kind, seed), kind) for seed in seeds for kind in KINDS]
    cameras = range(args.seed, args.seed + args.cameras)
    beside = [Task(beside_a_camera, (seed,), 'camera') for seed in cameras]
    parts = [Task(part, (args.data, k), 'pixels') for k in range(PARTS * bool(args.data))]
    with study.runner('telling whole cells') as runner:
        cells, pixels, real = (runner.run(tasks) for tasks in (kinds, beside, parts))
    content = head('cells/1', seed=args.seed, cells=cells, pixels=pixels, real=real)
    study.write('cells', content, page(cells, pixels, real))
    return named_as_tracked(pixels) >= AS_TRACKED
