# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Made-up diagnoses for the report: each once, its pictures from the twin, its words given."""

from dataclasses import replace
from functools import cache

import numpy as np

from weld_twin_core.arm.catalog import load
from weld_twin_core.diagnosis.algebra.problem import Model
from weld_twin_core.diagnosis.result import (
    Candidate,
    Cause,
    Check,
    Contributions,
    Diagnosis,
    Found,
    Gap,
    Shares,
    Shrink,
    Site,
    Traces,
    Unexplained,
    Where,
)
from weld_twin_core.effects import effect_from_mapping
from weld_twin_core.motion.paths import default_seam
from weld_twin_core.motion.planned_motion import plan
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_core.twin.twin import Twin

REGRESSORS = ('constant', 'angle, low order', 'angle, high order', 'reversal', 'speed')
REGRESSORS += ('acceleration', 'load', 'temperature', 'time')
NOISE = 2e-5
CHECKS = (
    Check('units', 'ok', 'Joint angles are in rad and lengths in m.'),
    Check('clocks', 'note', 'The two clocks agree within 0.4 ms.'),
    Check('outliers', 'warning', '3 of 1234 measurements lie far off and count little.'),
)


def rms(parts):
    return float(np.sqrt(np.mean(np.concatenate([(p**2).sum(axis=1) for p in parts]))))


def moving(robot, kind='spline', profile='aggressive', name='seam_run'):
    motion = plan(robot, default_seam(robot, kind), profile, fit=True).motion
    return Recording(name, motion, epoch_ns=1_750_000_000_000_000_000)


def stations(robot, count=200, seed=1):
    rng = np.random.default_rng(seed)
    q = rng.uniform(-1.2, 1.2, (count, robot.n))
    return Recording('stations', JointMotion(np.arange(count, dtype=float), q, static=True))


def measured(robot, effects, recording, seed=0):
    rng = np.random.default_rng(seed)
    t = recording.joints.t
    if not recording.joints.static:
        t = t[1:-1:2]
    poses = Twin(robot, effects).poses(recording, t)
    noisy = poses.position + rng.normal(scale=NOISE, size=poses.position.shape)
    return recording.with_measured(Measurements(t, noisy, poses.rotation))


def traces(robot, believed, recordings):
    out = {'t': [], 'measured': [], 'before': [], 'after': []}
    for r in recordings:
        out['t'].append(r.measured.t)
        out['measured'].append(r.measured.position)
        for key, effects in (('before', ()), ('after', believed)):
            poses = Twin(robot, effects).poses(r, r.measured.t)
            out[key].append(r.measured.position - poses.position)
    return Traces(*(tuple(out[key]) for key in ('t', 'measured', 'before', 'after')))


def diagnosis(status, robot, true, believed, recordings, **changes):
    """Return a diagnosis whose figures follow from what is believed against what is true."""
    effects = tuple(effect_from_mapping(e) for e in true)
    found = tuple(effect_from_mapping(e) for e in believed)
    recordings = tuple(measured(robot, effects, r, k) for k, r in enumerate(recordings))
    lines = traces(robot, found, recordings)
    before, after = rms(lines.before), rms(lines.after)
    sites = [(f'{e.name} of {e.site}' if e.site else e.name) for e in found]
    falls = np.linspace(before, after, len(found) + 1)[1:]
    told = _causes(found, before, after)
    out = Diagnosis(
        causes=told,
        shares=Shares(0.0, (after / before) ** 2),
        contributions=_contributions(robot, found, recordings, lines) if told else None,
        gap=Gap(before, 0.9 * before, 2.0 * before, 4e-4, 1234, np.sqrt(3) * NOISE),
        where=_where(robot, found, lines, recordings),
        status=status,
        effects=tuple(Found(e, _errors(e)) for e in found),
        confidence=0.97,
        indistinguishable=tuple((Site(e.name, e.site),) for e in found),
        reasons=(),
        candidates=_candidates(robot, found, before, after),
        shrink=Shrink(
            before,
            after,
            after / before,
            (0.9 * after / before, 1.2 * after / before),
            'blocked cross-validation',
            tuple(zip(sites, falls.tolist(), strict=True)),
            tuple((s, 0.8 * before) for s in sites),
        ),
        unexplained=Unexplained(after, False),
        next_experiment=None,
        actions=(),
        checks=CHECKS,
        model=Model(robot, tuple(robot.T_world_base for _ in recordings), (), found),
        traces=lines,
        absent={'cartesian_compliance': 'no tool wrench was recorded'},
        recordings=recordings,
    )
    return replace(out, **changes)


def _causes(found, before, after):
    """Return a cause for each effect; equal shares of what they explain together."""
    share = (1.0 - (after / before) ** 2) / max(len(found), 1)
    return tuple(
        Cause(
            place=((e.at, 0.95),),
            dependence=((e.on, 0.96),),
            name=((Site(e.name, e.site), 0.9),),
            share=share,
            share_ci90=(max(share - 0.03, 0.0), min(share + 0.03, 1.0)),
            members=(k,),
        )
        for k, e in enumerate(found)
    )


def _contributions(robot, found, recordings, lines):
    """Return what the twin loses with each effect; what is left is the residual after."""
    parts = []
    for r in recordings:
        whole = Twin(robot, found).poses(r, r.measured.t).position
        rests = (Twin(robot, found[:k] + found[k + 1 :]) for k in range(len(found)))
        parts.append(np.array([whole - rest.poses(r, r.measured.t).position for rest in rests]))
    return Contributions(lines.after, tuple(parts))


