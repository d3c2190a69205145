# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A seam or an experiment as the moves of a program that a controller runs."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import UNHURRIED, Robot
from weld_twin_core.arm.rotation import rotation_vector
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.motion.inverse.along_path import ILL_CONDITIONED, PathSolution
from weld_twin_core.motion.paths import KINDS
from weld_twin_core.motion.planned_motion import Plan as SeamPlan
from weld_twin_core.motion.programs import travel
from weld_twin_msgs_py.files.joint_file import EASY, REST, read_joint_motion
from weld_twin_msgs_py.files.whole_files import write_text
from weld_twin_msgs_py.programs import Context, read_sources, to_moves
from weld_twin_msgs_py.programs.controllers import BY_NAME, carrying
from weld_twin_msgs_py.programs.source import Source
from weld_twin_msgs_py.programs.writing import Exported, ExportMove, sheet, written

from .seam_motion import plan_motion

CHORD = (5e-5, 2e-3)
"""How far straight pieces may be off the seam [m], and the torch off its angle [rad]."""
SLOW = (0.1, 0.05)
"""Of the first run: share of the joints' speeds, and speed of the tool [m/s]."""
FAST = (EASY, 0.25)
"""The most of any run: share of the joints' speeds, and 250 mm/s, the reduced speed of ISO 10218."""
BACK = 2e-4
"""A program that is read again may be this far off [rad or m]: FANUC writes thousandths of degrees."""
RATE = 50.0
"""Samples a second that a seam is planned with."""


class Plan(NamedTuple):
    """Joint positions to go through, times, whether of stations, and which moves are linear."""

    q: Array
    t: Array
    stations: bool
    linear: bool
    speed: float


class Speeds(NamedTuple):
    """The most of joints and tool, and the stay at a station [s]."""

    share: float = SLOW[0]
    tool: float = SLOW[1]
    dwell: float = REST


def export(
    # A path file, a bundled seam, an experiment as a diagnosis proposes it, or a seam that is
    # planned already.
    path: str | SeamPlan,
    context: Context,
    language: str,
    name: str,  # of the program
    speeds: Speeds,
    trigger: int,  # number of the output that triggers the instrument
    seam_speed: float = 0.0,  # [m/s], of a seam; 0 for that of its time law
) -> tuple[Exported, str, list[str]]:
    """Return the program of a seam or an experiment, its text, and what to look out for."""
    robot = context.robot
    _refuse_slides(context, language)
    plan = _planned(path, robot, seam_speed)
    if plan.linear and context.controller.external and language not in BY_NAME:
        raise DataError(
            f'a seam beside external axes is written in {" or ".join(BY_NAME)}; a program in {language} '
            'takes stations alone'
        )
    robot.check_positions(plan.q)
    moves = _moves(plan, context, speeds)
    source = Path(path).name if isinstance(path, str) else 'a seam'
    made = Exported(
        _name(name),
        moves,
        context,
        np.linalg.inv(context.controller.flange) @ robot.T_flange_tool,
        trigger,
        plan.stations,
        # A line end, or the sign that ends a statement of FANUC, would end the comment.
        (
            ' '.join(f'{robot.name}: {source}'.replace(';', ',').split()),
            'made by weld_twin',
            'check for collisions first',
        ),
    )
    text = written(made, language)
    _read_again(made, text, language)
    notes = [*without_limits(robot), *_singular(robot, plan.q), *context.controller.notes]
    return made, text, notes


def without_limits(robot: Robot) -> list[str]:
    """Return what is kept where limits of some joints are not known; a URDF may leave them out."""
    turning, sliding = UNHURRIED
    finite = {
        'position': (np.isfinite(robot.lower) & np.isfinite(robot.upper), 'none is kept'),
        'speed': (
            np.isfinite(robot.max_velocity),
            f'motions are planned for {turning:g} rad/s, or {sliding:g} m/s of a slide',
        ),
    }
    return [
        f'the robot file has no limit of {what} for {", ".join(np.array(robot.joint_names)[~known])}, '
        f'so {kept}; write it in, or check every move before the arm makes it'
        for what, (known, kept) in finite.items()
        if not known.all()
    ]


def write_program(
    out: Path,  # program to write; the sheet goes beside it
    shown_as: Path,  # where it will be found
    path: str,
    context: Context,
    language: str,
    how: Speeds,
    *,
    trigger: int,
    seam_speed: float = 0.0,
    faster: str = '',  # how to have it run faster
) -> list[str]:
    """Write a program, as `export` makes it, and the sheet that says how to load it; return remarks."""
    made, text, notes = export(path, context, language, out.stem, how, trigger, seam_speed)
    fast = f"at most {how.share:.0%} of the joints' speed and {how.tool * 1e3:g} mm/s"
    first = f' That is for the first run{faster}.' if how.share <= SLOW[0] else ''
    write_text(out, text)
    guide = f'{out.name}.md'
    write_text(
        out.with_name(guide), sheet(made, language, out.name, f'It runs {fast}.{first}', notes)
    )
    return [
        f'{shown_as}: {len(made.moves)} moves in {language}, {fast}',
        *(f'note: {note}' for note in notes),
        f'how to load it and to record: {shown_as.with_name(guide)}',
    ]


def _refuse_slides(context: Context, language: str) -> None:
    """Refuse an arm with a joint that slides in a language whose axes are written as angles."""
    robot, first = context.robot, len(context.controller.external)
    slides = [robot.joint_names[k] for k in np.flatnonzero(robot.prismatic) if k >= first]
    if slides and language not in BY_NAME:
        raise DataError(
            f'{slides[0]!r} of robot {robot.name!r} slides, and a program in {language} is written '
            f'for axes that turn; choose {" or ".join(BY_NAME)}, or leave the program out'
        )


