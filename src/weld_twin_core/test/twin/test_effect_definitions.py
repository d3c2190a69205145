# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Every effect against its definition, written a second time as loops over plain matrices."""

import tracemalloc
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from usual_effects import OF_CELLS, bundled

from weld_twin_core import JointMotion, ModelError, Recording, Twin, effect_from_mapping
from weld_twin_core.arm.controller_frames import ControllerFrames
from weld_twin_core.effects import REGISTRY
from weld_twin_core.effects.hooks import highest_order, highest_order_alone
from weld_twin_core.effects.view import View


@dataclass
class Cell:
    """What one sample of the reference starts from; a definition changes it."""

    robot: object
    textbook: object
    t: float
    elapsed: float
    temperature: float
    wrench: np.ndarray
    q: np.ndarray
    table: dict = field(default_factory=dict)
    base: np.ndarray | None = None
    root: np.ndarray | None = None
    tool: np.ndarray | None = None
    shift: object = None

    def pose(self):
        pose = self.textbook.pose(self.robot, self.q, self.table, self.base, self.tool, self.root)
        if self.shift is not None:
            pose = pose.copy()
            pose[:3, 3] += self.shift(pose)
        return pose


DEFINITIONS = {}
"""By the name of an effect its parameters, and what it does to a cell."""


def defines(**values):
    def keep(definition):
        DEFINITIONS[definition.__name__] = values, definition

    return keep


SMALL = np.array([1e-3, -2e-3, 3e-3])
TURN = np.array([0.1, 0.2, -0.3])
SAG = 1e-3 * np.array([1.0, -2.0, 3.0, 0.5, 4.0, -1.0, 2.5, -3.0, 1.5])


@defines(joint='j1', offset=2e-3)
def joint_offset(cell):
    cell.q[1] += 2e-3


def row(key):
    def change(cell):
        cell.table[(key, 2)] = 3e-3

    return change


DEFINITIONS |= {
    'link_length': ({'joint': 'j2', 'da': 3e-3}, row('a')),
    'link_offset': ({'joint': 'j2', 'dd': 3e-3}, row('d')),
    'link_twist': ({'joint': 'j2', 'dalpha': 3e-3}, row('alpha')),
    'axis_parallelism': ({'joint': 'j2', 'dbeta': 3e-3}, row('beta')),
}


def moved(frame, share):
    """Return what moves the base or the tool, by a share of `SMALL` and `TURN`."""

    def change(cell):
        own, side = ('T_world_base', 'left') if frame == 'base' else ('T_flange_tool', 'right')
        by = np.array([SMALL, TURN]) * share(cell)
        setattr(cell, frame, cell.textbook.frame(getattr(cell.robot, own), *by, side))

    return change


MOVES = {
    'base_pose': ({}, moved('base', lambda cell: 1.0)),
    'tool_pose': ({}, moved('tool', lambda cell: 1.0)),
    'setup_step': ({'time': 2.0}, moved('base', lambda cell: cell.t < 2.0)),
    'instrument_knock': ({'time': 2.0}, moved('base', lambda cell: cell.t >= 2.0)),
    'tool_slip': ({'time': 2.0}, moved('tool', lambda cell: cell.t >= 2.0)),
    'setup_settling': (
        {'time_constant': 2.0, 'start': 1.0},
        moved('base', lambda cell: np.exp(-max(cell.t - 1.0, 0.0) / 2.0)),
    ),
}
DEFINITIONS |= {
    name: ({'xyz': SMALL, 'rotvec': TURN, **more}, change)
    for name, (more, change) in MOVES.items()
}


@defines(joint='j1', offset=2e-3, time=2.0)
def joint_slip(cell):
    if cell.t >= 2.0:
        cell.q[1] += 2e-3


@defines(joint='j1', scale=4e-3)
def gear_ratio(cell):
    cell.q[1] *= 1.0 + 4e-3


@defines(joint='j1', values=[1e-3, -2e-3, 4e-3], knots=[-2.0, 0.5, 2.5])
def joint_curve(cell):
    """A natural spline of three knots: its one moment follows from the jump of the slopes."""
    x, (y0, y1, y2) = np.clip(cell.q[1], -2.0, 2.5), (1e-3, -2e-3, 4e-3)
    left, right = 2.5, 2.0
    moment = 6.0 * ((y2 - y1) / right - (y1 - y0) / left) / (2.0 * (left + right))
    if x < 0.5:
        h, a, b, u, v = left, y0, y1, x + 2.0, 0.5 - x
    else:
        h, a, b, u, v = right, y2, y1, 2.5 - x, x - 0.5
    bend = moment * u**3 / (6.0 * h) + (b / h - moment * h / 6.0) * u + a / h * v
    cell.q[1] += bend


