# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
An arm that is given as a URDF, all the way: planned, simulated, measured, diagnosed, corrected.

Every step is a command of the product. The plant stands in for the arm, a controller of the study's
own for the controller. What the same measurement could have given at best is found by the plant: its
true causes, fitted to what was measured, correct the same points.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import yaml
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.chain import forward
from weld_twin_msgs_py.programs import Context, controller_of
from weld_twin_msgs_py.programs.writing import Exported, ExportMove, written
from weld_twin_msgs_py.robots import load_robot
from weld_twin_msgs_py.robots.axes_to_dh import inverse
from weld_twin_nodes.cli.in_process import weld_twin

from ..plant.plant import run
from ..plant.plant_recording import Command
from ..plant.tracker import Tracker
from . import plain_readers as readers
from .drawn_urdf import DrawnArm, drawn_arm
from .plain_arm import Arm, joints_for, tool_pose
from .plain_controller import driven

LANGUAGES = {'krl': ('.src', readers.krl), 'rapid': ('.mod', readers.rapid)}
LANGUAGES |= {'urscript': ('.script', readers.urscript)}
"""Languages that need nothing besides the program: suffix, and a reader that shares nothing."""
NOISE = 2e-5
"""Of the instrument, each coordinate [m]: a good tracker at some metres."""
POINTS, STEP = 8, 0.025
"""Of a seam, and the way between two of them [m]."""
AWAY = 0.6
"""Farthest that a joint of the seam is from the nearest station [rad]."""
TRIES = 400
"""Seams drawn for an arm before it is given up."""
ROUNDS = 4
"""Of correction by the plant: each takes off all but a thousandth."""
SINGULAR = 60.0
"""Condition number [1] beyond which a seam is not drawn."""


@dataclass(frozen=True, eq=False)
class UrdfCell:
    """An arm with its causes, where it was put up, and how it is told to the product."""

    arm: DrawnArm
    causes: list[dict[str, Any]]
    tracker: np.ndarray
    reflector: np.ndarray
    place: Path

    @property
    def words(self) -> list[str]:
        """Return the options that name the robot."""
        return ['--robot', str(self.place / 'arm.urdf'), *self.arm.options]

    def poses(self, q: np.ndarray, causes: Sequence[dict[str, Any]], tool: np.ndarray) -> Any:
        """Return positions (N, 3) and rotations of a tool in the controller's base, at rest."""
        robot = {**self.arm.plant, 'tool': _on_plant(self.arm, tool)}
        t = 10.0 * np.arange(1.0, len(q) + 1.0)
        command = Command(t, self.arm.of_plant(np.asarray(q)), True)
        made = run(robot, list(causes), command, Tracker(), np.random.default_rng(0))
        return made.position, Rotation.from_quat(np.asarray(made.quaternion)).as_matrix()


def _on_plant(arm: DrawnArm, tool: np.ndarray) -> dict[str, Any]:
    """Return a tool on the controller's flange as the plant has it, on the end of its rows."""
    bare = {**arm.plant, 'tool': None}
    command = Command(np.array([1.0]), arm.of_plant(np.zeros((1, 6))), True)
    made = run(bare, [], command, Tracker(), np.random.default_rng(0))
    end = np.eye(4)
    end[:3, :3] = Rotation.from_quat(np.asarray(made.quaternion)[0]).as_matrix()
    end[:3, 3] = made.position[0]
    T = np.linalg.inv(end) @ arm.controller.flange @ tool
    turn = Rotation.from_matrix(T[:3, :3]).as_quat().tolist()
    return {'xyz': T[:3, 3].tolist(), 'quat_xyzw': turn}


