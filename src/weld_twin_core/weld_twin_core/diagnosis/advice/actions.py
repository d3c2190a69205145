# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What to mend: one sentence for every effect found."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

import numpy as np

from ...arm.controller_lookup import controller_frames
from ...arm.robot import Robot
from ...arm.rotation import rotation_matrix
from ...arrays import Array
from ...effects.effect import Effect
from ..soundness.mending import turned_joints
from .readable import frame, metres, number, radians, size, travel, turn
from .zeros import TURNED_ROUND, stands, to_mend

Sentence = Callable[[Effect, Robot], str]


def actions(
    found: Sequence[Effect], robot: Robot, mends: Sequence[Mapping[str, Any]] = ()
) -> tuple[str, ...]:
    """
    Return what to do about every effect found, one sentence each, in their order.

    Parameters
    ----------
    found : sequence of Effect
    robot : Robot
        The nominal model: what is entered in the controller now.
    mends : sequence of mapping
        What was undone of the data, as a model has it.

    """
    turned = turned_joints(mends, robot)
    return tuple(_action(effect, robot, turned) for effect in found)


def _action(effect: Effect, robot: Robot, turned: Collection[str]) -> str:
    out = _SENTENCES.get(effect.name, _general)(effect, robot)
    zero = effect.name == 'joint_offset'
    return f'{out} {TURNED_ROUND}' if zero and effect.site in turned else out


def _value(effect: Effect, name: str) -> float:
    return float(np.asarray(getattr(effect, name)))


def _moved(effect: Effect, robot: Robot, value: float) -> str:
    """Return how far its joint moves, in mm where that slides."""
    return travel(value, sliding=effect.on_slide(robot))


def _general(effect: Effect, robot: Robot) -> str:
    parameters = ', '.join(
        f'{p.name} {np.array2string(np.asarray(getattr(effect, p.name)), precision=4)} '
        f'{effect.unit(p, robot)}'
        for p in effect.parameters
    )
    where = f' of {effect.site}' if effect.site else ''
    return f'Put {effect.name}{where} into the model: {parameters}.'


def _joint_offset(effect: Effect, robot: Robot) -> str:
    joint, offset = str(effect.site), _value(effect, 'offset')
    sliding = bool(robot.prismatic[robot.index(joint)])
    return f'{stands(joint, offset, sliding=sliding)} {to_mend(offset, sliding=sliding)}'


def _row(parameter: str, key: str, words: str) -> Sentence:
    def sentence(effect: Effect, robot: Robot) -> str:
        error = _value(effect, parameter)
        now = float(getattr(robot, key)[robot.index(str(effect.site))])
        if key in ('a', 'd'):
            old, new = f'{now * 1e3:.3f}', f'{(now + error) * 1e3:.3f} mm'
            return (
                f'Enter {key} = {new} for {effect.site} in the kinematic model in place of {old} '
                f'mm: {words} {metres(error)}.'
            )
        old, new = f'{np.degrees(now):.4f}', f'{np.degrees(now + error):.4f} deg'
        return (
            f'Enter {key} = {new} for {effect.site} in the kinematic model in place of {old} '
            f'deg: {words} {radians(error)}.'
        )

    return sentence


_OF_THE_BASE = 'of the base'
"""A frame that moves turns about axes through its own origin."""


def _of_the_base(step: Array) -> str:
    return frame(step, 'of the measuring frame', _OF_THE_BASE)


def _of_the_origin(step: Array, robot: Robot) -> Array:
    """Return the move of the base of the rows, (6,) [m, rad], as one of the controller's base."""
    lever = robot.T_world_base[:3, :3] @ controller_frames(robot).base[:3, 3]
    swing = rotation_matrix(step[3:]) @ lever - lever
    return np.concatenate([step[:3] + swing, step[3:]])


def _base_pose(effect: Effect, robot: Robot) -> str:
    moved = _of_the_base(_of_the_origin(effect.vector(), robot))
    return (
        f'Correct the base frame by {moved}. If it was right when it was measured, the arm has '
        'moved: check the bolts of its foot.'
    )