@defines(
    xyz=np.repeat(SMALL, 2),
    rotvec=np.stack([0.0 * TURN, TURN], axis=1).ravel(),
    knots=[0.0, 4.0],
    frame='tool',
)
def frame_curve(cell):
    share = np.clip(cell.elapsed / 4.0, 0.0, 1.0)
    turn = share * TURN
    cell.tool = cell.textbook.frame(cell.robot.T_flange_tool, SMALL, turn, 'right')


@defines(joint='j1', amplitude=[1e-3, 2e-3], order=[3, 50], phase=[0.3, -0.2])
def transmission_ripple(cell):
    theta = cell.q[1]
    cell.q[1] += 1e-3 * np.sin(3 * theta + 0.3) + 2e-3 * np.sin(50 * theta - 0.2)


@defines(joint='j2', source='j1', ratio=5e-3)
def joint_coupling(cell):
    cell.q[2] += 5e-3 * cell.q[1]


@defines(joint='j1', step=1e-2, phase=0.3)
def quantization(cell):
    """Stairs at three tenths of a step and every step on."""
    cell.q[1] = np.floor((cell.q[1] - 3e-3) / 1e-2 + 0.5) * 1e-2 + 3e-3


def settled(cell, torque):
    """A spring of joint 1 rests where it balances the load of the posture it has sagged to."""

    def unbalanced(give):
        q = cell.q.copy()
        q[1] += give
        return give - 1e-4 * torque(q)[1]

    cell.q[1] += brentq(unbalanced, -0.2, 0.2, xtol=1e-15)


@defines(joint='j1', compliance=1e-4)
def joint_compliance(cell):
    settled(cell, lambda q: cell.textbook.load_torque(cell.robot, q, cell.wrench, joints=[1]))


@defines(mass=1.5, com=SMALL * 50)
def payload(cell):
    extra = {'extra_mass': 1.5, 'extra_com': SMALL * 50}
    settled(
        cell, lambda q: cell.textbook.load_torque(cell.robot, q, cell.wrench, joints=[1], **extra)
    )


@defines(compliance=[1e-4, 2e-4, 3e-4])
def cartesian_compliance(cell):
    cell.shift = lambda pose: pose[:3, :3] @ np.diag([1e-4, 2e-4, 3e-4]) @ cell.wrench[:3]


@defines(coefficient=2e-4)
def thermal_growth(cell):
    growth = 2e-4 * (cell.temperature - 20.0)
    for key in ('a', 'd'):
        for i in range(cell.robot.n):
            cell.table[(key, i)] = growth * getattr(cell.robot, key)[i]


@defines(joint='j1', width=2e-3, torque=5.0)
def loaded_play(cell):
    torque = cell.textbook.load_torque(cell.robot, cell.q, cell.wrench)[1]
    cell.q[1] += 0.5 * 2e-3 * np.sin(np.arctan2(torque, 5.0))


@defines(joint='j1', compliance=2e-5, torque=10.0)
def stiffening(cell):
    pull = cell.textbook.load_torque(cell.robot, cell.q, cell.wrench)[1]
    # The windup x of a gear whose torque is (x + x^3 / x0^2) / compliance, as a root.
    roots = np.roots([1.0 / (2e-5 * 10.0) ** 2, 0.0, 1.0, -2e-5 * pull])
    cell.q[1] += roots[np.abs(roots.imag).argmin()].real


@defines(joint='j0', lean=[2e-3, 1e-3, 0.0, 3e-3], second=[0.0, -4e-4, 5e-4, 0.0])
def bearing_tilt(cell):
    angle, standard = cell.q[0], cell.robot.convention == 'standard'
    x, y = 2e-3 * np.cos(angle) + 1e-3 * np.sin(angle), 3e-3 * np.sin(angle)
    x, y = x - 4e-4 * np.sin(2.0 * angle), y + 5e-4 * np.cos(2.0 * angle)
    if standard and cell.robot.behind:
        cell.table = {('alpha', 1): x, ('beta', 1): y}  # the row before it, from the foot outward
    elif standard:
        axes = cell.robot.T_world_base[:3, :2]
        turn = Rotation.from_rotvec(axes @ [x, y]).as_matrix()
        cell.base = np.array(cell.robot.T_world_base)
        cell.base[:3, :3] = turn @ cell.base[:3, :3]
    else:
        cell.table = {('alpha', 0): x, ('beta', 0): y}


