# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What groups without a formula span holds what effects with one do there: against the twin."""

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core import Signal, effect_from_mapping
from weld_twin_core.diagnosis.algebra.definite import outside, span_of
from weld_twin_core.diagnosis.algebra.problem import Model, Problem
from weld_twin_core.diagnosis.unseen.groups import GAPS, all_groups

ROBOT = wt.load('ur5')
SPRING = wt.effects.JointCompliance('shoulder_lift_joint', compliance=1e-5)
"""What is known of the arm: a load shows through it."""
ELBOW = {'joint': 'elbow_joint'}
KNOWN = {
    'base_pose': ('base', 'constant', {'xyz': [1e-6, -2e-6, 3e-6], 'rotvec': [0.0, 2e-6, -1e-6]}),
    'tool_pose': ('tool', 'constant', {'xyz': [1e-6, -2e-6, 3e-6], 'rotvec': [0.0, 2e-6, -1e-6]}),
    'drift': ('base', 'time', {'xyz_rate': [1e-7, -2e-7, 3e-7]}),
    'thermal_growth': ('base', 'temperature', {'coefficient': 1e-7}),
    'pedestal_tilt': ('base', 'load', {'compliance': [2e-9, -1e-9]}),
    'payload': ('load', 'load', {'mass': 1e-3, 'com': [0.0, 0.0, 0.0]}),
    'measurement_scale': ('instrument', 'place', {'scale': 1e-6}),
    'link_twist': ('elbow_joint', 'constant', {**ELBOW, 'dalpha': 1e-6}),
    'gear_ratio': ('elbow_joint', 'angle', {**ELBOW, 'scale': 1e-6}),
    'joint_compliance': ('elbow_joint', 'load', {**ELBOW, 'compliance': 1e-8}),
}
AT_REST = {'tool_sag': ('tool', 'load', {'sag': [1e-7 * k for k in range(9)]})}
MOVING = {
    'cartesian_compliance': ('tool', 'load', {'compliance': [1e-8, -2e-8, 3e-8]}),
    'time_delay': ('clock', 'speed', {'delay': 1e-5}),
    'backlash': ('elbow_joint', 'direction', {**ELBOW, 'width': GAPS[2]}),
}
"""By their names where effects are looked for, on what they depend, and their entries. A force on the
tool is known of the arm in motion, and stands for what hangs there."""
ENTRIES = {True: KNOWN | AT_REST, False: KNOWN | MOVING}
CASES = [(static, name) for static, entries in ENTRIES.items() for name in entries]


def recording(q, *, static):
    """Return what is measured of an arm that grows warmer, in motion with a force on its tool."""
    t = 0.04 * np.arange(len(q))
    warm = Signal(t, 20.0 + 6.0 * np.sin(0.3 * t))
    force = None if static else Signal(t, 20.0 * np.cos(np.outer(t, 0.5 + 0.2 * np.arange(6))))
    side = {'temperature': warm, 'wrench': force, 'wrench_frame': 'base'}
    run = wt.Recording('run', wt.JointMotion(t, q, static=static), **side)
    at = t[5:-5]  # what is late begins and ends otherwise
    seen = wt.Twin(ROBOT).poses(run, at)
    return run.with_measured(wt.Measurements(at, seen.position, seen.rotation))


@pytest.fixture(scope='module')
def asked():
    """Return a problem at rest and one of a fast and a slow motion, the model, and all their groups."""
    turns = np.outer(0.04 * np.arange(150), 0.7 + 0.3 * np.arange(6)) + np.arange(6.0)
    home = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
    postures = np.random.default_rng(2).uniform(-1.5, 1.5, (150, 6))
    out = {}
    for static in (True, False):
        each = [postures] if static else [home + 0.5 * np.sin(pace * turns) for pace in (1.0, 0.4)]
        problem = Problem(tuple(recording(q, static=static) for q in each))
        model = Model(ROBOT, (ROBOT.T_world_base,) * len(each), (SPRING,))
        out[static] = problem, model, list(all_groups(problem, model, problem.unit_scale()))
    return out


