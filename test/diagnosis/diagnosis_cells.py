# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings of the independent plant for the engine, and small problems of known truth."""

from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation
from small_arm import small_arm

from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.rotation import matrix_from_quaternion
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.diagnosis.algebra.fit import design, effect_precision, frame_prior
from weld_twin_core.diagnosis.algebra.problem import Model, Problem, Scale
from weld_twin_core.effects import REGISTRY, effect_from_mapping
from weld_twin_core.recording import JointMotion, Measurements, Recording, Signal
from weld_twin_core.twin.twin import Twin
from weld_twin_lab.plant.exponentials import Command
from weld_twin_lab.plant.plant import run
from weld_twin_lab.plant.tracker import Tracker

SIGMA = 2e-5
SIGMA_TURN = 5e-5
HOME = (0.1, -1.2, 1.5, -1.0, -1.4, 0.3, 0.2)


def all_but(*kinds):
    """Return the kinds of causes that need not be tried where it is about others: fewer are sooner."""
    return sorted(set(REGISTRY) - set(kinds))


def effect(name, **values):
    return effect_from_mapping({'effect': name, **values})


def swing(n, seconds, rng, rate=125.0):
    """Return stamps and a smooth motion of all joints that starts at rest."""
    t = np.arange(0.0, seconds, 1.0 / rate)
    q = np.zeros((t.size, n))
    for i in range(n):
        for _ in range(3):
            pace, phase = 2.0 * np.pi * rng.uniform(0.05, 0.35), rng.uniform(0.0, 2.0 * np.pi)
            q[:, i] += rng.uniform(0.05, 0.25) * np.sin(pace * t + phase)
    ramp = np.clip(t / 2.0, 0.0, 1.0)
    ramp = ramp * ramp * (3.0 - 2.0 * ramp)
    return t, np.array(HOME[:n]) + q * ramp[:, None]


def stations(n, count, rng):
    """Return stamps and poses at rest all over the workspace."""
    return 2.0 * np.arange(count), rng.uniform(-2.0, 2.0, (count, n))


def recorded(
    robot,
    effects,
    seed=1,
    *,
    seconds=8.0,
    static=0,
    orientation=True,
    warm=False,
    richness=1.0,
    name='run',
):
    """Return what the plant records of a robot with effects (mappings of an effects file)."""
    rng = np.random.default_rng(seed)
    t, q = stations(robot.n, static, rng) if static else swing(robot.n, seconds, rng)
    temperature = 20.0 + 8.0 * (1.0 - np.exp(-t / (0.5 * t[-1]))) if warm else None
    command = Command(t, q, static=bool(static), temperature=temperature)
    tracker = Tracker(
        rate=None if static else 50.0,
        sigma=SIGMA,
        sigma_orientation=SIGMA_TURN,
        orientation=orientation,
        drop=0.0 if static else 0.02,
        outlier_share=0.005,
        outlier_size=2e-3,
    )
    seen = run(robot.to_mapping(), effects, command, tracker, rng, richness)
    turned = None if seen.quaternion is None else matrix_from_quaternion(seen.quaternion)
    return Recording(
        name,
        JointMotion(seen.t_joint, seen.q, seen.qd, seen.static),
        Measurements(seen.t_measured, seen.position, turned),
        temperature=None
        if seen.temperature is None
        else Signal(seen.temperature_t, seen.temperature),
    )


@cache
def solved(*effects, robot='', seed=1, exclude=(), align=(), experiment=False, **options):
    """
    Return the diagnosis of a recording with effects, each a tuple (name, key, value, ...).

    The robot is the small arm, or one of the catalogue.
    """
    arm = load(robot) if robot else small_arm()
    true = [
        {'effect': e[0], **dict(zip(e[1::2], map(_plain, e[2::2]), strict=True))} for e in effects
    ]
    recording = recorded(arm, true, seed, **options)
    return diagnose(
        [recording], arm, exclude=exclude, align=frozenset(align), experiment=experiment
    )


def _plain(value):
    return list(value) if isinstance(value, tuple) else value


def sites(diagnosis):
    """Return the sets named, as (effect, joint) pairs."""
    return [{(s.effect, s.joint) for s in group} for group in diagnosis.indistinguishable]


def tiny(true=(), seed=0, *, count=60, align=(), noise=SIGMA, turned=True, static=True):
    """
    Return a small problem that the twin itself made, and the model without effects.

    What is tested here is the algebra of the engine, not its physics.
    """
    rng = np.random.default_rng(seed)
    robot = load('ur5')
    if static:
        t, q = stations(robot.n, count, rng)
        motion = JointMotion(t, q, static=True)
        at = t
    else:
        t, q = swing(robot.n, 6.0, rng)
        motion = JointMotion(t, q)
        at = np.linspace(0.05, t[-1] - 0.05, count)
    poses = Twin(robot, tuple(true)).poses(Recording('tiny', motion), at)
    position = poses.position + rng.normal(scale=noise, size=poses.position.shape)
    turn = shaken(poses.rotation, SIGMA_TURN * noise / SIGMA, rng) if turned else None
    measured = Measurements(at, position, turn)
    problem = Problem((Recording('tiny', motion, measured),), frozenset(align))
    return problem, Model(robot, (robot.T_world_base,))


def shaken(rotation, sigma, rng):
    """Return rotations (M, 3, 3) with white noise about each axis."""
    turns = Rotation.from_rotvec(rng.normal(scale=sigma, size=(len(rotation), 3)))
    return (turns * Rotation.from_matrix(rotation)).as_matrix()


def known_scale(problem, position=SIGMA, orientation=SIGMA_TURN):
    return Scale(position, orientation, tuple(np.ones(m) for m in problem.samples))


def errors_of(problem, model, scale, precision=None):
    """Return the standard errors of the effects' coordinates, by an orthogonal method."""
    columns = design(problem, model, scale)
    own = effect_precision(model) if precision is None else precision
    ridge = np.concatenate([frame_prior(problem, model)[0], own])
    rows = np.concatenate([columns, np.diag(np.sqrt(ridge))], axis=1)
    size = np.maximum(np.linalg.norm(rows, axis=1), 1e-300)
    inverse = np.linalg.pinv((rows / size[:, None]).T, rcond=1e-6)
    return (np.linalg.norm(inverse, axis=1) / size)[len(size) - own.size :]