@defines(rate=1e-3, slowing=0.3)
def wear(cell):
    worn = np.eye(4)
    worn[2, 3] = -1e-3 * np.log(1.0 + 0.3 * cell.elapsed) / 0.3
    cell.tool = cell.robot.T_flange_tool @ worn


@defines(joint='j2', strain=1e-3, warming_time=2.0)
def link_warm_up(cell):
    warmth = 1.0 - np.exp(-cell.elapsed / 2.0)
    for key in ('a', 'd'):
        cell.table[key, 2] = 1e-3 * warmth * getattr(cell.robot, key)[2]


@defines(joint='j2', offset=1e-3, warming_time=2.0)
def joint_warm_up(cell):
    cell.q[2] += 1e-3 * (1.0 - np.exp(-cell.elapsed / 2.0))


@defines(xyz_rate=SMALL)
def drift(cell):
    cell.shift = lambda pose: SMALL * cell.elapsed


@defines(scale=2e-3)
def measurement_scale(cell):
    cell.shift = lambda pose: 2e-3 * pose[:3, 3]


@defines(compliance=[1e-5, 3e-5])
def pedestal_tilt(cell):
    """Two levers at a time: every weight, and the wrench, about the base's origin."""
    robot = cell.robot
    base = np.eye(4) if robot.behind else robot.T_world_base
    gravity, pose = base[:3, :3] @ robot.gravity, base
    moment = np.zeros(3)
    rows = cell.textbook.rows(robot, cell.q)
    for k in range(robot.behind, robot.n):
        pose = pose @ rows[k]
        centre = (pose @ [*robot.com[k], 1.0])[:3]
        moment += np.cross(centre - base[:3, 3], robot.mass[k] * gravity)
    tool = pose @ robot.T_flange_tool
    centre = (tool @ [*robot.payload_com, 1.0])[:3]
    moment += np.cross(centre - base[:3, 3], robot.payload_mass * gravity)
    force, twist = tool[:3, :3] @ cell.wrench[:3], tool[:3, :3] @ cell.wrench[3:]
    moment += twist + np.cross(tool[:3, 3] - base[:3, 3], force)
    own = base[:3, :3].T @ moment
    turn = base[:3, :3] @ [1e-5 * own[0], 3e-5 * own[1], 0.0]
    leaned = cell.textbook.frame(base, np.zeros(3), turn, 'left')
    if robot.behind:
        cell.root = robot.T_root_base @ leaned
    else:
        cell.base = leaned


def weights_behind(cell, joint):
    """Return the moment of what a joint carries, about its origin, in the axes that it leans about."""
    robot, pose = cell.robot, np.eye(4)
    rows = cell.textbook.rows(robot, cell.q)
    force, twist = cell.wrench[:3], cell.wrench[3:]
    ends = [pose := pose @ rows[k] for k in range(robot.behind, robot.n)]
    before, end = ends[joint - 1 - robot.behind], np.eye(4)
    if robot.convention == 'standard':  # the end of the row before, without its turn about y
        end[:3, :3] = Rotation.from_rotvec([0.0, -robot.beta[joint - 1], 0.0]).as_matrix()
    else:
        end[:3, :3] = Rotation.from_rotvec([robot.alpha[joint], 0.0, 0.0]).as_matrix()
        along = Rotation.from_rotvec([0.0, robot.beta[joint], 0.0]).as_matrix()[:, 0]
        end[:3, 3] = robot.a[joint] * end[:3, :3] @ along
    before = before @ end
    tool = pose @ robot.T_flange_tool
    weights = [
        ((ends[k - robot.behind] @ [*robot.com[k], 1.0])[:3], robot.mass[k])
        for k in range(joint, robot.n)
    ]
    weights.append(((tool @ [*robot.payload_com, 1.0])[:3], robot.payload_mass))
    moment = sum(np.cross(at - before[:3, 3], mass * robot.gravity) for at, mass in weights)
    pull = np.cross(tool[:3, 3] - before[:3, 3], tool[:3, :3] @ force)
    return before[:3, :3].T @ (moment + pull + tool[:3, :3] @ twist)


