# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What several recordings show together, however they differ, and in whichever order they come."""

import numpy as np
import pytest
from small_arm import small_arm

import weld_twin_core as wt
from weld_twin_core import Beliefs, JointMotion, Measurements, Recording, Signal, Twin
from weld_twin_core.diagnosis.algebra.problem import Model, Problem
from weld_twin_core.diagnosis.algebra.workspace import Role
from weld_twin_core.diagnosis.hypotheses.library import build
from weld_twin_core.diagnosis.many.small_errors import _everything
from weld_twin_core.diagnosis.result import Site
from weld_twin_core.diagnosis.soundness.richness import with_temperatures
from weld_twin_core.diagnosis.unseen.folds import posture_regions
from weld_twin_core.diagnosis.unseen.groups import all_groups
from weld_twin_core.effects import REGISTRY, Backlash, GearRatio, LinkLength

ELBOW = small_arm().joint_names[2]


def swing(seconds, elbow=0.6, rate=50.0, *, warm=False, offset=0.0):
    """Return a recording of an arm without errors whose joints swing, the elbow as far as told."""
    t = np.arange(0.0, seconds, 1.0 / rate)
    far = np.array([0.6, 0.6, elbow])
    q = [0.1, -1.2, 1.5 + offset] + far * np.sin(np.outer(t, [0.4, 0.7, 1.0]))
    return posed(q, t, temperature=Signal(t, 20.0 + t) if warm else None)


def posed(q, t, **streams):
    bare = Recording(f'{len(t)} samples', JointMotion(t, q), **streams)
    poses = Twin(small_arm()).poses(bare, t)
    return bare.with_measured(Measurements(t, poses.position, poses.rotation))


def together(*recordings):
    """Return the problem of recordings, and the arm without errors."""
    arm = small_arm()
    return Problem(recordings), Model(arm, (arm.T_world_base,) * len(recordings))


def groups(*recordings):
    problem, model = together(*recordings)
    return {str(group) for group in all_groups(problem, model, problem.unit_scale())}


def test_few_stations_beside_a_long_recording_stay_whole():
    few, long = swing(0.4), swing(400.0)
    thin = Problem((few, long)).thinned(3000)
    assert thin.samples == (20, 480)
    assert Problem((long, few)).thinned(3000).samples == (480, 20)


@pytest.mark.parametrize('most', [600, 3000, 6000])
def test_a_thinned_problem_has_as_many_rows_as_wanted_and_the_ends_of_every_recording(most):
    recordings = [swing(seconds) for seconds in (2.0, 20.0, 5.0, 60.0)]
    thin = Problem(tuple(recordings)).thinned(most)
    assert thin.size == pytest.approx(most, abs=6 * len(recordings))
    for whole, part in zip(recordings, thin.recordings, strict=True):
        np.testing.assert_array_equal(part.seen.t[[0, -1]], whole.seen.t[[0, -1]])
    counts = dict(zip((2.0, 20.0, 5.0, 60.0), thin.samples, strict=True))
    assert [counts[k] for k in sorted(counts)] == sorted(thin.samples)


def test_waves_of_a_joint_are_looked_for_though_another_recording_moved_it_more_to_and_fro():
    often, wide = swing(60.0, elbow=0.1, rate=20.0), swing(7.0, elbow=1.2, rate=60.0)
    found = _everything(*together(often, wide), (), Beliefs())
    assert any(e.name == 'transmission_ripple' and e.site == ELBOW for e in found)


@pytest.mark.parametrize('rate', [2.0, 5.0])
def test_waves_of_all_joints_take_no_more_than_half_of_what_was_measured(rate):
    problem, model = together(swing(12.0, elbow=1.2, rate=rate))
    waved = [e for e in _everything(problem, model, (), Beliefs()) if e.search.orders().size]
    assert len(waved) == 3
    assert 0 < sum(2 * e.search.orders().size for e in waved) <= problem.size / 2


def test_a_frame_without_a_formula_is_off_in_six_ways():
    problem, model = together(swing(10.0))
    every = list(all_groups(problem, model, problem.unit_scale()))
    for frame in ('base', 'tool'):
        (own,) = [group for group in every if (group.at, group.on) == (frame, 'constant')]
        assert len(own.columns) == 6


@pytest.mark.parametrize('seconds', [0.02, 0.1, 0.16])
def test_a_recording_of_a_few_samples_takes_no_place_of_a_fault_from_the_others(seconds):
    assert groups(swing(20.0), swing(seconds)) >= groups(swing(20.0))


def test_an_arm_that_stands_in_one_recording_may_lean_under_its_load_in_the_others():
    moved = swing(20.0)
    still = posed(np.repeat(moved.joints.q[:1], 100, axis=0), moved.joints.t[:100])
    assert groups(moved, still) >= groups(moved)


