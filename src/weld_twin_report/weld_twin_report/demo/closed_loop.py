# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The loop closed: the same seam on the same arm, as it is and through the compensator."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from weld_twin_core.arm.chain import forward
from weld_twin_core.arrays import Array
from weld_twin_core.errors import TwinError
from weld_twin_core.motion.inverse.newton import polish
from weld_twin_core.twin.goal_motion import Goal, course
from weld_twin_msgs_py.files.whole_files import write_json, write_text
from weld_twin_msgs_py.files.yaml_file import yaml_text
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.topics import JOINT_STATES, MEASURED_POSE, POSE_IN, POSE_OUT
from weld_twin_nodes.harness import Cell, Tap

from ..report.charts import Axis, Line, chart
from ..report.html import Html, document, main, section, table, tag
from .analysis import Job, Progress

WAYS = {
    'goals': 'as a goal of a trajectory controller, with the correction of play',
    'poses': 'as a stream of poses, for control_msgs is not installed here. Play of an arm would not be '
    'corrected in poses, which do not tell where a joint will turn around',
}
"""How the seam was corrected, in words."""
SHOWN = 600
"""Points of a line."""
AXES = 'xyz'


@dataclass(frozen=True, eq=False)
class Seam:
    """One run along a seam."""

    meant: Array
    real: Array  # shape (N, 3) [m]: where the tool was to be, and where it was measured

    @cached_property
    def off(self) -> Array:
        """Return the distance of the tool from where it was to be, shape (N,) [m]."""
        return np.asarray(np.linalg.norm(self.real - self.meant, axis=1))

    @cached_property
    def way(self) -> Array:
        """Return the way along the seam, shape (N,) [m]."""
        steps = np.linalg.norm(np.diff(self.meant, axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])

    @property
    def rms(self) -> float:
        """Return the RMS distance [m]."""
        return float(np.sqrt((self.off**2).mean()))

    @property
    def worst(self) -> float:
        """Return the largest distance [m]."""
        return float(self.off.max())


def closed_loop_page(robot: str, seams: tuple[Seam, Seam], how: str, noise: float) -> str:
    """Return the page of a seam as it is and corrected, where measuring has a noise [m]."""
    before, after = seams
    head = (
        f'The same seam on the same arm: {before.rms * 1e3:.3f} mm off as it is, '
        f'{after.rms * 1e3:.3f} mm through the compensator (RMS).'
    )
    how_done = (
        'The error injector stands in for the arm. The diagnosis of its first run is the model. '
        f'The seam was corrected {WAYS[how]}. The noise of the measurement alone is '
        f'{noise * 1e3:.3f} mm.'
    )
    lead = 'How far the measured tool is from where it was to be. Both runs have one scale.'
    rows = [
        (name, f'{one.rms * 1e3:.3f}', f'{one.worst * 1e3:.3f}')
        for name, one in (('as it is', before), ('corrected', after))
    ]
    body = main(
        ('Closed loop', ''),
        robot,
        head,
        table(('run', 'RMS, mm', 'at worst, mm'), rows),
        section('Along the seam', *_charts(before, after), id_='seam', lead=lead),
        section('How it was done', tag('p', how_done), id_='how'),
    )
    return document(f'Closed loop · {robot}', body, charts=True)


def _charts(before: Seam, after: Seam) -> list[Html]:
    """Return the distance along the seam of both runs, and their parts along the axes."""
    x = np.linspace(0.0, min(before.way[-1], after.way[-1]), SHOWN)

    def drawn(title: str, across: str, parts: list[Array], height: int, from_zero: bool) -> Html:
        lines = [
            Line(name, np.interp(x, one.way, part) * 1e3, colour)
            for one, part, name, colour in zip(
                (before, after), parts, ('as it is', 'corrected'), ('before', 'after'), strict=True
            )
        ]
        axes = (Axis('way along the seam', 'mm'), Axis(across, 'mm'))
        return chart(title, x * 1e3, lines, axes, key='seam', from_zero=from_zero, height=height)

    off = [one.real - one.meant for one in (before, after)]
    return [
        drawn('Distance from the seam', 'distance', [before.off, after.off], 240, True),
        *(
            drawn(f'Part along {name}', name, [part[:, k] for part in off], 120, False)
            for k, name in enumerate(AXES)
        ),
    ]