@defines(joint='j3', compliance=1e-5)
def axis_compliance(cell):
    """Two levers at a time: every weight and the wrench about the origin of joint 3."""
    x, y, _ = 1e-5 * weights_behind(cell, 3)
    row = 2 if cell.robot.convention == 'standard' else 3
    cell.table = {('alpha', row): x, ('beta', row): y}


@defines(sag=SAG, turning=[0.5, -1.0, 2.0])
def tool_sag(cell):
    turn = np.eye(3)
    for row in cell.textbook.rows(cell.robot, cell.q)[cell.robot.behind :]:
        turn = turn @ row[:3, :3]
    down = turn.T @ cell.robot.gravity / np.linalg.norm(cell.robot.gravity)
    tool = cell.robot.T_flange_tool
    # The least turn about the flange that takes the tip along; its axes are the tool's.
    sag = SAG.reshape(3, 3) @ down
    least = np.linalg.pinv([np.cross(axis, tool[:3, 3]) for axis in tool[:3, :3].T]).T @ sag
    more = tool[:3, :3].T @ np.cross([0.5, -1.0, 2.0], sag)
    cell.tool = cell.textbook.frame(tool, sag, least + more, 'right')


@defines(force=[10.0, -20.0, 30.0], stiffness=40.0)
def hose_pull(cell):
    """Virtual work: the joint turns a little, and the energy of a spring and a weight changes."""

    def energy(q):
        pose = np.eye(4)
        for row in cell.textbook.rows(cell.robot, q)[cell.robot.behind :]:
            pose = pose @ row
        place = pose[:3, 3]
        return 0.5 * 40.0 * place @ place - place @ [10.0, -20.0, 30.0]

    step = 1e-5 * np.eye(cell.robot.n)[1]

    def torque(q):
        pull = (energy(q + step) - energy(q - step)) / 2e-5
        return cell.textbook.load_torque(cell.robot, q, cell.wrench, joints=[1]) - pull

    settled(cell, torque)


@defines(warming=[100.0, -200.0, 300.0], instrument=[-4.0, 1.0, 0.0])
def refraction(cell):
    """Half the square of the way across the gradient to the warmth; as much nearer along it."""
    less = 7.86e-4 * 101.325 * (1.0 / 293.14 - 1.0 / 293.16) / 0.02

    def shift(pose):
        sight, warming = pose[:3, 3] - [-4.0, 1.0, 0.0], np.array([100.0, -200.0, 300.0])
        far = np.linalg.norm(sight)
        along = (warming @ sight) * sight / far**2
        return 0.5 * less * far**2 * ((warming - along) - along)

    cell.shift = shift


@defines(sigma=1e-3)
def measurement_noise(cell):
    pass


IN_TIME = {'backlash', 'servo_lag', 'vibration', 'time_delay', 'clock_rate'}
LOST_MOTION = {'friction', 'hysteresis', 'gear_ratio_by_direction'}
"""Tested in test_lost_motion."""


def effect(name, **values):
    return effect_from_mapping({'effect': name, **values})


def with_helpers(name, effects):
    """Return the effects; a payload or a hose shows only through a spring."""
    spring = [effect('joint_compliance', joint='j1', compliance=1e-4)]
    return tuple(effects) + tuple(spring if name in ('payload', 'hose_pull') else [])


def test_every_effect_is_tested_here_or_held_against_the_plant():
    plant = pytest.importorskip('weld_twin_lab.plant.plant')
    held = set(DEFINITIONS) | IN_TIME | LOST_MOTION | OF_CELLS
    assert {kind.name for kind in bundled()} <= held | plant.KNOWN


