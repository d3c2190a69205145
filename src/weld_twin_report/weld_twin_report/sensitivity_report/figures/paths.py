# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures 6 to 9, along the path, and those beyond the paper: posture, and what was recorded."""

from typing import Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.effects.backlash import Backlash
from weld_twin_core.effects.geometry import BasePose, JointOffset
from weld_twin_core.effects.servo_lag import ServoLag
from weld_twin_core.motion.planned_motion import plan
from weld_twin_core.motion.profiles import Constant
from weld_twin_core.sensitivity import Study, expected_deviation, study_of_plan
from weld_twin_core.sensitivity.local import arc_weights, posture
from weld_twin_core.sensitivity.sweep import DEGREE, Sizes

from ..setting import RECORDED, Setting, recorded_deviations
from .canvas import COLOURS, Drawing, from_zero, label, legend, panels, plain_powers, svg


def standing(setting: Setting) -> Drawing:
    """Draw condition number, manipulability and gain along the seam."""
    study = next(iter(setting.studies.values()))
    stand = posture(study)
    expected = expected_deviation(study, setting.tolerances)
    columns: tuple[tuple[str, str, Array], ...] = (
        ('Condition number, translation', '', stand.condition),
        ('Manipulability', 'm^3', stand.manipulability),
        ('Expected deviation', 'mm', 1e3 * expected),
    )
    figure, axes = panels(3, height=2.7)
    for colour, axis, (title, unit, value) in zip(COLOURS, axes, columns, strict=False):
        axis.plot(1e3 * study.s, value, color=colour)
        axis.set_ylim(0.0, 1.15 * float(value.max()))
        label(axis, title, 'arc length [mm]', unit)
    table = {
        's_m': study.s,
        'condition': stand.condition,
        'manipulability': stand.manipulability,
        'gain_m_per_rad': stand.amplification,
        'expected_m': expected,
    }
    caption = 'How the arm stands along the seam, and the deviation its tolerances lead to expect.'
    return Drawing('figure-posture', caption, table, svg(figure))


def recorded(setting: Setting) -> Drawing | None:
    """Draw the deviations that were measured beside those to be expected; None without any."""
    study = setting.studies[RECORDED]
    off = recorded_deviations(study)
    if off is None:
        return None
    expected = expected_deviation(study, setting.tolerances)
    size = np.linalg.norm(off, axis=1)
    t = study.t - study.t[0]
    figure, (left, right) = panels(2)
    left.fill_between(t, 0.0, 2e3 * expected, color='#e3e6ea', label='twice the expected')
    left.plot(t, 1e3 * expected, color='#666666', lw=1.0, label='expected (rms)')
    left.plot(t, 1e3 * size, color=COLOURS[1], label='recorded')
    left.set_ylim(0.0, None)
    label(left, 'Size of the deviation', 'time [s]', 'D [mm]')
    legend(left)
    names = ('along', 'across', 'normal')
    for colour, name, value in zip(COLOURS, names, off.T, strict=False):
        right.plot(t, 1e3 * value, color=colour, label=name)
    label(right, 'Recorded, by direction', 'time [s]', 'mm')
    legend(right)
    mean = np.sqrt((size**2 * arc_weights(study.s)).sum())
    table = {
        't_s': study.t,
        's_m': study.s,
        'along_m': off[:, 0],
        'across_m': off[:, 1],
        'normal_m': off[:, 2],
        'recorded_m': size,
        'expected_m': expected,
    }
    caption = (
        f'Recorded deviation, {1e3 * mean:.3f} mm rms over the path, beside what the tolerances '
        'lead to expect.'
    )
    return Drawing('figure-recorded', caption, table, svg(figure))


_SIZES = Sizes()
_TURN = 1e-3
"""Turn of the base [rad] that is drawn."""
_LAG = 5e-3
"""Lag of every joint [s] that is drawn."""
_EXAGGERATED = 50.0
"""How much larger than life deviations are drawn."""
_POINTS = 600
"""Points of a line."""
_AXES = ('along', 'across', 'normal to')
_FORMS = {'play': 'play', 'reversal': 'written'}


def _size(deviations: Array) -> Array:
    return np.asarray(np.linalg.norm(deviations, axis=-1))


def _plane(study: Study, positions: Array) -> Array:
    """Return positions (N, 3) along, across and normal of the middle of the seam [m]."""
    middle = study.samples // 2
    return np.asarray((positions - study.nominal.position[0]) @ study.axes[middle].T)