PAGE, RESULT = 'closed_loop.html', 'closed_loop.json'
PACE = 2.0
"""How many times as fast as it says the seam runs: nothing in this arm hangs on speed."""
STANDS = 30
"""Poses at standstill before a stream sets off, for the correction to set in."""
BEAT = 20_000_000
"""Nanoseconds between two poses."""
Weld = Callable[[bool], Seam]


def close_loop(job: Job, progress: Progress) -> None:
    """Weld the seam twice and leave both on a page."""
    try:
        with Cell() as cell:
            seams, how = _welded(cell, job, progress)
    except TimeoutError as error:
        raise TwinError(str(error)) from None
    before, after = (seam.rms for seam in seams)
    write_text(job.folder / PAGE, closed_loop_page(job.robot.name, seams, how, _noise(job)))
    content = {
        'schema': 'weld_twin/closed_loop/1',
        'how': how,
        'before': {'rms_m': before, 'worst_m': seams[0].worst},
        'after': {'rms_m': after, 'worst_m': seams[1].worst},
    }
    write_json(job.folder / RESULT, content)
    job.lines += [
        '',
        f'The same seam with the loop closed: {before * 1e3:.3f} mm RMS as it is, '
        f'{after * 1e3:.3f} mm through the compensator; {PAGE} has both beside each other',
    ]


def _welded(cell: Cell, job: Job, progress: Progress) -> tuple[tuple[Seam, Seam], str]:
    """Return the seam as it is and corrected, and by which way it was corrected."""
    common = {'robot': job.robot.name, 'reliable_inputs': True}
    effects = yaml_text([effect.to_mapping() for effect in job.effects])
    cell.start('error_injector', effects=effects, seed=job.seed, **common)
    cell.start(
        'compensator',
        model=str(job.folder / 'diagnosis' / 'diagnosis.json'),
        apply=True,
        managed=False,
        **common,
    )
    measured = cell.collect(MEASURED_POSE.name)
    weld: Weld
    weld, how = _by_poses(cell, job, measured), 'poses'
    try:
        from weld_twin_nodes.harness.controller import Controller

        weld, how = _ByGoals(cell, job, measured, Controller), 'goals'
    except ImportError:
        pass
    seams = []
    for k, corrected in enumerate((False, True)):
        progress(0.1 + 0.45 * k)
        seams.append(weld(corrected))
    return (seams[0], seams[1]), how