@pytest.mark.parametrize('name', DEFINITIONS)
def test_effect_does_what_its_definition_says(
    name, build, textbook, make_recording, motion_at, stamps
):
    robot, (values, definition) = build, DEFINITIONS[name]
    recording = make_recording(robot)
    at = stamps(recording, 6)
    # Beside a positioner a lean of the arm is one of the positioner the other way, to its square.
    room = 5e-6 if robot.behind and name == 'pedestal_tilt' else 1e-9
    found = Twin(robot, with_helpers(name, [effect(name, **values)])).poses(recording, at)
    for k, t in enumerate(at):
        told = t - recording.joints.t[0], 20.0 + 2.0 * t, recording.wrench.at(np.array(t))
        cell = Cell(robot, textbook, t, *told, motion_at(robot, t).copy())
        definition(cell)
        expected = cell.pose()
        np.testing.assert_allclose(found.position[k], expected[:3, 3], atol=room)
        np.testing.assert_allclose(found.rotation[k], expected[:3, :3], atol=1e-9)


def test_a_pedestal_leans_about_where_the_arm_stands(arm, make_recording):
    foot = np.eye(4)
    foot[:3, 3] = [0.3, -0.2, 0.8]
    standing = replace(arm, controller=ControllerFrames(foot=foot))
    recording = replace(make_recording(arm), wrench=None)
    leaning = effect('pedestal_tilt', compliance=[1e-6, 1e-6])
    nominal = Twin(arm).poses(recording)

    def turned(robot):
        """Return where the tool went, and how the base turned."""
        found = Twin(robot, [leaning]).poses(recording)
        turn = found.rotation @ np.swapaxes(nominal.rotation, -1, -2)
        return found.position - nominal.position, Rotation.from_matrix(turn).as_rotvec()

    moved, turn = turned(standing)
    base = arm.T_world_base
    stands = (base @ foot)[:3, 3]
    np.testing.assert_allclose(moved, np.cross(turn, nominal.position - stands), atol=1e-7)
    weight = (arm.mass.sum() + arm.payload_mass) * base[:3, :3] @ arm.gravity
    more = base[:3, :3].T @ np.cross(base[:3, 3] - stands, weight)
    expected = base[:3, :3] @ [1e-6 * more[0], 1e-6 * more[1], 0.0]
    np.testing.assert_allclose(turn - turned(arm)[1], np.tile(expected, (len(turn), 1)), atol=1e-8)


def test_a_wrench_in_the_base_frame_yields_along_the_tools_axes(arm, make_recording, stamps):
    base = np.eye(4)
    base[:3, :3] = Rotation.from_rotvec([0.4, 0.5, -0.6]).as_matrix()
    arm = arm.with_frames(base=base)
    recording = make_recording(arm, wrench_frame='base')
    at = stamps(recording, 6)
    nominal = Twin(arm).poses(recording, at)
    found = Twin(arm, (effect('cartesian_compliance', compliance=[1e-4, 0, 0]),)).poses(
        recording, at
    )
    for k, t in enumerate(at):
        force = arm.T_world_base[:3, :3] @ recording.wrench.at(np.array(t))[:3]
        x = nominal.rotation[k][:, 0]
        np.testing.assert_allclose(
            found.position[k] - nominal.position[k], 1e-4 * x * (x @ force), atol=1e-14
        )


def joint_under(arm, effects, recording, joint, at=None):
    """Return the position of one joint behind the poses."""
    return Twin(arm, tuple(effects)).joints(recording, at)[..., arm.index(joint)]


def play_loop(q, width):
    out, w = [], q[0]
    for value in q:
        if w > value + width / 2:
            w = value + width / 2
        elif w < value - width / 2:
            w = value - width / 2
        out.append(w)
    return np.array(out)


@pytest.mark.parametrize('static', [False, True])
@pytest.mark.parametrize('width', [0.0, 1e-3, 0.3, 10.0])
def test_backlash_is_play_as_a_loop_would_compute_it(arm, make_recording, width, static):
    recording = make_recording(arm, 200, static=static)
    found = joint_under(arm, [effect('backlash', joint='j2', width=width)], recording, 'j2')
    np.testing.assert_allclose(found, play_loop(recording.joints.q[:, 2], width), atol=1e-15)


def reversal_loop(q, width):
    out, last = [q[0]], 0.0
    for before, now in pairwise(q):
        way = np.sign(now - before)
        out.append(now - width if way * last < 0 else now)
        last = way if way else last
    return np.array(out)