def baseline(setting: Setting) -> Drawing:
    """Draw the path without errors."""
    assert setting.path is not None
    law = Constant()
    rate = setting.points / (setting.path.length / law.speed)
    planned = plan(setting.robot, setting.path, law, rate, torch=setting.torch, fit=True)
    study = study_of_plan(setting.robot, planned)
    off = _size(study.nominal.position - planned.poses[:, :3, 3])
    plane, wanted = _plane(study, study.nominal.position), _plane(study, planned.poses[:, :3, 3])
    table = {
        's_m': planned.s,
        'planned_along_m': wanted[:, 0],
        'planned_across_m': wanted[:, 1],
        'twin_along_m': plane[:, 0],
        'twin_across_m': plane[:, 1],
        'deviation_m': off,
        'd_norm': off / planned.length,
    }
    figure, (left, right) = panels(2)
    left.plot(1e3 * wanted[:, 0], 1e3 * wanted[:, 1], color='#c9ced6', lw=5, label='planned')
    left.plot(1e3 * plane[:, 0], 1e3 * plane[:, 1], color=COLOURS[0], lw=1.3, label='twin')
    left.set_aspect('equal', adjustable='datalim')
    label(left, 'Path from above', 'along [mm]', 'across [mm]')
    legend(left)
    _closure(right, 1e3 * planned.s, off / planned.length)
    caption = (
        'Baseline: without errors the twin follows the plan; '
        f'D_norm = {off.max() / study.length:.1e}.'
    )
    return Drawing('figure-06', caption, table, svg(figure))


def _closure(axis: Any, s: Array, d_norm: Array) -> None:
    """Draw what is left of the plan, beside the precision of the numbers."""
    axis.semilogy(s, np.maximum(d_norm, 1e-17), color=COLOURS[0])
    axis.axhline(np.finfo(float).eps, color='#999999', lw=1, ls=':')
    axis.annotate(
        'double precision',
        (0, np.finfo(float).eps),
        xytext=(2, 3),
        textcoords='offset points',
        color='#666666',
        fontsize=8,
    )
    axis.set_ylim(1e-17, 1e-9)
    plain_powers(axis)
    label(axis, 'D(t) over path length', 'arc length [mm]', 'D(t) / L')


def initialization(setting: Setting) -> Drawing:
    """Draw the path under a displaced and under a turned base."""
    study = next(iter(setting.studies.values()))
    known = setting.known
    shift = BasePose(xyz=np.full(3, _SIZES.initial / np.sqrt(3.0)))
    turn = BasePose(rotvec=[0.0, 0.0, _TURN])
    moved = {name: study.deviations((*known, e)) for name, e in (('shift', shift), ('turn', turn))}
    nominal = _plane(study, study.nominal.position)
    table: dict[str, Array] = {
        's_m': study.s,
        'nominal_along_m': nominal[:, 0],
        'nominal_across_m': nominal[:, 1],
    }
    figure, (left, right) = panels(2)
    left.plot(1e3 * nominal[:, 0], 1e3 * nominal[:, 1], color='#444444', label='nominal')
    names = {
        'shift': f'base displaced by {1e3 * _SIZES.initial:.1f} mm',
        'turn': f'base turned by {1e3 * _TURN:.0f} mrad',
    }
    for colour, (name, off) in zip(COLOURS, moved.items(), strict=False):
        world = np.swapaxes(study.axes, -1, -2) @ off[..., None]
        path = _plane(study, study.nominal.position + _EXAGGERATED * world[..., 0])
        left.plot(1e3 * path[:, 0], 1e3 * path[:, 1], color=colour, label=names[name])
        right.plot(1e3 * study.s, 1e3 * _size(off), color=colour, label=names[name])
        table[f'{name}_along_m'], table[f'{name}_across_m'] = off[:, 0], off[:, 1]
        table[f'{name}_deviation_m'] = _size(off)
    left.set_aspect('equal', adjustable='datalim')
    label(left, f'Path from above, deviation x {_EXAGGERATED:.0f}', 'along [mm]', 'across [mm]')
    legend(left)
    from_zero(right, 1.3)
    label(right, 'Deviation', 'arc length [mm]', 'D [mm]')
    legend(right)
    caption = (
        'Initialization error: a displaced base shifts the path by a constant; a turned base '
        'by its lever arm, which changes along the seam.'
    )
    return Drawing('figure-07', caption, table, svg(figure))


