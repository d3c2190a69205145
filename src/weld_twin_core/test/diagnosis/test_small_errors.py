# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Many small errors on stations that say little, and how sure an effect is beside all of them."""

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.arm.rotation import rotation_matrix
from weld_twin_core.diagnosis.algebra.problem import Model, Problem
from weld_twin_core.diagnosis.beliefs import Beliefs
from weld_twin_core.diagnosis.frames.aligned import aligned
from weld_twin_core.diagnosis.hypotheses.search import search
from weld_twin_core.diagnosis.many.fitted_together import fitted_together, unseen_rms
from weld_twin_core.diagnosis.many.small_errors import many_small
from weld_twin_core.diagnosis.predicting.allowed import Conditioning, shown_beside_others
from weld_twin_core.diagnosis.predicting.sizes import Prior, Rows
from weld_twin_core.effects import (
    REGISTRY,
    GearRatio,
    JointOffset,
    JointWarmUp,
    LinkTwist,
    MeasurementScale,
    TransmissionRipple,
)

GEOMETRY = ('joint_offset', 'link_length', 'link_offset', 'link_twist', 'axis_parallelism')
MIDDLE = np.array([0.0, -1.2, 1.3, -1.2, -1.5, 0.0])


@pytest.fixture(scope='module')
def robot():
    return wt.load('ur5')


def stations(robot, half, effects, seed=1, count=90):
    """Return stations about a posture, each joint within its own half range [rad]."""
    rng = np.random.default_rng(seed)
    q = MIDDLE + rng.uniform(-1.0, 1.0, (count, 6)) * half
    t = 5.0 * np.arange(count)
    commanded = wt.Recording('stations', wt.JointMotion(t, q, static=True))
    poses = wt.Twin(robot, effects).poses(commanded, t)
    noise = 2e-5 * rng.standard_normal(poses.position.shape)
    return commanded.with_measured(wt.Measurements(t, poses.position + noise))


def fitted(recording, robot, align, *kinds):
    """Return the model of all errors of some kinds, fitted together."""
    problem, start = aligned([recording], robot, align, ())
    rest = [name for name in REGISTRY if name not in kinds]
    return many_small(problem, start, rest, Beliefs(), lambda text: None)[0].model


def off(model, recording):
    """Return the mean distance of a model from a recording, [m]."""
    poses = model.twin(0).poses(recording, recording.measured.t)
    return float(np.linalg.norm(recording.measured.position - poses.position, axis=1).mean())


def test_an_error_of_a_joint_that_stood_still_is_left_to_the_frames(robot):
    """Read off the misfit of a slow gear, it would be wrong by degrees where the joint moves."""
    errors = (LinkTwist('elbow_joint', 1e-3), TransmissionRipple('wrist_1_joint', 3e-4, 7.0, 0.3))
    still = stations(robot, [0.01, 0.9, 0.9, 0.9, 0.9, 0.9], errors)
    model = fitted(still, robot, 'base', *GEOMETRY)
    first = [effect for effect in model.found if effect.site == 'shoulder_pan_joint']
    assert not any(effect.name in ('link_twist', 'joint_offset') for effect in first)
    assert any(effect.site == 'elbow_joint' for effect in model.found)
    # Elsewhere the model is no worse for it: the twist that is there is found.
    moving = stations(robot, [1.5, 0.9, 0.9, 0.9, 0.9, 0.9], errors, seed=2)
    assert off(model, moving) < 0.5e-3


def test_frames_that_are_known_take_no_place(robot):
    """With base and tool known, the same error shows although the joint stands still."""
    still = stations(
        robot, [0.01, 0.9, 0.9, 0.9, 0.9, 0.9], (LinkTwist('shoulder_pan_joint', 1e-3),)
    )
    model = fitted(still, robot, '', *GEOMETRY)
    (twist,) = (e for e in model.found if (e.name, e.site) == ('link_twist', 'shoulder_pan_joint'))
    assert twist.dalpha == pytest.approx(1e-3, abs=1e-4)


def test_a_gear_seen_over_little_travel_has_a_curve(robot):
    """Waves cannot be told apart over 0.8 rad, but the bend they make is there, and predicted."""
    rough = (TransmissionRipple('shoulder_lift_joint', 6e-4, 9.0, 0.4),)
    half = [0.4, 0.4, 0.4, 0.4, 0.4, 0.4]
    seen, other = (stations(robot, half, rough, seed) for seed in (3, 4))
    plain = fitted(seen, robot, 'base', *GEOMETRY, 'transmission_ripple')
    curved = fitted(seen, robot, 'base', *GEOMETRY, 'transmission_ripple', 'joint_curve')
    assert not any(effect.search.orders().size for effect in curved.found)
    assert off(curved, other) < 0.6 * off(plain, other)