def _planned(path: str | SeamPlan, robot: Robot, speed: float) -> Plan:
    plan = path
    if isinstance(plan, str):
        given = None if plan in KINDS else read_joint_motion(plan, robot)
        if given is not None:
            t, q, stations = given
            return Plan(q, t, stations, False, 0.0)
        plan = plan_motion(robot, plan, rate=RATE, speed=speed)
    keep = _corners(plan.poses, plan.motion.q[:, : carrying(robot)])
    travel_speed = plan.length / max(plan.report.duration, 1e-6)
    return Plan(plan.motion.q[keep], plan.motion.t[keep], False, True, speed or travel_speed)


def _corners(poses: Array, beside: Array) -> list[int]:
    """Return the samples of a path between which it and what external axes do are straight enough."""
    keep, last = [0], len(poses) - 1
    while keep[-1] < last:
        low, high = keep[-1] + 1, min(keep[-1] + 2, last)
        while high < last and _straight(poses, beside, keep[-1], high):
            low, high = high, min(keep[-1] + 2 * (high - keep[-1]), last)
        if _straight(poses, beside, keep[-1], high):
            low = high
        while high - low > 1:
            middle = (low + high) // 2
            far = _straight(poses, beside, keep[-1], middle)
            low, high = (middle, high) if far else (low, middle)
        keep.append(low)
    return keep


def _straight(poses: Array, beside: Array, first: int, last: int) -> bool:
    part = poses[first : last + 1]
    step = part[:, :3, 3] - part[0, :3, 3]
    whole = step[-1]
    size = float(whole @ whole)
    along = step @ whole / size if size > 0.0 else np.zeros(len(part))
    off = np.linalg.norm(step - along[:, None] * whole, axis=1).max()
    turn = rotation_vector(part[:, :3, :3] @ part[0, :3, :3].T)
    bent = np.linalg.norm(turn - along[:, None] * turn[-1], axis=1).max()
    axes = beside[first : last + 1] - beside[first]
    uneven = np.abs(axes - along[:, None] * axes[-1]).max(initial=0.0)
    return bool(off < CHORD[0] and max(bent, uneven) < CHORD[1])


def _moves(plan: Plan, context: Context, speeds: Speeds) -> tuple[ExportMove, ...]:
    robot = context.robot
    places = np.linalg.inv(context.controller.origin) @ forward(
        robot.with_frames(base=np.eye(4)), plan.q
    )
    out = []
    for k, q in enumerate(plan.q):
        step = np.zeros(robot.n) if k == 0 else np.abs(q - plan.q[k - 1])
        linear = plan.linear and k > 0
        last = k in (0, len(plan.q) - 1)
        share = speeds.share
        if not (plan.stations or plan.linear or k == 0):
            time = max(float(plan.t[k] - plan.t[k - 1]), 1e-3)
            share = min(share, max(float((step / robot.planned_velocity).max()) / time, 1e-3))
        way = 0.0
        if k:
            way = float(np.linalg.norm(places[k, :3, 3] - places[k - 1, :3, 3]))
        duration = max(float((step / robot.planned_velocity).max()) / share, 0.02)
        speed = min(max(way / duration, 1e-3), speeds.tool) if k else speeds.tool
        if linear:
            speed = min(plan.speed, speeds.tool)
            duration = max(way / speed, 0.02)
        stop = plan.stations or last
        dwell = speeds.dwell if plan.stations or last else 0.0
        comment = f'station {k + 1}' if plan.stations else ''
        kind: Literal['linear', 'joint'] = 'linear' if linear else 'joint'
        place = places[k]
        out.append(ExportMove(kind, q, place, speed, share, stop, dwell, duration, comment))
    return tuple(out)


def _read_again(made: Exported, text: str, language: str) -> None:
    """Refuse a program that does not lead where it is to lead when it is read."""
    tools = {'0': made.tool, '1': made.tool}
    controller = made.context.controller
    context = made.context._replace(
        controller=replace(controller, tools=tools, bases={}, notes=[])
    )
    program = read_sources([Source(made.name, text)], context, language)
    result = travel(made.context.robot, to_moves(program, context.robot, context.controller))
    if result.lost:
        raise DataError(next(iter(result.lost.values())))
    q = np.concatenate([piece.motion.q[piece.ends] for piece in result.pieces])
    wanted = [move.q for move in made.moves]
    if language == 'joint-trajectory':
        wanted = [m.q for m in made.moves for _ in range(1 + (m.dwell > 0.0))]
    if len(q) != len(wanted) or np.abs(q - np.array(wanted)).max() > BACK:
        raise DataError('the program reads differently from what was meant, so it is not written')


def _singular(robot: Robot, q: Array) -> list[str]:
    """Return a sentence where the way comes near a singularity; joint moves straight between."""
    share = np.linspace(0.0, 1.0, 8, endpoint=False)
    between = (q[:-1, None] + share[None, :, None] * np.diff(q, axis=0)[:, None]).reshape(
        -1, robot.n
    )
    fine = np.concatenate([between, q[-1:]])
    condition = PathSolution(robot, np.zeros((0, 4, 4)), fine, '').condition
    near = np.flatnonzero(condition > ILL_CONDITIONED)
    if not near.size:
        return []
    at = int(near[0]) // 8 + 1
    return [
        f'near a singularity at move {at} and {near.size} of {len(fine)} places looked at: a linear '
        'move there turns joints fast; joint moves do not mind'
    ]


def _name(text: str) -> str:
    name = re.sub(r'\W', '_', text, flags=re.ASCII)  # no controller has other letters
    return name if re.match(r'[A-Za-z]', name) else f'p_{name}'