def _tool_pose(effect: Effect, robot: Robot) -> str:
    flange = controller_frames(robot).flange[:3, :3]
    step = np.concatenate([flange.T @ effect.vector()[:3], effect.vector()[3:]])
    moved = frame(step, 'of the flange', 'of the tool')
    return f'Correct the tool centre point by {moved}; a bent torch looks like this too.'


def _root_pose(effect: Effect, robot: Robot) -> str:
    rows = robot.T_base_foot
    step = (effect.vector().reshape(2, 3) @ rows[:3, :3]).ravel()
    now = np.asarray(np.linalg.inv(robot.T_root_base @ rows))
    new = np.eye(4)
    new[:3, :3] = rotation_matrix(step[3:]) @ now[:3, :3]
    new[:3, 3] = now[:3, 3] + step[:3]
    moved = frame(step, 'of the base', 'of the positioner')
    return (
        f'Correct the root frame of the positioner by {moved}: in the base of the robot it '
        f'stands at {_placed(new)} in place of {_placed(now)}.'
    )


def _placed(pose: Array) -> str:
    """Return a frame as controllers take it: mm, and turns about fixed x, y and z in degrees."""
    place = ', '.join(f'{value * 1e3:.3f}' for value in pose[:3, 3])
    yaw = np.arctan2(pose[1, 0], pose[0, 0])
    pitch = np.arctan2(-pose[2, 0], np.hypot(pose[0, 0], pose[1, 0]))
    roll = np.arctan2(pose[2, 1], pose[2, 2])
    angles = ', '.join(f'{np.degrees(value):.4f}' for value in (roll, pitch, yaw))
    return f'x, y, z = ({place}) mm, turned by ({angles}) deg about them'


def _guide_bend(effect: Effect, robot: Robot) -> str:
    x, y = np.asarray(effect.curvature) * 0.125e3  # type: ignore[attr-defined]
    return (
        f'Align the guide of {effect.site}: over a metre it is bent by {size(float(x))} mm along x '
        f'and {size(float(y))} mm along y of its row; until then compensate the motion.'
    )


def _guide_tilt(effect: Effect, robot: Robot) -> str:
    each = ', '.join(
        number(float(np.degrees(v)))
        for v in np.asarray(effect.rate)  # type: ignore[attr-defined]
    )
    return (
        f'Level the guide of {effect.site}: its carriage turns by ({each}) deg about x, y, z of '
        'its row on every metre; until then compensate the motion.'
    )


def _gear_ratio(effect: Effect, robot: Robot) -> str:
    scale = _value(effect, 'scale')
    if effect.on_slide(robot):
        return (
            f'Enter the feed of {effect.site} (mm of travel per turn of the motor) times '
            f'{1.0 + scale:.6f}: it goes {number(scale * 1e3)} mm further on every metre than it '
            'reads.'
        )
    return (
        f'Enter the gear ratio of {effect.site} times {1.0 + scale:.6f} where it is turns of the joint '
        f'per turn of the motor, divided by it where it is turns of the motor per turn of the joint: '
        f'it turns {number(scale * 100.0)} % of its angle further than it reads.'
    )


def _gear_ratio_by_direction(effect: Effect, robot: Robot) -> str:
    difference = _value(effect, 'difference')
    more, less = ('up', 'down') if difference > 0.0 else ('down', 'up')
    return (
        f'Compensate the gear of {effect.site} by direction, or approach seams from one side: on '
        f'the way {more} it turns {size(difference * 100.0)} % of its angle further than on the '
        f'way {less}.'
    )