def test_the_literal_reversal_form_jumps_for_one_sample_only(arm, make_recording):
    recording = make_recording(arm, 200)
    q = recording.joints.q.copy()
    q[:, 2] = np.round(np.sin(np.linspace(0, 20, 200)), 1)
    recording = Recording('rests and reversals', JointMotion(recording.joints.t, q))
    form = effect('backlash', joint='j2', width=1e-3, form='reversal')
    expected = reversal_loop(q[:, 2], 1e-3)
    assert (expected != q[:, 2]).sum() == 6
    np.testing.assert_allclose(joint_under(arm, [form], recording, 'j2'), expected, atol=1e-15)


def followed(law, t, state, kick=None):
    """Return the states at stamps, solved from each to the next; a rate jumps at each by ``kick``."""
    out = [np.array(state, float)]
    for k, span in enumerate(pairwise(t)):
        begin = out[-1] + (0.0 if kick is None else [0.0, kick[k]])
        out.append(solve_ivp(law, span, begin, method='LSODA', rtol=1e-10, atol=1e-13).y[:, -1])
    return np.array(out)[:, 0]


@pytest.mark.parametrize(
    ('tau', 'damping'),
    [(1e-4, None), (0.02, None), (0.5, None), (0.02, 0.4), (0.05, 1.0), (0.3, 3.0)],
)
def test_servo_lag_solves_its_differential_equation(arm, make_recording, tau, damping):
    recording, swings = make_recording(arm), {} if damping is None else {'damping': damping}
    t, q = recording.joints.t, recording.joints.q[:, 3]

    def law(now, state):
        behind = np.interp(now, t, q) - state[0]
        if not swings:
            return [behind / tau]
        return [state[1], (2.0 * damping / tau) ** 2 * (behind - tau * state[1])]

    expected = followed(law, t, [q[0], 0.0] if swings else [q[0]])
    lag = effect('servo_lag', joint='j3', time_constant=tau, **swings)
    np.testing.assert_allclose(joint_under(arm, [lag], recording, 'j3'), expected, atol=2e-8)


def test_a_lag_that_swings_is_nothing_at_zero(arm, make_recording):
    recording = make_recording(arm, 60)
    none = effect('servo_lag', joint='j3', time_constant=0.0, damping=0.4)
    found = Twin(arm, (none,)).joints(recording)
    np.testing.assert_allclose(found, recording.joints.q, atol=1e-7)
    with pytest.raises(ModelError, match='damping must be between'):
        Twin(arm, (effect('servo_lag', joint='j3', time_constant=0.1, damping=-1.0),))


def test_vibration_solves_its_differential_equation(arm, make_recording):
    recording = make_recording(arm)
    t, q = recording.joints.t, recording.joints.q[:, 3]
    omega, damping, gain = 2 * np.pi * 3.0, 0.07, 0.4
    rate = np.diff(q) / np.diff(t)
    # Between samples the command is straight and nothing drives; at a sample its rate jumps.
    kick = -gain * np.diff(rate, prepend=rate[0])
    swing = followed(
        lambda _, x: [x[1], -2 * damping * omega * x[1] - omega**2 * x[0]], t, np.zeros(2), kick
    )
    mode = effect('vibration', joint='j3', frequency=3.0, damping=damping, gain=gain)
    np.testing.assert_allclose(joint_under(arm, [mode], recording, 'j3'), q + swing, atol=1e-9)


def test_a_fast_clock_shows_the_robot_earlier_with_every_second(
    robot, make_recording, motion_at, stamps, textbook
):
    recording = make_recording(robot)
    at, first = stamps(recording, 6), recording.joints.t[0]
    both = (effect('clock_rate', rate=2e-2), effect('time_delay', delay=0.05))
    found = Twin(robot, both).poses(recording, at)
    for k, t in enumerate(at):
        shown = first + (t - first) * 0.98 - 0.05
        expected = textbook.pose(robot, motion_at(robot, shown))
        np.testing.assert_allclose(found.position[k], expected[:3, 3], atol=1e-12)


def test_a_pose_is_stamped_so_that_its_stamp_shows_it(arm):
    twin = Twin(arm, (effect('clock_rate', rate=1e-4), effect('time_delay', delay=0.05)))
    instants = np.linspace(0.0, 100.0, 7)
    # stamp - delay - rate stamp = instant
    np.testing.assert_allclose(
        instants + twin.late(instants), (instants + 0.05) / (1.0 - 1e-4), atol=1e-12
    )
    assert Twin(arm).late(3.0) == 0.0