def _errors(effect):
    """Return standard errors of its parameters: three per cent of each."""
    values = effect.to_mapping().items()
    return {k: _error(v) for k, v in values if k not in ('effect', 'joint', 'order', 'over')}


def _error(value):
    return [0.03 * abs(v) for v in value] if isinstance(value, list) else 0.03 * abs(value)


def _where(robot, found, lines, recordings):
    rng = np.random.default_rng(5)
    shares = 0.08 * rng.random((robot.n, len(REGRESSORS)))
    sites = [e.site for e in found if e.site]
    for site in sites[:2]:
        shares[robot.index(site), 3] = 0.9
        shares[robot.index(site), 0] = 0.4
    largest = zip(robot.joint_names, shares.max(axis=1).tolist(), strict=True)
    joints = sorted(largest, key=lambda item: -item[1])
    path = []
    for r, b in zip(recordings, lines.before, strict=True):
        for index in np.array_split(np.arange(len(b)), max(1, 12 // len(recordings))):
            t = r.measured.t[index]
            path.append((float(t[0]), float(t[-1]), 0.1, rms([b[index]])))
    regimes = {'static': 0.1, 'reversal': 0.88, 'speed': 0.02, 'acceleration': 0.0}
    regimes |= {'load': 0.03, 'temperature': 0.0, 'time': 0.001}
    direction = {'along_m': 3e-4, 'across_m': 1.1e-4, 'normal_m': 4e-5}
    return Where(
        tuple(joints),
        regimes,
        tuple(path),
        direction,
        REGRESSORS,
        tuple(map(tuple, shares.tolist())),
    )


def _candidates(robot, found, before, after):
    out = [
        Candidate(Site(e.name, e.site), 0.9 / (k + 1), after, 1 - after / before)
        for k, e in enumerate(found[:3])
    ]
    last = Site('joint_compliance', robot.joint_names[1])
    return (*out, Candidate(last, 0.004, 0.7 * before, 0.3))


@cache
def backlash():
    robot = load('ur5')
    effect = {'effect': 'backlash', 'joint': 'elbow_joint', 'width': 1.2e-3}
    return diagnosis(
        'identified',
        robot,
        [effect],
        [effect],
        [moving(robot), moving(robot, 'weave')],
        actions=('Service the gear of elbow_joint: its play of 0.069 deg is the gap.',),
    )


@cache
def ambiguous():
    robot = load('kuka_kr6_r900')
    first = robot.joint_names[0]
    true = [{'effect': 'joint_offset', 'joint': first, 'offset': 8e-4}]
    pair = (Site('joint_offset', first), Site('base_pose', None))
    return diagnosis(
        'ambiguous',
        robot,
        true,
        true,
        [moving(robot, 'line', 'smooth')],
        confidence=0.93,
        indistinguishable=(pair,),
        reasons=(
            f'joint_offset of {first}, base_pose move the tool alike on these data: their '
            'fits differ by less than the noise',
        ),
        next_experiment={
            'why': 'Only the base can be surveyed apart from the arm.',
            'measure': 'three reference points on the pedestal',
            'stations': 3,
        },
        actions=(f'Survey the base, then re-master {first} if it is not at fault.',),
    )


@cache
def unknown():
    robot = load('abb_irb120')
    j = robot.joint_names
    true = [
        {'effect': 'vibration', 'joint': j[0], 'frequency': 6.0, 'damping': 0.04, 'gain': 0.5},
        {'effect': 'backlash', 'joint': j[2], 'width': 2e-3},
    ]
    return diagnosis(
        'unknown',
        robot,
        true,
        [],
        [moving(robot, 'polyline')],
        confidence=0.9,
        unexplained=Unexplained(
            4e-4, True, (f'the speed and acceleration of {j[0]}', 'the place in the workspace')
        ),
    )


@cache
def calibration():
    robot = load('fanuc_m10ia')
    rng = np.random.default_rng(7)
    families = (
        ('joint_offset', 'offset', 8e-4),
        ('link_length', 'da', 3e-4),
        ('link_offset', 'dd', 3e-4),
        ('link_twist', 'dalpha', 4e-4),
    )
    true = [
        {'effect': family, 'joint': joint, key: float(rng.normal(scale=size))}
        for family, key, size in families
        for joint in robot.joint_names
    ]
    waves = {'amplitude': [2e-4, 1e-4], 'order': [1.0, 40.0], 'phase': [0.3, -1.0]}
    true.append({'effect': 'transmission_ripple', 'joint': robot.joint_names[1], **waves})
    true.append({'effect': 'tool_pose', 'xyz': [2e-4, -1e-4, 5e-4], 'rotvec': [0, 0, 1e-3]})
    return diagnosis('identified', robot, true, true, [stations(robot)])


@cache
def circle():
    robot = load('kuka_kr6_r900')
    effects = [
        {'effect': 'backlash', 'joint': 'joint_a3', 'width': 8e-4},
        {'effect': 'joint_offset', 'joint': 'joint_a2', 'offset': 3e-4},
        {'effect': 'servo_lag', 'joint': 'joint_a1', 'time_constant': 4e-3},
    ]
    return diagnosis('identified', robot, effects, effects, [moving(robot, 'circle')])


@cache
def nothing():
    robot = load('franka_panda')
    return diagnosis('none', robot, [], [], [moving(robot, 'circle', 'smooth')])


MADE = (backlash, ambiguous, unknown, calibration, circle, nothing)
ALL = {make.__name__: make for make in MADE}