def _ripple(effect: Effect, robot: Robot) -> str:
    amplitude = np.atleast_1d(np.asarray(effect.amplitude))  # type: ignore[attr-defined]
    order = np.atleast_1d(np.asarray(effect.order))  # type: ignore[attr-defined]
    strongest = np.argsort(-np.abs(amplitude))[:3]
    slides = effect.on_slide(robot)
    waves = ', '.join(
        f'{size(amplitude[k] * 1e3, 2)} mm every {2e3 * np.pi / order[k]:.3g} mm'
        if slides
        else f'{size(np.degrees(amplitude[k]), 2)} deg at {order[k]:g} per turn'
        for k in strongest
    )
    more = f' and {amplitude.size - 3} smaller orders' if amplitude.size > 3 else ''
    return (
        f'Compensate the ripple of {effect.site} by table ({waves}{more}); inspect its gear and '
        'encoder if it grows.'
    )


def _joint_coupling(effect: Effect, robot: Robot) -> str:
    source = effect.source  # type: ignore[attr-defined]
    ratio = _value(effect, 'ratio')
    return (
        f'Enter a coupling of {source} into {effect.site}: {number(90.0 * ratio)} deg for every 90 '
        'deg.'
    )


def _backlash(effect: Effect, robot: Robot) -> str:
    play = _moved(effect, robot, _value(effect, 'width'))
    if effect.form == 'coast':  # type: ignore[attr-defined]
        return (
            f'Approach stations with {effect.site} always from one side, or preload its gear: '
            f'where it stops it coasts across {play} of play and rests ahead of its command.'
        )
    return (
        f'Service the gear of {effect.site}: it has {play} of play; '
        'until then approach seams from one side.'
    )


def _hysteresis(effect: Effect, robot: Robot) -> str:
    return (
        f'Compensate the lost motion of {effect.site}, or approach seams from one side: it trails '
        f'by {_moved(effect, robot, _value(effect, "amplitude"))} once it has moved '
        f'{_moved(effect, robot, 3.0 * _value(effect, "travel"))} one way; see to its gear if that '
        'grows.'
    )


def _friction(effect: Effect, robot: Robot) -> str:
    return (
        f'Give the controller of {effect.site} feed-forward against friction, and see to its '
        f'lubrication: in motion it trails by {_moved(effect, robot, _value(effect, "windup"))}.'
    )


def _loaded_play(effect: Effect, robot: Robot) -> str:
    return (
        f'Service or preload the gear of {effect.site}: its load lays it on one flank or the other '
        f'of {_moved(effect, robot, _value(effect, "width"))} of play.'
    )


def _bearing_tilt(effect: Effect, robot: Robot) -> str:
    lean = float(np.linalg.norm(np.asarray(effect.lean)))  # type: ignore[attr-defined]
    return (
        f'Look at the bearing of {effect.site}: its axis leans by {turn(lean)} once per turn; '
        'compensate the poses until it is replaced.'
    )


def _wear(effect: Effect, robot: Robot) -> str:
    hour = _value(effect, 'rate') * 3.6e6
    return (
        f'Renew or measure the tip of the tool: along its axis it draws back by {number(hour)} mm '
        'per hour.'
    )


def _joint_compliance(effect: Effect, robot: Robot) -> str:
    compliance = _value(effect, 'compliance')
    slides = effect.on_slide(robot)
    stiffness = (
        f'a stiffness of {size(1e-3 / compliance)} kN{"/m" if slides else " m/rad"}'
        if compliance > 0.0
        else 'which no spring does'
    )
    return (
        f'Compensate the yielding of {effect.site} under load: '
        f'{metres(compliance * 1e2) if slides else radians(compliance * 1e2)} under '
        f'100 N{"" if slides else " m"}, {stiffness}.'
    )


def _cartesian_compliance(effect: Effect, robot: Robot) -> str:
    values = np.asarray(effect.compliance) * 1e5  # type: ignore[attr-defined]
    each = ', '.join(number(float(v)) for v in values)
    return f'Compensate the yielding of the tool: ({each}) mm per 100 N along its x, y, z.'


