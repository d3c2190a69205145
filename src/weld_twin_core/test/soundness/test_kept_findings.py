# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Each way to spoil data is found, named, placed and undone; sound data raise nothing.

`KINDS` says of each case what it must be told as; all that is said of it, word by word, is as it was
kept in `kept/`.
"""

from dataclasses import replace
from functools import cached_property

import numpy as np
import pytest
from measured_cells import anywhere, moving, recorded, rejointed, remeasured, stations
from scipy.spatial.transform import Rotation

from weld_twin_core import JointMotion, effects_from_list, load
from weld_twin_core.arm.rotation import matrix_from_quaternion, quaternion_from_matrix, transform
from weld_twin_core.diagnosis.soundness.gate import examine
from weld_twin_core.diagnosis.soundness.mending import Given
from weld_twin_core.effects import JointCoupling

UR5 = load('ur5')
BOTH, NONE = ('base', 'tool'), ()
G = 9.80665
STEP = np.array([0.5, 0.0, 0.3]) / np.hypot(0.5, 0.3)
"""A fixed direction."""


class Cell:
    """A UR5 measured with noise of its own: from elsewhere or from its own base, at rest or moving."""

    def __init__(self):
        self.rng = np.random.default_rng(7)

    def seen(self, motion, robot=UR5, effects=(), **how):
        return recorded(robot, motion, self.rng, effects, **how)

    def elsewhere(self, tool=0.1):
        base = anywhere(self.rng, 2.0)
        return UR5.with_frames(base=base, tool=anywhere(self.rng, tool) if tool else None)

    def rests(self, **how):
        return self.seen(stations(UR5, self.rng), **how)

    def moves(self, **how):
        return self.seen(moving(UR5, self.rng, **how), points=True)

    @cached_property
    def placed(self):
        return self.rests(robot=self.elsewhere())

    @cached_property
    def few(self):
        return self.seen(stations(UR5, self.rng, 60), robot=self.elsewhere(), points=True)

    @cached_property
    def own(self):
        return self.moves()

    @cached_property
    def run(self):
        real = self.elsewhere(tool=0.0)
        return self.seen(moving(UR5, self.rng), real, points=True)


def one_off(cell, reading):
    seen = cell.few.measured
    first = cell.few.with_measured(seen.take(np.arange(len(reading))))
    return remeasured(first, position=seen.position[reading])


def joints(recording, change):
    return rejointed(recording, change(np.array(recording.joints.q)))


def points(recording, change):
    return remeasured(recording, position=change(np.array(recording.measured.position)))


def stamps(recording, change):
    return remeasured(recording, t=change(recording.measured.t))


def turns(recording, change):
    return remeasured(recording, rotation=change(recording.measured.rotation))


def put(array, where, value):
    """Return an array with other values somewhere."""
    array[where] = value
    return array


def stuck(cell, motion, which):
    good = cell.seen(motion)
    part = slice(int(0.4 * len(motion.q)), int(0.6 * len(motion.q)))
    return joints(good, lambda q: put(q, (part, which), q[part.start, which]))


def stuck_in_a_third(cell):
    real, narrow = cell.elsewhere(), stations(UR5, cell.rng)
    q = np.array(narrow.q[:60])
    held = cell.seen(JointMotion(narrow.t[:60], q, None, True), real)
    return rejointed(held, put(q, (slice(20, 38), 3), q[20, 3]))


def standing(cell, count, still=None):
    """Return a motion with a pause, in which one joint may stand still all along."""
    motion = moving(UR5, cell.rng)
    q = np.insert(motion.q, 900, np.tile(motion.q[900], (count, 1)), axis=0)
    if still is not None:
        q[:, still] = q[0, still]
    return cell.seen(JointMotion(np.arange(len(q)) / 125.0, q))


def stray_while_it_stands(cell):
    held = standing(cell, 250)
    t = held.measured.t
    third = np.flatnonzero((t > 1000 / 125.0) & (t < 1100 / 125.0))[3]
    return points(held, lambda p: put(p, third, p[third] + [0.0, 5e-3, 0.0]))


def hardly_moving(cell):
    motion = moving(UR5, cell.rng)
    q = np.array(motion.q)
    q[:, 3], q[:, 4] = q[0, 3], np.linspace(0.0, 1.0, len(q))
    return cell.seen(JointMotion(motion.t, q))


def velocities(cell):
    motion = moving(UR5, cell.rng)
    qd = np.gradient(motion.q, motion.t, axis=0)
    return cell.seen(JointMotion(motion.t, motion.q, put(qd, (slice(None), 4), 0.0)))


def play(cell, joint, sweep, back):
    """Return a way out and back on which the arm trails by half the play: later where it is slower."""
    t = np.arange(0.0, 2.2 + back, 0.008)
    s = np.interp(t, [0.0, 1.2, 2.2, 2.2 + back], [0.0, 1.0, 1.0, 0.0])
    q = np.tile([0.24, -1.05, 1.23, -1.07, -1.27, 0.38], (t.size, 1))
    q[:, joint] += sweep * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    real, arm = q.copy(), q[0, joint]
    for k, commanded in enumerate(q[:, joint]):
        arm = real[k, joint] = float(np.clip(arm, commanded - 1e-3, commanded + 1e-3))
    seen = cell.seen(JointMotion(t, real), points=True)
    return replace(seen, joints=JointMotion(t, q))


def coupled_wrist(cell):
    """Return few stations in which one joint of seven moves, and fewer in which all do."""
    robot = load('franka_panda').with_frames(
        tool=transform(np.eye(3), np.array([0.02, 0.01, 0.15]))
    )
    rng = np.random.default_rng(4)
    cause = [JointCoupling('panda_joint5', source='panda_joint4', ratio=-0.01)]
    home = np.clip(rng.uniform(-1.5, 1.5, robot.n), robot.lower + 1, robot.upper - 1)
    one = np.tile(home, (20, 1))
    one[:, -1] += np.linspace(-1.0, 1.0, 20)
    made = []
    for name, q in (('one joint', one), ('few', home + rng.uniform(-1.0, 1.0, (8, robot.n)))):
        motion = JointMotion(15.0 * np.arange(len(q)), q, static=True)
        made.append(recorded(robot, motion, rng, cause, sigma=3e-5, points=True, name=name))
    return robot, made


def outliers(cell, kind):
    seen = cell.seen(kind(UR5, cell.rng))
    return points(seen, lambda p: put(p, [10, 50, 90], p[[10, 50, 90]] + [[0.01], [0.05], [0.02]]))


def stepped(recording):
    t = recording.measured.t
    return points(
        recording, lambda p: p + np.where(t >= t[int(0.6 * t.size)], 5e-4, 0.0)[:, None] * STEP
    )


def slipped(cell, effect, **entry):
    effects = effects_from_list([{'effect': effect, 'time': 60.5, **entry}], UR5)
    robot = UR5.with_frames(tool=anywhere(cell.rng, 0.1))
    return robot, [cell.rests(robot=robot, effects=effects)]


def knock_or_jump(cell):
    """Return a step where the tool never turns."""
    q = np.array(stations(UR5, cell.rng).q)
    q[:, [0, 4, 5]] = [0.3, -1.5, 0.2]
    q[:, 3] = -1.0 - q[:, 1] - q[:, 2]
    run = cell.seen(JointMotion(np.arange(float(len(q))), q, static=True), points=True)
    off = np.where(run.measured.t[:, None] > 60.0, [2e-3, -1e-3, 1e-3], 0.0)
    return points(run, lambda p: p + off)


def sibling(cell, a, d=1.0):
    """Return what is recorded of a UR5 that is believed to be its sibling."""
    return replace(UR5, name='sibling', a=UR5.a * [1, a, 1, 1, 1, 1], d=UR5.d * [1, 1, 1, d, 1, 1])


def shifted():
    base = np.array(UR5.T_world_base)
    base[:3, 3] += [6e-3, 0.0, 0.0]
    return UR5.with_frames(base=base)


def hung(cell, axis, angle, gravity):
    """Return an arm that hangs from a ceiling or a wall, with a gravity."""
    stands = Rotation.from_euler(axis, angle, degrees=True).as_matrix()
    base = transform(stands, np.array([0.3, -0.2, 1.1]))
    robot = replace(UR5.with_frames(base=base), gravity=np.array(gravity))
    return robot, [cell.rests(robot=robot)]


HALF = np.array([-1, -1, 1])
KINDS = {
    # Units, signs, joints and frames
    'sound': ('', lambda c: c.placed),
    'sound, moving': ('', lambda c: c.own, NONE),
    'degrees': ('units', lambda c: joints(c.placed, np.degrees)),
    'two joints the other way': ('sign', lambda c: joints(c.placed, lambda q: q * [1, -1, 1, 1, -1, 1])),
    'a left-handed frame': ('sign', lambda c: points(c.placed, lambda p: p * [1, 1, -1])),
    'units and sign': ('sign units', lambda c: points(
        joints(c.placed, lambda q: q * [1, 1, -1, 1, 1, 1]), lambda p: p * 1e3)),
    'another arm': ('other_robot', lambda c: (load('abb_irb120'), [c.placed])),
    'a sibling that is not bundled': ('other_robot', lambda c: (sibling(c, 1.04, 1.1), [c.placed])),
    'links of a sibling': ('other_robot', lambda c: (sibling(c, 1.014), [c.rests(points=True)]), NONE),
    'frames that are off a little': ('', lambda c: (shifted(), [c.rests(points=True)]), NONE),
    'a frame that nobody asked to fit': ('other', lambda c: c.rests(robot=c.elsewhere(0.0)), NONE),
    'a base turned by half a turn': ('base_turned', lambda c: points(c.own, lambda p: p * HALF), NONE),
    'such a base is fitted': ('', lambda c: points(c.own, lambda p: p * HALF), ('base',)),
    'rows mixed up': ('other', lambda c: joints(c.placed, lambda q: q[c.rng.permutation(len(q))])),
    'a reading missed': ('other', lambda c: one_off(c, np.delete(np.arange(60), 25))),
    'a reading doubled': ('other', lambda c: one_off(c, np.insert(np.arange(60), 40, 40)[:-1])),
    'the last stations mixed up': ('other', lambda c: points(
        c.few, lambda p: np.r_[p[:35], p[35:][c.rng.permutation(len(p) - 35)]])),
    'orientations inverted': ('other', lambda c: turns(c.placed, lambda r: np.swapaxes(r, -1, -2))),
    'quaternions w first': ('other', lambda c: turns(
        c.placed, lambda r: matrix_from_quaternion(np.roll(quaternion_from_matrix(r), 1, axis=-1)))),
    'few stations of a coupled wrist': ('', coupled_wrist, NONE),
    # Clocks and streams
    'early': ('clock', lambda c: stamps(c.run, lambda t: t - 0.25)),
    'another epoch': ('clock', lambda c: stamps(
        c.moves(seconds=12.0), lambda t: t + 5000.0), NONE),
    'clocks that run apart': ('clock', lambda c: stamps(c.run, lambda t: t * 1.005)),
    'play of joint 2 is no clock': ('', lambda c: play(c, 1, -0.08, 2.4), NONE),
    'play of joint 3 is no clock': ('', lambda c: play(c, 2, 0.07, 2.1), NONE),
    'a gap in the stamps': ('', lambda c: c.run.with_measured(
        c.run.measured.take((c.run.measured.t < 5.0) | (c.run.measured.t > 7.0)))),
    'irregular stamps': ('', lambda c: stamps(
        c.run, lambda t: np.sort(t + c.rng.uniform(-0.008, 0.008, t.size)))),
    'rounded stamps': ('', lambda c: stamps(c.run, lambda t: np.round(t, 2))),
    'given twice': ('', lambda c: (UR5, [c.placed, replace(c.placed, name='again')])),
    'a frozen instrument': ('', lambda c: points(
        c.moves(size=0.04), lambda p: p[np.arange(len(p)) // 3 * 3])),
    'counts of an encoder': ('', lambda c: joints(c.run, lambda q: np.round(q / 1e-5) * 1e-5)),
    'no velocities of one joint': ('zero_velocities', velocities),
    # Joints that stand still, strays, frames left open
    'one joint hardly moves': ('', hardly_moving),
    'frames left open': ('', lambda c: c.seen(moving(UR5, c.rng, size=0.003))),
    'one reading stuck while moving': ('joints_stuck', lambda c: stuck(c, moving(UR5, c.rng), [3])),
    'all stuck while moving': ('joints_stuck', lambda c: stuck(c, moving(UR5, c.rng), list(range(6)))),
    'one reading stuck at stations': ('joints_stuck', lambda c: stuck(c, stations(UR5, c.rng), [3])),
    'all stuck at stations': ('joints_stuck', lambda c: stuck(c, stations(UR5, c.rng), list(range(6)))),
    'stuck in a third of the stations': ('joints_stuck', stuck_in_a_third),
    'a joint that rests': ('', lambda c: standing(c, 400, 3)),
    'a stray while it stands': ('', stray_while_it_stands),
    'outliers while moving': ('', lambda c: outliers(c, moving)),
    'outliers at stations': ('', lambda c: outliers(c, stations)),
    # What gave way
    'a step of the base while moving': ('', lambda c: stepped(c.run)),
    'a step of the base at stations': ('', lambda c: stepped(c.placed)),
    'a joint slipped': ('', lambda c: slipped(c, 'joint_slip', joint='elbow_joint', offset=1.5e-3)),
    'the reflector jumped': ('', lambda c: slipped(c, 'tool_slip', xyz=[1e-3, -5e-4, 0.0])),
    'the instrument was knocked': ('', lambda c: slipped(c, 'instrument_knock', xyz=[1e-3, 5e-4, 8e-4])),
    'a knock or a jump': ('', knock_or_jump, NONE),
    # Gravity
    'gravity up of a ceiling': ('', lambda c: hung(c, 'x', 180, [0.0, 0.0, -G]), NONE),
    'gravity along a wall': ('', lambda c: hung(c, 'x', 90, [0.0, 0.0, -G]), NONE),
    'gravity down of a ceiling': ('', lambda c: hung(c, 'x', 180, [0.0, 0.0, G]), NONE),
    'gravity down of a wall': ('', lambda c: hung(c, 'x', 90, [0.0, -G, 0.0]), NONE),
    'an arm of which nothing is said': ('', lambda c: hung(c, 'x', 0, [0.0, 0.0, G]), NONE),
}  # fmt: skip
"""What is wrong, how a cell is spoilt so, and which frames are to be fitted; both if none is said."""


def told(found, robot):
    """Return what is said of a cell: what was seen, what is wrong, what gave way, how it was undone."""
    out = [f'{c.level} {c.name}: {c.sentence}' for c in found.checks if c.level != 'ok']
    for item in found.unsound:
        undone = 'undone' if item.applied else 'not undone'
        out.append(f'{item.kind} {item.at} {item.alike} {undone}: {item.sentence} {item.remedy}')
    for slip in found.slips:
        out.append(f'{slip.kind} t={slip.effect.time:.1f} size={slip.size:.2g} {slip.alike}')
    if found.posed is None:
        return [*out, 'not to be diagnosed']
    turned = found.given.robot.T_world_base[:3, :3] - robot.T_world_base[:3, :3]
    if np.abs(turned).max() > 1e-9:
        out.append(
            f'base turned to {np.round(found.given.robot.T_world_base[:3, :3], 6).tolist()}'
        )
    if found.unsound:
        last = found.given.recordings[-1]
        sums = [np.linalg.norm(np.diff(v, axis=0)) for v in (last.joints.q, last.seen.position)]
        begun = last.seen.t[0] - last.joints.t[0]
        out.append(
            'joints {:.5g}, points {:.5g}, '.format(*sums) + f'which begin {begun:.3f} s later'
        )
    return [
        *out,
        f'to be diagnosed, fitting {" and ".join(sorted(found.posed[0].align)) or "no frame"}',
    ]


@pytest.mark.parametrize('name', KINDS)
def test_what_is_wrong_is_named_and_nothing_else_is(name, kept):
    kinds, spoilt, *frames = KINDS[name]
    made = spoilt(Cell())
    robot, recordings = made if isinstance(made, tuple) else (UR5, [made])
    align = frozenset(frames[0] if frames else BOTH)
    found = examine(Given(tuple(recordings), robot, align), apply=True)
    assert sorted({item.kind for item in found.unsound}) == kinds.split()
    kept(name.replace(', ', '_').replace(' ', '_'), '\n'.join(told(found, robot)) + '\n')