@pytest.mark.parametrize(
    'own',
    [
        effect('time_delay', delay=5.0),
        effect('clock_rate', rate=0.1),
        effect('servo_lag', joint='j1', time_constant=0.1, damping=0.1),
        effect('vibration', joint='j1', frequency=0.1, damping=0.1, gain=0.1),
        effect('friction', joint='j1', windup=1e-2),
    ],
)
def test_clocks_and_motion_mean_nothing_to_stations(arm, make_recording, own):
    recording = make_recording(arm, static=True)
    found = Twin(arm, (own,)).poses(recording, recording.joints.t)
    np.testing.assert_array_equal(found.position, Twin(arm).poses(recording).position)


def test_a_link_that_follows_a_temperature_grows_as_it_does(arm, make_recording):
    recording = make_recording(arm)
    one = effect('link_warm_up', joint='j2', strain=2e-3, follows=[20.0, 10.0])
    same = effect('thermal_growth', coefficient=2e-4, links=['j2'])
    poses = [Twin(arm, (each,)).poses(recording).position for each in (one, same)]
    np.testing.assert_allclose(*poses, atol=1e-12)
    assert one.on == 'temperature' and len(one.fit.fitted()) == 1
    for wrong in ([20.0], [20.0, 0.0], 'warm'):
        with pytest.raises(ModelError, match='follows must be'):
            effect('link_warm_up', joint='j2', follows=wrong).check(arm)


@pytest.mark.parametrize(('warmer', 'followed'), [(5.0, 1), (0.5, 0)])
def test_a_warm_up_is_looked_for_by_a_temperature_that_varies(ur5, warmer, followed):
    t = np.linspace(0.0, 60.0, 31)
    q = np.zeros((31, 6))
    view = View(ur5, t, t, q, q, temperature=20.0 + warmer * t / 60.0)
    seeds = list(REGISTRY['joint_warm_up'].seeds(view, 'elbow_joint'))
    assert sum(seed.follows is not None for seed in seeds) == followed


def test_drives_that_all_trail_alike_look_like_a_late_clock_and_its_remedy_says_so(ur5):
    t = np.arange(0.0, 8.0, 0.01)
    q = 0.4 * np.sin(0.8 * t[:, None] + np.arange(6.0)) + [0.1, -1.2, 1.5, -1.0, -1.4, 0.3]
    recording = Recording('slow', JointMotion(t, q))
    at = t[100:]  # the lag has settled
    late = effect('time_delay', delay=0.015)
    trailing = [effect('servo_lag', joint=j, time_constant=0.015) for j in ur5.joint_names]
    nominal, one, other = (
        Twin(ur5, causes).poses(recording, at).position for causes in ((), [late], trailing)
    )
    assert np.abs(one - other).max() < 0.01 * np.abs(one - nominal).max()
    assert 'drives that all trail by as much look the same' in late.remedy(ur5)
    assert 'trail' not in effect('time_delay', delay=-0.015).remedy(ur5)


@pytest.mark.parametrize('order', [3.0, [1.0, 4.0]])
def test_sine_and_cosine_of_a_ripple_are_as_large_as_its_amplitude_usually_is(order):
    ripple = effect('transmission_ripple', joint='j1', order=order)
    usual = {p.name: p.typical for p in ripple.parameters}['amplitude']
    assert ripple.fit.coordinate_scales().tolist() == [usual] * (2 * np.size(order))


def test_an_effect_without_words_of_its_own_is_told_with_four_digits(ur5):
    told = effect('measurement_noise', sigma=0.00123456).remedy(ur5)
    assert 'sigma 0.001235 m' in told


def test_stations_that_are_only_counted_show_no_warm_up(arm, make_recording):
    stations, kind = make_recording(arm, 30, static=True), REGISTRY['link_warm_up']
    counted, timed = (
        JointMotion(apart * np.arange(30.0), stations.joints.q, static=True)
        for apart in (1.0, 40.0)
    )
    untold = 'the stations carry no times'
    for motion, reason in ((stations.joints, None), (counted, untold), (timed, None)):
        view = Twin(arm).evaluate(Recording('stations', motion)).view
        assert kind.applicable(view, 'j2') == reason