def _payload(effect: Effect, robot: Robot) -> str:
    extra = _value(effect, 'mass')
    com = np.asarray(effect.com) * 1e3  # type: ignore[attr-defined]
    where = ', '.join(number(float(v)) for v in com)
    return (
        f'Enter a payload of {robot.payload_mass + extra:.2f} kg in place of '
        f'{robot.payload_mass:.2f} kg; the {number(extra)} kg lie at ({where}) mm in the tool '
        'frame.'
    )


def _servo_lag(effect: Effect, robot: Robot) -> str:
    return (
        f'Give the controller of {effect.site} more feed-forward, or record measured in place of '
        f'commanded joints: it lags by {size(_value(effect, "time_constant") * 1e3)} ms.'
    )


def _time_delay(effect: Effect, robot: Robot) -> str:
    delay = _value(effect, 'delay')
    order = 'late' if delay > 0.0 else 'early'
    return (
        f'Fix the clock: the measurements are stamped {size(delay * 1e3)} ms {order} against the '
        'joint states; synchronise both computers or subtract the delay.'
    )


def _clock_rate(effect: Effect, robot: Robot) -> str:
    ppm = _value(effect, 'rate') * 1e6
    way = 'fast' if ppm > 0.0 else 'slow'
    return (
        f'Synchronise the clocks of both computers all the time: that of the measurements runs '
        f'{size(abs(ppm))} ppm {way}, {size(abs(ppm) * 3.6e-3)} s in an hour.'
    )


def _thermal_growth(effect: Effect, robot: Robot) -> str:
    links = effect.links or ('all links',)  # type: ignore[attr-defined]
    return (
        'Warm the arm up before welding, or compensate '
        f'{number(_value(effect, "coefficient") * 1e3)} mm per m and K for {", ".join(links)}.'
    )


def _link_warm_up(effect: Effect, robot: Robot) -> str:
    grown = _value(effect, 'strain') * 1e3
    return (
        f'Warm {effect.site} up before welding, or compensate its link while it warms: it grows by '
        f'{number(grown)} mm per m.'
    )


def _drift(effect: Effect, robot: Robot) -> str:
    rate = np.asarray(effect.xyz_rate) * 3.6e6  # type: ignore[attr-defined]
    each = ', '.join(number(float(v)) for v in rate)
    return (
        f'Find what creeps (fixture, tripod, pedestal): ({each}) mm per hour along x, y, z; '
        'measure a fixed point now and then.'
    )


def _vibration(effect: Effect, robot: Robot) -> str:
    return (
        f'Limit the jerk of {effect.site}, or shape its motion for '
        f'{_value(effect, "frequency"):.3g} Hz (damping {_value(effect, "damping"):.2g}); look '
        'for a loose mount.'
    )


def _quantization(effect: Effect, robot: Robot) -> str:
    return (
        f'Read {effect.site} with a finer encoder or more digits: it is rounded to '
        f'{_moved(effect, robot, _value(effect, "step"))}.'
    )


def _measurement_scale(effect: Effect, robot: Robot) -> str:
    return (
        'Have the instrument calibrated, or correct for air temperature: lengths read '
        f'{number(_value(effect, "scale") * 1e3)} mm per m too long.'
    )


def _pedestal_tilt(effect: Effect, robot: Robot) -> str:
    x, y = np.asarray(effect.compliance) * 1e2  # type: ignore[attr-defined]
    return (
        'Stiffen the pedestal or its anchors: under 100 N m it leans by '
        f'{number(float(np.degrees(x)))} deg about x of the base and by '
        f'{number(float(np.degrees(y)))} deg about y; until then compensate the motion.'
    )


def _hose_pull(effect: Effect, robot: Robot) -> str:
    x, y, z = (float(part) for part in np.asarray(effect.force))  # type: ignore[attr-defined]
    return (
        f'Lead the hose package so that it hangs free: it pulls the flange by ({number(x)}, '
        f'{number(y)}, {number(z)}) N along x, y, z of the base, less '
        f'{number(_value(effect, "stiffness"))} N for every metre away from it.'
    )