def test_a_joint_with_waves_has_no_curve_beside_them(robot):
    """Over a whole turn waves say the same, and carry farther."""
    seen = stations(robot, [1.5, 0.4, 0.4, 0.4, 0.4, 1.5], ())
    model = fitted(seen, robot, 'base', 'transmission_ripple', 'joint_curve')
    sites = {name: {e.site for e in model.found if e.name == name} for name in REGISTRY}
    assert sites['transmission_ripple'] == {'shoulder_pan_joint', 'wrist_3_joint'}
    assert sites['joint_curve'] == {
        'shoulder_lift_joint',
        'elbow_joint',
        'wrist_1_joint',
        'wrist_2_joint',
    }


@pytest.mark.parametrize(
    'name',
    [
        name
        for name, kind in sorted(REGISTRY.items())
        if kind.of == 'joint'
        and kind.traits.cause
        and kind.search.fits(wt.load('ur5'), 'elbow_joint')
    ],
)
def test_a_search_never_makes_an_effect_outside_its_bounds(robot, name):
    """Noise asks for play below nothing as often as for play."""
    recording = stations(robot, [0.5] * 6, (), count=12)
    view = wt.Twin(robot).evaluate(recording, recording.joints.t).view
    for seed in REGISTRY[name].seeds(view, 'elbow_joint'):
        count = len(seed.fit.coordinates())
        for sign in (1.0, -1.0):
            seed.from_atoms(sign * 1e-4 * np.ones(count)).check(robot)


PLANE = 20
"""Stations that are measured before joint 1 is turned on."""
FIRST = 3 * PLANE
"""Stations that are fitted on; the same arm is measured on after a break of two hours."""
BREAK = 7200.0
"""Of two hours [s]."""