def moved(problem, model, effect):
    """Return what an effect does to the whitened rows, as the twin has it."""
    one, other = (problem.residuals(each) for each in (model, model.with_found((effect,))))
    scale = problem.unit_scale()
    return problem.whitened(one, scale) - problem.whitened(other, scale)


@pytest.mark.parametrize(('static', 'name'), CASES)
def test_an_effect_lies_in_what_is_tried_at_its_place_and_of_its_dependence(asked, static, name):
    at, on, entry = ENTRIES[static][name]
    problem, model, groups = asked[static]
    row = moved(problem, model, effect_from_mapping({'effect': name, **entry}))
    spans = [span_of(group.columns) for group in groups if (group.at, group.on) == (at, on)]
    assert min(np.linalg.norm(outside(row, span)) for span in spans) < 3e-3 * np.linalg.norm(row)


@pytest.mark.parametrize('static', [True, False])
def test_the_values_of_a_curve_move_the_tool_as_its_columns_say(asked, static):
    problem, model, groups = asked[static]
    rng, curved = np.random.default_rng(3), [group for group in groups if len(group.curves) == 1]
    depends = {group.on for group in curved if group.at == 'elbow_joint'}
    still = {'angle', 'load', 'temperature', 'time'}
    assert depends == (still if static else still | {'direction', 'speed'})
    for group in curved:
        (curve,), values = group.curves, 1e-6 * rng.normal(size=len(group.scales))
        row = moved(problem, model, curve.fit.with_coordinates(values))
        told = (values * group.scales) @ group.columns
        assert np.linalg.norm(told - row) < 3e-3 * np.linalg.norm(row), str(group)


@pytest.mark.parametrize('static', [True, False])
def test_columns_of_a_group_are_of_one_size_and_those_hardly_recorded_stay_small(asked, static):
    for group in asked[static][2]:
        size = np.sqrt((group.columns**2).mean(axis=1))
        assert size.max() == pytest.approx(1.0) and size.min() > 0.0
        assert group.scales.min() >= 0.2 * group.scales.max()
        # Values of curves are held by their columns, those that carry others by what is typical.
        wide = [100.0 * carrier.fit.coordinate_scales() for carrier in group.carriers]
        held = 3.0 * group.scales**2 if group.curves else np.concatenate([[], *wide]) ** -2.0
        np.testing.assert_allclose(group.prior_precision(3.0), held)


@pytest.mark.parametrize('static', [True, False])
def test_growth_about_the_middle_of_the_warmth_takes_one_number(asked, static):
    problem, model, groups = asked[static]
    warmth = np.concatenate([maker.view.temperature for maker in problem.features(model)])
    middle = 0.5 * (warmth.min() + warmth.max())
    entry = {'effect': 'thermal_growth', 'coefficient': 1e-7, 'reference': float(middle)}
    row = moved(problem, model, effect_from_mapping(entry))
    single = [g.columns for g in groups if str(g) == 'temperature at base' and len(g.columns) == 1]
    assert min(np.linalg.norm(outside(row, span_of(c))) for c in single) < 3e-3 * np.linalg.norm(
        row
    )


def test_what_carries_a_late_clock_on_does_here_what_it_does(asked):
    problem, model, groups = asked[False]
    (clock,) = (group for group in groups if group.at == 'clock')
    parts = (
        problem.effect_columns(problem.features(model), c, atoms=False) for c in clock.carriers
    )
    joined = [np.concatenate(blocks) for blocks in zip(*parts, strict=True)]
    span = span_of(problem.whitened(joined, problem.unit_scale()))
    assert np.linalg.norm(outside(clock.columns, span)) < 1e-6 * np.linalg.norm(clock.columns)