def tried(seed: int, number: int) -> dict[str, Any]:
    """
    Return what becomes of one arm; where a command fails, which and how.

    Parameters
    ----------
    seed, number : int
        Decide everything random in it.

    """
    arm = drawn_arm(seed, number)
    out: dict[str, Any] = {
        'number': number,
        'kind': arm.kind,
        'maker': arm.maker,
        'root': arm.root,
        'told': '--base-link' in arm.options,
    }
    with TemporaryDirectory() as folder:
        try:
            return out | _through(seed, number, arm, Path(folder))
        except CommandFailed as error:
            return out | {'failed': str(error).replace(folder, '')}


class CommandFailed(Exception):
    """A command ended with an exit code other than 0."""


def command(*words: str) -> str:
    """
    Run a command of the product and return what it says.

    Raises
    ------
    CommandFailed
        Its exit code is not 0; the message is its last line.

    """
    said = weld_twin(*words)
    if said.code != 0:
        lines = (said.err or said.out).strip().splitlines() or ['']
        raise CommandFailed(f'{words[0]}: {lines[-1]}')
    return said.out


def _through(seed: int, number: int, arm: DrawnArm, place: Path) -> dict[str, Any]:
    rng = np.random.default_rng([seed, number, 52])
    (place / 'arm.urdf').write_text(arm.urdf)
    tracker = np.eye(4)
    tracker[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    tracker[:3, 3] = rng.uniform(-2.0, 2.0, 3)
    reflector = np.array(arm.controller.T_flange_tool)
    reflector[:3, 3] += rng.uniform(-0.01, 0.01, 3)
    cell = UrdfCell(arm, _causes(rng, arm), tracker, reflector, place)
    stations = _planned(cell)
    _simulated(cell)
    measured = _measured(cell, stations, rng)
    found = _diagnosed(cell, stations, measured)
    language = list(LANGUAGES)[number % len(LANGUAGES)]
    seam = _seam(cell, stations, rng)
    if seam is None:
        return {'undrawn': 'no seam drawn is within reach'}
    best = _best(cell, stations, measured)
    return {
        'causes': cell.causes,
        'status': found['verdict']['status'],
        'signs': _signs(cell, found),
        'language': language,
        'stations': len(stations),
        **_corrected(cell, seam, language, best),
        **_files(cell, seam),
    }


def _causes(rng: np.random.Generator, arm: DrawnArm) -> list[dict[str, Any]]:
    """Return one to three causes, of the size that arms in use have."""
    names = [joint['name'] for joint in arm.plant['joints']]
    zero, spring, play = names[int(rng.integers(1, 5))], names[int(rng.integers(1, 3))], names[0]
    reach = sum(abs(joint['a']) + abs(joint['d']) for joint in arm.plant['joints'])
    size = float(rng.choice([-1.0, 1.0]) * rng.uniform(5e-4, 1.5e-3))
    out: list[dict[str, Any]] = [{'effect': 'joint_offset', 'joint': zero, 'offset': size}]
    if rng.random() < 0.6:
        softness = float(rng.uniform(4e-4, 1.2e-3) / (9.81 * 30.0 * reach**3))
        out.append({'effect': 'joint_compliance', 'joint': spring, 'compliance': softness})
    if rng.random() < 0.4:
        width = float(rng.uniform(2e-4, 5e-4))
        out.append({'effect': 'backlash', 'joint': play, 'width': width})
    return out


def _planned(cell: UrdfCell) -> np.ndarray:
    """Return the stations that the product plans, shape (N, 6); its program leads to them too."""
    out = cell.place / 'plan'
    limits = ('--tolerance', '0.06', '--minutes', '12', '--noise', '0.02')
    command('investigate', *cell.words, *limits, '--controller', 'krl', '--out', str(out))
    plan = yaml.safe_load((out / 'stations.yaml').read_text(encoding='utf-8'))
    return np.array(plan['q'])


def _simulated(cell: UrdfCell) -> None:
    nothing = cell.place / 'none.yaml'
    nothing.write_text('[]\n')
    seam = ('--effects', str(nothing), '--path', 'line', '--profile', 'smooth')
    command('simulate', *cell.words, *seam, '--out', str(cell.place / 'simulated'))


def _measured(cell: UrdfCell, stations: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return where the instrument sees the reflector at every station, shape (N, 3) [m]."""
    position, _ = cell.poses(stations, cell.causes, cell.reflector)
    seen = position @ cell.tracker[:3, :3].T + cell.tracker[:3, 3]
    return np.asarray(seen + rng.normal(0.0, NOISE, seen.shape))


def _diagnosed(cell: UrdfCell, stations: np.ndarray, measured: np.ndarray) -> dict[str, Any]:
    names = [joint['name'] for joint in cell.arm.plant['joints']]
    table, bag, found = cell.place / 'table.csv', cell.place / 'bag', cell.place / 'found'
    with table.open('w', newline='', encoding='utf-8') as file:
        rows = csv.writer(file)
        rows.writerow(['t [s]', *(f'{name} [rad]' for name in names), 'x [m]', 'y [m]', 'z [m]'])
        for k, (q, at) in enumerate(zip(stations, measured, strict=True)):
            rows.writerow([10 * (k + 1), *map(repr, q.tolist()), *map(repr, at.tolist())])
    command('import', str(table), *cell.words, '--out', str(bag))
    command('diagnose', str(bag), *cell.words, '--align', 'base,tool', '--out', str(found))
    out: dict[str, Any] = json.loads((found / 'diagnosis.json').read_text(encoding='utf-8'))
    return out


def _signs(cell: UrdfCell, found: dict[str, Any]) -> bool | None:
    """Tell whether a zero that was found has the sign of the URDF's joint; None without one."""
    true = cell.causes[0]
    k = [joint['name'] for joint in cell.arm.plant['joints']].index(true['joint'])
    for effect in found['verdict']['effects']:
        if (effect['effect'], effect['joint']) == ('joint_offset', true['joint']):
            wanted = cell.arm.sign[k] * true['offset']
            return bool(abs(effect['parameters']['offset'] - wanted) < 0.5 * abs(wanted))
    return None


def _seam(cell: UrdfCell, stations: np.ndarray, rng: np.random.Generator) -> np.ndarray | None:
    """Return the joints at the points of a seam among the stations, shape (POINTS, 6)."""
    arm = cell.arm.controller
    for _ in range(TRIES):
        q = stations[int(rng.integers(len(stations)))]
        pose = tool_pose(arm, q, arm.T_flange_tool)
        way = rng.normal(size=3)
        out = [q]
        try:
            for _ in range(POINTS - 1):
                pose = pose.copy()
                pose[:3, 3] += STEP * way / np.linalg.norm(way)
                out.append(joints_for(arm, pose, arm.T_flange_tool, out[-1]))
        except ValueError:
            continue
        found = np.array(out)
        near = np.abs(found[:, None] - stations[None]).max(axis=2).min(axis=1).max()
        if np.abs(found).max() < 2.6 and near < AWAY and _condition(arm, found) < SINGULAR:
            return found
    return None


def _condition(arm: Arm, q: np.ndarray) -> float:
    """Return the largest condition number of how the tool follows the joints along a seam."""
    tool, small, out = np.array(arm.T_flange_tool), 1e-6, 0.0
    for row in q:
        at = tool_pose(arm, row, tool)
        moved = [tool_pose(arm, row + small * unit, tool) for unit in np.eye(6)]
        turns = [Rotation.from_matrix(m[:3, :3] @ at[:3, :3].T).as_rotvec() for m in moved]
        columns = [
            np.concatenate([m[:3, 3] - at[:3, 3], turn])
            for m, turn in zip(moved, turns, strict=True)
        ]
        out = max(out, float(np.linalg.cond(np.array(columns))))
    return out


def _text(cell: UrdfCell, seam: np.ndarray, poses: np.ndarray | None, language: str) -> str:
    """Return a program through points: to the first by joints, then straight where poses are given."""
    robot = load_robot(cell.place / 'arm.urdf', tip_link='tcp')  # for its limits and joints alone
    context = Context(robot, controller_of(robot, language))
    moves = []
    for k, q in enumerate(seam):
        straight = poses is not None and k > 0
        pose = np.eye(4) if poses is None else poses[k]
        end = k in (0, len(seam) - 1)
        moves.append(
            ExportMove('linear' if straight else 'joint', q, pose, 0.02, 0.1, end, 0.0, 1.0)
        )
    tool = np.array(cell.arm.controller.T_flange_tool)
    return written(Exported('seam', tuple(moves), context, tool, 1, False, ('drawn',)), language)


def _wanted(cell: UrdfCell, seam: np.ndarray) -> np.ndarray:
    arm = cell.arm.controller
    return np.array([tool_pose(arm, q, arm.T_flange_tool) for q in seam])


def _off(cell: UrdfCell, moves: readers.Moves, seam: np.ndarray, wanted: np.ndarray) -> float:
    """Return how far the plant's tool is from the seam at worst, at its points [m]."""
    arm = cell.arm.controller
    way = driven(arm, moves, seam[0], 0.02)
    real, _ = cell.poses(way.joints, cell.causes, arm.T_flange_tool)
    ends = _ends(arm, moves, seam, way.joints)
    return float(np.linalg.norm(real[ends] - wanted[:, :3, 3], axis=1).max())


def _ends(arm: Arm, moves: readers.Moves, seam: np.ndarray, q: np.ndarray) -> list[int]:
    """Return the samples of a motion at which its moves end."""
    tool, out = np.array(arm.T_flange_tool), [0]
    places = np.array([tool_pose(arm, row, tool)[:3, 3] for row in q])
    for _, place in moves[1:]:
        end = tool_pose(arm, place[-1], tool) if place[-1].ndim == 1 else place[-1]
        rest = np.linalg.norm(places[out[-1] :] - end[:3, 3], axis=1)
        out.append(out[-1] + int(rest.argmin()))
    return out


def _corrected(
    cell: UrdfCell, seam: np.ndarray, language: str, best: list[dict[str, Any]]
) -> dict[str, Any]:
    suffix, reader = LANGUAGES[language]
    wanted = _wanted(cell, seam)
    text = _text(cell, seam, wanted, language)
    made = _by_product(cell, f'seam{suffix}', text, 'better')
    joints = _by_product(cell, f'joints{suffix}', _text(cell, seam, None, language), 'joints')
    told = [
        [move['before_m'] for move in each['moves'] if move['before_m'] is not None]
        for each in (made, joints)
    ]
    apart = [abs(a - b) for a, b in zip(*told, strict=False)]
    after = (cell.place / 'better' / f'seam{suffix}').read_text(encoding='utf-8')
    moves = reader([text])
    expected = made['expected']
    return {
        'linear_apart_m': max(apart) if apart else None,
        'outcome': 'left' if made['left'] or after == text else 'corrected',
        'why': made['left'][0]['why'] if made['left'] else '',
        'expected_m': [expected[key] and expected[key]['worst_m'] for key in ('before', 'after')],
        'worst_m': {
            'before': _off(cell, moves, seam, wanted),
            'after': _off(cell, reader([after]), seam, wanted),
            'best': _off(cell, _by_plant(cell, seam, wanted, best), seam, wanted),
            'true': _off(cell, _by_plant(cell, seam, wanted, cell.causes), seam, wanted),
        },
    }


def _by_product(cell: UrdfCell, name: str, text: str, out: str) -> dict[str, Any]:
    """Return what correct writes of a program; refused, it is left as it was."""
    program, place = cell.place / name, cell.place / out
    program.write_text(text, encoding='utf-8')
    model = ('--model', str(cell.place / 'found' / 'diagnosis.json'))
    try:
        command('correct', str(program), *cell.words, *model, '--out', str(place))
    except CommandFailed as error:
        place.mkdir(exist_ok=True)
        (place / name).write_text(text, encoding='utf-8')
        nothing = {'before': None, 'after': None}
        return {'moves': [], 'left': [{'why': str(error)}], 'expected': nothing}
    found: dict[str, Any] = json.loads((place / 'correction.json').read_text(encoding='utf-8'))
    return found


def _by_plant(
    cell: UrdfCell, seam: np.ndarray, wanted: np.ndarray, causes: Sequence[dict[str, Any]]
) -> readers.Moves:
    """Return the moves of a seam corrected until the plant with these causes goes where it should."""
    arm, poses = cell.arm.controller, wanted.copy()
    for _ in range(ROUNDS):
        moves: readers.Moves = [('LIN', [pose]) for pose in poses]
        way = driven(arm, moves, seam[0], 0.02).joints
        real, turned = cell.poses(way, causes, arm.T_flange_tool)
        ends = _ends(arm, moves, seam, way)
        poses[:, :3, 3] += wanted[:, :3, 3] - real[ends]
        poses[:, :3, :3] = wanted[:, :3, :3] @ np.swapaxes(turned[ends], 1, 2) @ poses[:, :3, :3]
    return [('LIN', [pose]) for pose in poses]


def _best(cell: UrdfCell, stations: np.ndarray, measured: np.ndarray) -> list[dict[str, Any]]:
    """Return the true causes with the sizes that fit best to what was measured."""
    keys = [next(key for key in cause if key not in ('effect', 'joint')) for cause in cell.causes]
    truth = np.array([cause[key] for cause, key in zip(cell.causes, keys, strict=True)])

    def of(shares: np.ndarray) -> list[dict[str, Any]]:
        return [
            {**cause, key: float(share * size)}
            for cause, key, share, size in zip(cell.causes, keys, shares, truth, strict=True)
        ]

    def left(values: np.ndarray) -> np.ndarray:
        count = len(keys)
        flange, turned = cell.poses(stations, of(values[:count]), np.eye(4))
        point = flange + turned @ (cell.reflector[:3, 3] + values[count : count + 3])
        turn = Rotation.from_rotvec(values[count + 3 : count + 6]).as_matrix()
        seen = point @ (cell.tracker[:3, :3] @ turn).T + cell.tracker[:3, 3] + values[count + 6 :]
        return np.asarray((seen - measured).ravel() / NOISE)

    start = np.concatenate([np.ones(len(keys)), np.zeros(9)])
    found = least_squares(
        left, start, x_scale=[*np.ones(len(keys)), *np.full(9, 1e-3)], diff_step=1e-4
    )
    return of(found.x[: len(keys)])


def _files(cell: UrdfCell, seam: np.ndarray) -> dict[str, Any]:
    """Return how far the corrected files have the controller's frames from each other [m]."""
    options = dict(zip(cell.arm.options[::2], cell.arm.options[1::2], strict=True))
    links = options.get('--base-link'), options['--tip-link']
    found = cell.place / 'found'
    yaml_robot, urdf_robot = (
        load_robot(found / 'robot.yaml'),
        load_robot(found / 'robot.urdf', *links),
    )
    arms = [yaml_robot, urdf_robot]
    places = []
    for robot in arms:
        assert robot.controller is not None
        base = inverse(robot.controller.base)
        bare = replace(robot, T_world_base=base, T_flange_tool=robot.controller.flange)
        places.append(forward(bare, seam)[:, :3, 3])
    bare_arm = cell.arm.controller
    nominal = np.array([tool_pose(bare_arm, q, np.eye(4))[:3, 3] for q in seam])
    return {
        'files_apart_m': float(np.abs(places[0] - places[1]).max()),
        'files_off_m': float(np.abs(places[0] - nominal).max()),
    }