def plane_by_plane(robot, seed):
    """Return an arm of many small errors on three planes, and on twenty more after a break."""
    rng = np.random.default_rng(seed)
    count = FIRST + 20 * PLANE
    q = MIDDLE + rng.uniform(-1.0, 1.0, (count, 6)) * [0.02, 0.5, 0.5, 0.5, 0.5, 0.5]
    q[:, 0] += 0.17 * (np.arange(count) // PLANE)
    t = 5.0 * np.arange(count) + BREAK * (np.arange(count) >= FIRST)
    kinds = [REGISTRY[name] for name in GEOMETRY[:4]]
    errors = [kind(j, 3e-4 * rng.standard_normal()) for kind in kinds for j in robot.joint_names]
    errors.append(TransmissionRipple(robot.joint_names[0], 3e-4, 1.0, 0.0))
    commanded = wt.Recording('planes', wt.JointMotion(t, q, static=True))
    measured = wt.Twin(robot, errors).poses(commanded, t).position
    measured = measured + 2e-5 * rng.standard_normal(measured.shape)
    parts = (slice(0, FIRST), slice(FIRST, count))
    return [
        wt.Recording('part', wt.JointMotion(t[k], q[k], static=True)).with_measured(
            wt.Measurements(t[k], measured[k])
        )
        for k in parts
    ]


def test_a_creep_that_stands_in_for_postures_visited_in_order_is_left_out(robot):
    """What joint 1 does as it turns on looks like a creep; the creep would go on over the break."""
    first, rest = plane_by_plane(robot, seed=53)
    problem, start = aligned([first], robot, 'base', ())
    without = [name for name in REGISTRY if name not in (*GEOMETRY, 'drift')]
    found = search(problem, start, without, Beliefs(), lambda text: None)
    few = found.final.model
    many = fitted_together(found, without, Beliefs(), lambda text: None).final.model
    assert 'drift' in {e.name for e in few.found} - {e.name for e in many.found}
    assert off(many, rest) < off(few, rest)


def test_a_zero_that_drifts_is_no_turn_of_the_set_up(robot):
    """A turn about joint 1 is six numbers of the base as well; the joint has it with one."""
    rng = np.random.default_rng(5)
    errors = [
        kind(j, 1e-4 * rng.standard_normal())
        for kind in (REGISTRY[name] for name in GEOMETRY[:4])
        for j in robot.joint_names
    ]
    warm = JointWarmUp(robot.joint_names[0], 8e-4, 150.0)
    problem, start = aligned([stations(robot, 0.6, [*errors, warm])], robot, 'base', ())
    found = start.with_found((warm,))
    model = many_small(problem, found, [], Beliefs(), lambda text: None)[0].model
    (drifting,) = (e for e in model.found if e.name == 'joint_warm_up')
    assert drifting.joint == robot.joint_names[0]
    assert drifting.offset == pytest.approx(8e-4, rel=0.2)
    assert not any(e.traits.of_setup for e in model.found)


def test_one_wrong_scale_is_not_ten_wrong_links(robot):
    """Fitted in its place, links and zeros share it; beside it there is none of them."""
    scaled = stations(robot, 0.9, [MeasurementScale(1e-3)], count=60)
    problem, start = aligned([scaled], robot, '', ())
    without = tuple(
        name for name in REGISTRY if REGISTRY[name].traits.waves or REGISTRY[name].traits.bends
    )
    few = search(problem, start, without, Beliefs(), lambda text: None)
    told = fitted_together(few, without, Beliefs(), lambda text: None)
    assert not told.dense
    assert [effect.name for effect in told.final.model.found] == ['measurement_scale']


def test_a_wrong_gear_ratio_among_many_small_errors_is_no_ripple(robot):
    """Sixty stations bear a ratio for every joint; a ripple stood in for the one that is wrong."""
    rng = np.random.default_rng(7)
    kinds = [REGISTRY[name] for name in GEOMETRY if name != 'axis_parallelism']
    joints = robot.joint_names[1:-1]
    small = [kind(joint, 3e-4 * rng.standard_normal()) for kind in kinds for joint in joints]
    seen = stations(robot, 0.9, [GearRatio('wrist_1_joint', 4e-3), *small], count=60)
    problem, start = aligned([seen], robot, 'base,tool', ())
    few = search(problem, start, (), Beliefs(), lambda text: None)
    many = fitted_together(few, (), Beliefs(), lambda text: None)
    ratios = {e.site: e.scale for e in many.final.model.found if e.name == 'gear_ratio'}
    assert ratios.pop('wrist_1_joint') == pytest.approx(4e-3, abs=5e-4)
    assert max((abs(other) for other in ratios.values()), default=0.0) < 5e-4


@pytest.mark.parametrize('seed', [1, 4, 5])
def test_dozens_of_errors_do_not_take_all_rows_of_ten_stations(robot, seed):
    """Fitted to every row, they would leave no noise, and know the stations that are left out."""
    wrong = JointOffset('elbow_joint', 1e-3)
    seen = stations(robot, 1.5, [wrong], seed=seed, count=10)
    problem, start = aligned([seen], robot, 'base,tool', ())
    few = search(problem, start, (), Beliefs(), lambda text: None)
    told = fitted_together(few, (), Beliefs(), lambda text: None)
    # Noise of 20 µm was measured on every coordinate.
    assert told.scale.position > 0.5 * 2e-5
    assert unseen_rms(told) > 2e-5


def standing(robot, rng, size, real):
    q = np.array([0.3, -1.3, 1.5, -1.2, -1.5, 0.2]) + rng.uniform(-size, size, (40, 6))
    joints = wt.JointMotion(np.arange(40.0), q, static=True)
    poses = wt.Twin(robot, real).poses(wt.Recording('real', joints), joints.t)
    noise = rng.normal(scale=2e-5, size=(2, 40, 3))
    seen = wt.Measurements(
        joints.t, poses.position + noise[0], rotation_matrix(noise[1]) @ poses.rotation
    )
    return wt.Recording('real', joints, seen)


@pytest.mark.parametrize(('size', 'sure'), [(1.2, True), (0.03, False)])
def test_a_zero_is_sure_where_postures_part_it_from_all_other_small_errors(size, sure):
    robot, rng = wt.load('ur5'), np.random.default_rng(3)
    zero = wt.effects.JointOffset('elbow_joint', offset=2e-3)
    problem = Problem((standing(robot, rng, size, [zero]),), frozenset({'base', 'tool'}))
    model = Model(robot, (robot.T_world_base,)).with_found((zero,))
    (shown,) = shown_beside_others(problem, model, problem.unit_scale())
    assert (shown > 3.0) is sure
    assert sure or shown < 1.0


def test_coordinates_beside_each_other_are_those_of_ridge_regression():
    rng = np.random.default_rng(5)
    columns, width = rng.normal(size=(4, 30)), np.array([0.5, 1.0, 2.0, 3.0])
    residual = rng.normal(size=30)
    none = np.zeros(4)
    prior = Prior(none, width, none.astype(int), np.array([False]), np.array([False]))
    mean, covariance = Conditioning(Rows(columns, residual, 1.0), prior, width, 1.0).given()
    inverse = np.linalg.inv(columns @ columns.T + np.diag(width**-2.0))
    assert mean == pytest.approx(inverse @ columns @ residual)
    assert covariance == pytest.approx(inverse)