def profiles(setting: Setting) -> Drawing:
    """Draw the deviation of a smooth and an aggressive motion over arc length."""
    joints = setting.robot.joint_names
    errors = {
        'offset': tuple(JointOffset(joint, _SIZES.offset) for joint in joints),
        'lag': tuple(ServoLag(joint, _LAG) for joint in joints),
    }
    studies = {name: setting.planned(name, _POINTS) for name in ('smooth', 'aggressive')}
    figure, axes = panels(2)
    rows: dict[str, list[Array]] = {}
    for colour, (name, study) in zip(COLOURS, studies.items(), strict=False):
        off = {k: _size(study.deviations((*setting.known, *e))) for k, e in errors.items()}
        for axis, key in zip(axes, errors, strict=True):
            wide = name == 'aggressive' and key == 'offset'
            style: dict[str, Any] = {'lw': 4.0, 'alpha': 0.35} if wide else {}
            axis.plot(1e3 * study.s, 1e3 * off[key], color=colour, label=name, **style)
        columns = {
            'motion': np.full(study.samples, name),
            't_s': study.t,
            's_m': study.s,
            **{f'{key}_deviation_m': value for key, value in off.items()},
        }
        for key, value in columns.items():
            rows.setdefault(key, []).append(value)
    titles = (
        f'Every joint off by {_SIZES.offset / DEGREE:.2f} deg',
        f'Every joint lags by {1e3 * _LAG:.0f} ms',
    )
    for axis, title in zip(axes, titles, strict=True):
        from_zero(axis, 1.3)
        label(axis, title, 'arc length [mm]', 'D [mm]')
        legend(axis, ncols=2, loc='upper left')
    caption = (
        'Smooth against aggressive on the same seam: a constant offset deviates alike at equal '
        'arc length, whatever the motion; a lag follows the speed.'
    )
    table = {key: np.concatenate(parts) for key, parts in rows.items()}
    return Drawing('figure-08', caption, table, svg(figure))


def play(setting: Setting) -> Drawing:
    """Draw the deviation of play, and of the paper's formula, around reversals."""
    name = RECORDED if RECORDED in setting.studies else 'aggressive'
    study = setting.studies[name] if name == RECORDED else setting.planned(name, _POINTS)
    joint = _reversing_joint(study)
    stem = setting.robot.joint_names[joint]
    motion = study.recording.joints
    q = motion.q[:, joint] if study.at is None else motion.at(study.at)[0][:, joint]
    vectors = {
        form: study.deviations((*setting.known, Backlash(stem, _SIZES.width, form)))
        for form in ('play', 'reversal')
    }
    axis = int(np.argmax((vectors['play'] ** 2).sum(axis=0)))
    off = {form: vector[:, axis] for form, vector in vectors.items()}
    turned = np.concatenate([[False], np.diff(np.sign(np.diff(q))) != 0.0, [False]])
    table = {
        't_s': study.t,
        's_m': study.s,
        f'{stem}_rad': q,
        'reversal': turned.astype(float),
        **{f'{_FORMS[form]}_{_AXES[axis].split()[0]}_m': value for form, value in off.items()},
        **{f'{_FORMS[form]}_deviation_m': _size(value) for form, value in vectors.items()},
    }
    picture = _play_picture(study, stem, q, off, turned, _AXES[axis])
    caption = (
        'Backlash of one joint: a gap shifts the tool by half of it, to the side the joint came '
        'from, until the next reversal; the formula as written has one sample of deviation at '
        'each reversal and none between.'
    )
    return Drawing('figure-09', caption, table, picture)


def _play_picture(
    study: Study, stem: str, q: Array, off: dict[str, Array], turned: Array, axis: str
) -> str:
    figure, (left, right) = panels(2)
    t = study.t - study.t[0]
    left.plot(t, (q - q[0]) / DEGREE, color='#444444')
    left.plot(t[turned], ((q - q[0]) / DEGREE)[turned], 'o', ms=4, color=COLOURS[1])
    label(left, f'{stem}, reversals marked', 'time [s]', 'angle from start [deg]')
    names = {'play': 'play: a gap that is crossed', 'reversal': "the paper's formula"}
    for colour, (form, value) in zip(COLOURS, off.items(), strict=False):
        right.plot(t, 1e3 * value, color=colour, lw=1.2, label=names[form])
    largest = 1e3 * max(float(np.abs(value).max()) for value in off.values())
    right.set_ylim(-1.1 * largest, 1.5 * largest)
    title = f'Backlash of {_SIZES.width / DEGREE:.2f} deg, deviation {axis} the seam'
    label(right, title, 'time [s]', 'deviation [mm]')
    legend(right, ncols=2, loc='upper left')
    return svg(figure)


def _reversing_joint(study: Study) -> int:
    """Return the joint whose play moves the tool most while it reverses."""
    q = study.recording.joints.q
    turns = (np.diff(np.sign(np.diff(q, axis=0)), axis=0) != 0.0).any(axis=0)
    names = study.robot.joint_names
    moved = [
        float(_size(study.deviations((*study.known, Backlash(name, _SIZES.width)))).mean())
        for name in names
    ]
    return int(np.argmax(np.where(turns, moved, -1.0) if turns.any() else moved))