class _ByGoals:
    """Welds the seam as a goal of a trajectory controller."""

    def __init__(self, cell: Cell, job: Job, measured: Tap, controller: Any) -> None:
        from control_msgs.action import FollowJointTrajectory
        from rclpy.action import ActionClient

        self.cell, self.job, self.measured, self.kind = cell, job, measured, FollowJointTrajectory
        self.arm = cell.add(controller, job.robot.joint_names, job.plan.motion.q[0], PACE)
        servers = {False: 'joint_trajectory_controller', True: 'compensator'}
        self.clients = {
            corrected: ActionClient(cell.node, self.kind, f'/{name}/follow_joint_trajectory')
            for corrected, name in servers.items()
        }
        for client in self.clients.values():
            cell.wait(client.server_is_ready, 'the actions')
        cell.meet()
        cell.wait(lambda: len(measured) > 0, 'the tool to be measured')

    def run(self, goal: Goal, corrected: bool) -> None:
        message = self.kind.Goal()
        message.trajectory.joint_names = list(self.job.robot.joint_names)
        message.trajectory.points = self.cell.messages.trajectory_points(*goal)
        asked = self.clients[corrected].send_goal_async(message)
        self.cell.wait(asked.done, 'the answer to the goal')
        if not asked.result().accepted:
            raise TwinError(f'the goal was rejected: {self.cell.processes[-1].log[-600:]}')
        done = asked.result().get_result_async()
        self.cell.wait(done.done, 'the seam to be welded', limit=120.0)

    def __call__(self, corrected: bool) -> Seam:
        """Return the seam as it was welded, each time begun from the same side."""
        motion, arm, measured = self.job.plan.motion, self.arm, self.measured
        t = motion.t - motion.t[0]
        back = arm.q + np.linspace(0.0, 1.0, 60)[:, None] ** 2 * (motion.q[0] - arm.q)
        self.run(Goal(np.linspace(0.0, 6.0, 60), back), False)
        goal = Goal(t, motion.q, motion.velocity)
        self.run(goal, corrected)
        waits = max(at for _, at in arm.track) - float(t[-1])
        track = {stamp: at - waits for stamp, at in arm.track if at >= waits}
        last = max(track)
        self.cell.wait(
            lambda: from_messages.stamp_ns(measured.last) >= last, 'the tool to be measured'
        )
        kept = [m for m in measured.messages if from_messages.stamp_ns(m) in track]
        at = np.array([track[from_messages.stamp_ns(m)] for m in kept])
        real = np.array([from_messages.pose(m)[0] for m in kept])
        return _seam(self.job, course(goal, np.clip(at, 0.0, t[-1])).q, real)


def _by_poses(cell: Cell, job: Job, measured: Tap) -> Weld:
    """Return what welds the seam as a stream of poses, which a controller turns into joints."""
    robot, motion = job.robot, job.plan.motion
    bare = robot.with_frames(base=np.eye(4))
    path = np.concatenate([np.repeat(motion.q[:1], STANDS, axis=0), motion.q])
    begun = [1_000_000_000]

    def weld(corrected: bool) -> Seam:
        joints = cell.publisher(JOINT_STATES)
        out = cell.collect('/compensator/pose_out', POSE_OUT.message_class())
        given = cell.node.create_publisher(
            POSE_IN.message_class(), '/compensator/pose_in', POSE_IN.offered.to_rclpy()
        )
        cell.wait(lambda: given.get_subscription_count() > 0, 'the compensator')
        cell.meet()
        measured.messages.clear()
        q, stamp = path[0], begun[0]
        for k, (pose, there) in enumerate(zip(forward(bare, path), path, strict=True)):
            stamp += BEAT
            if corrected and k:
                given.publish(cell.messages.pose(stamp, pose[:3, 3], pose[:3, :3], 'base'))
                cell.wait(partial(_has, out, k), 'a corrected pose')
                position, rotation = from_messages.pose(out.last)
                goal = np.eye(4)
                goal[:3, :3], goal[:3, 3] = rotation, position
                (q,), _ = polish(bare, q[None], goal[None])
            else:
                q = there
            joints.publish(cell.messages.joint_state(stamp, robot.joint_names, q))
            cell.wait(partial(_has, measured, k + 1), 'the tool to be measured')
        begun[0] = stamp + 5_000_000_000
        real = np.array([from_messages.pose(m)[0] for m in measured.messages])
        cell.node.destroy_publisher(given)
        return _seam(job, path[STANDS:], real[STANDS:])

    return weld


def _has(tap: Tap, count: int) -> bool:
    return len(tap) >= count


def _noise(job: Job) -> float:
    """Return the RMS distance that the noise of the measurement alone makes [m]."""
    sigmas = [e.number('sigma') for e in job.effects if e.name == 'measurement_noise']
    return float(np.sqrt(3.0) * sum(sigmas))


def _seam(job: Job, q: Array, real: Array) -> Seam:
    """Return where a seam was meant and where it came to be."""
    return Seam(forward(job.robot, q)[:, :3, 3], real)