def _refraction(effect: Effect, robot: Robot) -> str:
    each = ', '.join(number(float(v)) for v in np.asarray(effect.warming))  # type: ignore[attr-defined]
    return (
        'Stir the air along the line of sight, shield it from heat or stand the instrument '
        f'nearer: the air warms by ({each}) K/m along x, y, z and bends it.'
    )


def _setup_step(effect: Effect, robot: Robot) -> str:
    return (
        f'Fasten the set-up: it moved by {_of_the_base(-effect.vector()[:6])} at '
        f'{_value(effect, "time"):.4g} s; measure what came before and after apart.'
    )


def _setup_settling(effect: Effect, robot: Robot) -> str:
    return (
        f'Let the set-up settle before measuring: it started {_of_the_base(effect.vector()[:6])} from '
        'where it ended.'
    )


def _joint_slip(effect: Effect, robot: Robot) -> str:
    at = robot.index(str(effect.site))
    size = _value(effect, 'offset')
    far = f'{size * 1e3:+.3g} mm' if robot.prismatic[at] else radians(size)
    return (
        f'See to the belt, coupling and encoder of {effect.site}: it slipped by {far} at '
        f't = {_value(effect, "time"):.4g}; then master it again.'
    )


def _tool_slip(effect: Effect, robot: Robot) -> str:
    return (
        f'Fasten the tool or the reflector: it moved by '
        f'{frame(effect.vector()[:6], "of the flange", "of the tool")} at '
        f't = {_value(effect, "time"):.4g}; measure its centre point again.'
    )


def _instrument_knock(effect: Effect, robot: Robot) -> str:
    return (
        f'Fasten the instrument and the base: one moved by {_of_the_base(effect.vector()[:6])} at '
        f't = {_value(effect, "time"):.4g}; measure what came before and after apart.'
    )


def _joint_curve(effect: Effect, robot: Robot) -> str:
    return (
        f'Look at {effect.site}: it is off by a curve over the {effect.on} that no known effect '
        'gives.'
    )


def _frame_curve(effect: Effect, robot: Robot) -> str:
    return (
        f'Look at the {effect.at}: it moves over the {effect.on} in a way that no known effect '
        'gives.'
    )


_SENTENCES: dict[str, Sentence] = {
    'joint_offset': _joint_offset,
    'link_length': _row('da', 'a', 'it is off by'),
    'link_offset': _row('dd', 'd', 'it is off by'),
    'link_twist': _row('dalpha', 'alpha', 'the axes are twisted by'),
    'axis_parallelism': _row('dbeta', 'beta', 'the axes are out of parallel by'),
    'base_pose': _base_pose,
    'tool_pose': _tool_pose,
    'root_pose': _root_pose,
    'guide_bend': _guide_bend,
    'guide_tilt': _guide_tilt,
    'gear_ratio': _gear_ratio,
    'gear_ratio_by_direction': _gear_ratio_by_direction,
    'transmission_ripple': _ripple,
    'joint_coupling': _joint_coupling,
    'backlash': _backlash,
    'hysteresis': _hysteresis,
    'friction': _friction,
    'loaded_play': _loaded_play,
    'bearing_tilt': _bearing_tilt,
    'wear': _wear,
    'joint_compliance': _joint_compliance,
    'cartesian_compliance': _cartesian_compliance,
    'payload': _payload,
    'servo_lag': _servo_lag,
    'time_delay': _time_delay,
    'clock_rate': _clock_rate,
    'thermal_growth': _thermal_growth,
    'link_warm_up': _link_warm_up,
    'drift': _drift,
    'vibration': _vibration,
    'quantization': _quantization,
    'measurement_scale': _measurement_scale,
    'pedestal_tilt': _pedestal_tilt,
    'hose_pull': _hose_pull,
    'refraction': _refraction,
    'setup_step': _setup_step,
    'setup_settling': _setup_settling,
    'joint_curve': _joint_curve,
    'frame_curve': _frame_curve,
    'joint_slip': _joint_slip,
    'tool_slip': _tool_slip,
    'instrument_knock': _instrument_knock,
}