@pytest.mark.parametrize('turned', [1, -1])
def test_recordings_of_which_one_has_no_temperature_are_explained_without(turned):
    warm, bare = swing(10.0, warm=True), swing(12.0)
    given = (warm, bare)[::turned]
    kept = with_temperatures(given, ())
    problem, model = together(*kept)
    units = build(problem, model, problem.unit_scale()).units
    (growth,) = [unit for unit in units if unit.site.effect == 'thermal_growth']
    assert {seed.on for seed in growth.seeds} == {'time'}
    (note,) = kept[given.index(warm)].notes
    assert bare.name in note
    assert with_temperatures([warm], [bare])[0].temperature is None
    assert with_temperatures([warm], [warm])[0] is warm


@pytest.mark.parametrize('other', [0.0, 0.7])
def test_a_tool_that_each_seam_holds_alike_is_looked_at_for_its_sag_where_seams_differ(other):
    t = np.arange(0.0, 4.0, 0.1)
    about = 0.4 * np.sin(t)  # of the upright axis alone
    seams = [posed(np.stack([about, 0 * t - 1.2, 0 * t + q], -1), t) for q in (1.5, 1.5 + other)]
    problem, model = together(*seams)
    shelf = build(problem, model, problem.unit_scale())
    reason = 'the tool does not turn against gravity'
    assert shelf.absent.get('tool_sag') == (None if other else reason)
    assert any(unit.site.effect == 'tool_sag' for unit in shelf.units) is bool(other)


@pytest.mark.parametrize('lift', [-1.1, -2.0])
def test_play_that_the_load_turns_over_is_looked_for_where_recordings_lie_on_either_side(lift):
    t = np.arange(0.0, 4.0, 0.1)
    seams = [posed(np.stack([0 * t, 0.2 * np.sin(t) + q, 0 * t], -1), t) for q in (-1.1, lift)]
    problem, model = together(*seams)
    shelf = build(problem, model, problem.unit_scale())
    site = Site('loaded_play', small_arm().joint_names[1])
    (role,) = [unit.role for unit in shelf.units if unit.site == site]
    assert role is (Role.ALIKE if lift == -1.1 else Role.FOUND)


ROBOT = wt.load('abb_irb120')
SIZES = (40, 61, 23)
KINDS = ('backlash', 'gear_ratio', 'link_length', 'joint_offset')
NAMES = ROBOT.joint_names
CAUSES = (Backlash(NAMES[0], 6e-4), GearRatio(NAMES[4], 1e-3), LinkLength(NAMES[1], 4e-4))


def measured(name, t, q, *, static, rng):
    """Return a recording of the arm with its causes."""
    commanded = wt.Recording(name, wt.JointMotion(t, q, static=static))
    seen = wt.Twin(ROBOT, CAUSES).poses(commanded, t).position
    noise = 2e-5 * rng.standard_normal(seen.shape)
    return commanded.with_measured(wt.Measurements(t, seen + noise))


@pytest.fixture(scope='module')
def recordings():
    """Return stations of an arm in three visits of its own postures, some visited each time."""
    rng = np.random.default_rng(4)
    same, out = rng.uniform(-0.6, 0.6, (8, 6)), []
    for k, count in enumerate(SIZES):
        q = np.concatenate([same, 0.2 * k + rng.uniform(-0.5, 0.5, (count - 8, 6))])
        out.append(measured(f'visit {k}', 5.0 * np.arange(count), q, static=True, rng=rng))
    return out


@pytest.fixture(scope='module')
def swung():
    """Return a recording of the arm in motion."""
    t = np.arange(0.0, 8.0, 0.04)
    q = 0.4 * np.sin(np.outer(t, 0.5 + 0.2 * np.arange(6)) + np.arange(6))
    return measured('swing', t, q, static=False, rng=np.random.default_rng(5))


@pytest.mark.parametrize('order', [(2, 1, 0), (1, 2, 0)])
def test_parts_left_out_are_the_same_in_any_order(recordings, order):
    def parts(labels, given):
        ends = 3 * np.cumsum([SIZES[k] for k in given])[:-1]
        return dict(zip(given, np.split(labels, ends), strict=True))

    first, other = (Problem(tuple(recordings[k] for k in given)) for given in ((0, 1, 2), order))
    for labels in (lambda p: p.block_labels(8), posture_regions):
        one, two = parts(labels(first), (0, 1, 2)), parts(labels(other), order)
        for k in range(3):
            np.testing.assert_array_equal(one[k], two[k])


def test_a_diagnosis_says_the_same_in_any_order(recordings, swung):
    every = [*recordings[:2], swung]
    rest = [name for name in REGISTRY if name not in KINDS]
    one, other = (
        wt.diagnose(given, ROBOT, align='tool', exclude=rest, experiment=False).as_dict()[
            'verdict'
        ]
        for given in (every, every[::-1])
    )
    assert [c['name'] for c in one['causes']]
    assert one['indistinguishable'] == other['indistinguishable']
    assert other['confidence'] == pytest.approx(one['confidence'], abs=1e-6)
    for mine, yours in zip(one['causes'], other['causes'], strict=True):
        assert yours['probability'] == pytest.approx(mine['probability'], abs=1e-6)
        assert [i['effect'] for i in yours['name']] == [i['effect'] for i in mine['name']]