@pytest.mark.parametrize('curve', [{'warmup': [10.0, 2.0]}, {'warmup': 10.0, 'warming_time': 2.0}])
def test_a_warm_up_curve_stands_in_for_a_temperature(arm, make_recording, curve):
    recording = make_recording(arm)
    warm = effect('thermal_growth', coefficient=1e-3, links=['j1'], **curve)
    assert warm.on == 'time' and warm.to_mapping().items() >= curve.items()
    assert len(warm.fit.fitted()) == len(curve)  # a time constant that is given is kept
    elapsed = recording.joints.t - recording.joints.t[0]
    shift = warm.displace(Twin(arm).evaluate(recording).view)
    assert set(shift) == {('a', 1)}
    expected = -0.425 * 1e-3 * 10.0 * (1.0 - np.exp(-elapsed / 2.0))
    np.testing.assert_allclose(shift['a', 1], expected, rtol=1e-12)


def test_noise_has_the_deviation_it_is_given_on_every_coordinate():
    drawn = effect('measurement_noise', sigma=1e-3).draw(20000, np.random.default_rng(0))
    assert drawn.shape == (20000, 3)
    np.testing.assert_allclose(drawn.std(axis=0), 1e-3, rtol=0.02)
    np.testing.assert_allclose(np.corrcoef(drawn.T), np.eye(3), atol=0.03)


def test_a_search_believes_low_orders_of_a_ripple_as_scales_are_believed():
    waves = REGISTRY['transmission_ripple'].search.lines('j1', np.arange(1.0, 101.0))
    believed = np.exp([-wave.search.surprise(100.0) for wave in waves])
    assert believed.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(believed[[1, 9, 99]] / believed[0], [0.5, 0.1, 0.01])
    bent = REGISTRY['stiffening']('j1', 0.0, 5.0)
    assert bent.search.surprise(bent.search.trials(None, 'j1')) > 1.5  # a torque is chosen, too


def test_a_number_beside_lists_holds_for_every_order_of_a_ripple(arm, make_recording):
    recording = make_recording(arm)
    short = effect('transmission_ripple', joint='j1', amplitude=1e-3, order=[2, 5])
    long = effect(
        'transmission_ripple', joint='j1', amplitude=[1e-3, 1e-3], order=[2, 5], phase=[0, 0]
    )
    np.testing.assert_array_equal(
        Twin(arm, (short,)).poses(recording).position, Twin(arm, (long,)).poses(recording).position
    )


@pytest.mark.parametrize('samples', [30, 150, 3000, 100_000])
def test_waves_that_a_slow_joint_passes_are_told_however_densely_it_is_sampled(samples):
    """Neighbours of a slow seam all but coincide; three waves of order 100 are passed all the same."""
    path = np.linspace(0.3, 0.3 + 3 * 2 * np.pi / 100, samples)
    assert highest_order(path) >= 100
    # Half a wave needs a position of its own: at rest at ten places, twitching by a micron or not.
    places = np.repeat(np.linspace(0.0, 1.0, 10), 20)
    twitching = places + 1e-6 * np.random.default_rng(1).standard_normal(places.size)
    assert highest_order(twitching) == pytest.approx(9 * np.pi, rel=1e-4)
    assert highest_order(np.zeros(samples)) == 0.0


def test_a_wave_alone_is_told_by_stations_at_random_and_no_better_on_a_grid():
    grid, rng = np.linspace(0.0, 2.0, 41), np.random.default_rng(3)
    assert (
        highest_order_alone(grid)
        == pytest.approx(highest_order(grid))
        == pytest.approx(20 * np.pi)
    )
    scattered = rng.uniform(0.0, 2.0, 41)
    assert highest_order_alone(scattered) > 1.2 * highest_order(scattered)
    assert highest_order_alone(np.zeros(5)) == 0.0


@pytest.mark.parametrize('travel', [6.0, 60.0, 2e3])
def test_stairs_are_looked_for_within_bounded_memory(ur5, travel):
    # A reading in the wrong unit, or of a program that went astray, may travel any way.
    q = np.random.default_rng(1).uniform(0.0, travel, (2000, 6))
    t, pull = np.arange(2000.0), 5e-3 * np.rint(q[:, 2] / 5e-3) - q[:, 2]
    view = View(ur5, t, t, q, np.zeros_like(q), static=True)
    tracemalloc.start()
    found = list(REGISTRY['quantization'].seeds(view, 'elbow_joint', pull))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 3e8
    assert travel > 1e3 or any(abs(seed.step - 5e-3) < 1e-4 for seed in found)
