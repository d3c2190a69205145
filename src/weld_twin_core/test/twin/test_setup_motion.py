# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Set-ups carried on to other recordings, and ranges of what machines can have."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from weld_twin_core import (
    Effect,
    JointMotion,
    Measurements,
    ModelError,
    Parameter,
    Recording,
    Robot,
    Stage,
    Twin,
    catalog,
    effect_from_mapping,
    effects_from_list,
    register,
)
from weld_twin_core.diagnosis.algebra.problem import Model, Problem, usable
from weld_twin_core.diagnosis.unseen.held_out_shrink import _for_bag
from weld_twin_core.effects import REGISTRY, Plausible, ToolPose, ToolSlip
from weld_twin_core.effects.dated import JointSlip, in_use, of_the_robot, seen_from
from weld_twin_core.effects.loads import mass_range
from weld_twin_core.effects.plausible import beyond, plausible, ranges, spreads, table

SECOND = 1_000_000_000
ROBOT = catalog.load('ur10')
EFFECTS = tuple(
    effect_from_mapping(e)
    for e in (
        {'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': 1e-3},
        {'effect': 'setup_settling', 'xyz': [1e-3, 0.0, 0.0], 'time_constant': 40.0, 'start': 0.0},
        {'effect': 'setup_step', 'xyz': [0.0, 5e-4, 0.0], 'time': 60.5},
    )
)


def stations(first, count):
    """Return stations of one arm pose, at seconds after the epoch of the whole recording."""
    q = np.tile([0.1, -1.2, 1.4, -0.3, 1.5, 0.2], (count, 1))
    motion = JointMotion(np.arange(float(count)), q, static=True)
    return Recording('part', motion, epoch_ns=(1000 + first) * SECOND)


def positions(effects, recording):
    return Twin(ROBOT, effects).poses(recording).position


@pytest.mark.parametrize('first', [0, 30, 61])
def test_a_part_of_the_recording_sees_the_set_up_as_it_stood_then(first):
    whole = stations(0, 100)
    part = stations(first, 100 - first)
    carried = seen_from(EFFECTS, whole.epoch_ns, whole.span_ns, part)
    np.testing.assert_allclose(
        positions(carried, part), positions(EFFECTS, whole)[first:], atol=1e-15
    )


@pytest.mark.parametrize('first', [-500, 5000])
def test_another_day_sees_the_arm_alone(first):
    whole, other = stations(0, 100), stations(first, 20)
    carried = seen_from(EFFECTS, whole.epoch_ns, whole.span_ns, other)
    assert carried == of_the_robot(EFFECTS) == EFFECTS[:1]


@pytest.mark.parametrize('slipped', ['before', 'after', 'in it'])
@pytest.mark.parametrize('epoch', [0, 5000])
def test_a_held_out_recording_without_a_date_has_the_slip_where_it_was(slipped, epoch):
    """Tables and simulated time begin at zero again, whenever they were recorded."""
    slip = ToolSlip(xyz=[1e-3, 0.0, 0.0], time=50.0)
    there = {'before': ToolPose(slip.xyz), 'after': ToolPose(), 'in it': replace(slip, time=10.0)}
    # A part of the one diagnosed has the slip at its own stamps; nothing tells it of another.
    first = 40 if slipped == 'in it' else epoch
    other = stations(first, 20)
    seen = Twin(ROBOT, [there[slipped]]).poses(other)
    measured = other.with_measured(Measurements(other.joints.t, seen.position))
    problem = Problem((usable(measured),), frozenset())
    model = Model(ROBOT, (ROBOT.T_world_base,), found=(slip,))
    own = _for_bag(problem, model, (stations(0, 100),), 1.0)
    assert np.abs(problem.residuals(own)[0][:3]).max() < 1e-9


DATE = 1_700_000_000


@pytest.mark.parametrize(
    ('epoch', 'first', 'same', 'slipped', 'told'),
    [
        # Tables and simulated time: both begin near zero, and one began after the other all the same.
        (0, 0, False, 20 * [True], 'recorded after that, for stamps without a date'),
        (0, 0, True, 10 * [False] + 10 * [True], ''),
        (DATE, DATE + 3, False, 7 * [False] + 13 * [True], ''),
        (DATE, DATE + 5000, False, 20 * [True], 'recorded after that.'),
        (DATE, DATE - 5000, False, 20 * [False], 'recorded before that.'),
        (DATE, 0, False, 20 * [True], 'recorded after that, for stamps without a date'),
    ],
)
def test_a_tool_that_slipped_stays_slipped(epoch, first, same, slipped, told):
    slip = effect_from_mapping({'effect': 'tool_slip', 'xyz': [1e-3, 0.0, 0.0], 'time': 10.0})
    other = stations(first - 1000, 20)
    span = tuple(epoch * SECOND + end * SECOND for end in (0, 100))
    carried, said = in_use([slip], epoch * SECOND, span, other, same=same)
    moved = np.linalg.norm(positions(carried, other) - positions((), other), axis=1)
    np.testing.assert_array_equal(moved > 5e-4, slipped)
    assert [told in sentence for sentence in said] == ([True] if told else [])


@pytest.mark.parametrize(('lasted', 'told'), [(19, False), (10, True)])
def test_growing_longer_than_anybody_saw_is_told(lasted, told):
    drift = effect_from_mapping({'effect': 'drift', 'xyz_rate': [1e-6, 0.0, 0.0]})
    _, said = in_use([drift], 0, (0, lasted * SECOND), stations(0, 20), same=False)
    assert [f'lasted {lasted} s' in s and 'lasts 19 s' in s for s in said] == [True] * told


UR5 = catalog.load('ur5')
FREE = {('transmission_ripple', 'order'), ('transmission_ripple', 'phase')}
"""Any order and any phase may be; which orders can be told is a matter of the recording."""
NOT_OF_A_MACHINE = {('measurement_noise', 'sigma')}


def parameters():
    bundled = [k for k in REGISTRY.values() if k.__module__.startswith('weld_twin')]
    return {(kind.name, p.name) for kind in bundled if kind.traits.cause for p in kind.parameters}


def test_every_parameter_of_every_cause_has_a_range_and_a_source():
    curves = {key for key in parameters() if 'curve' in key[0]}
    assert parameters() - FREE - NOT_OF_A_MACHINE - curves <= set(table())
    assert all(each.low < each.high and each.sd > 0.0 for each in table().values())
    assert all(len(each.source) >= 15 for each in table().values())


def test_a_robot_of_four_kilograms_payload_cannot_lack_ten():
    low, high = mass_range(UR5)
    assert -2.0 < low < 0.0 < 5.0 < high < 12.0
    effects = effects_from_list(
        [{'effect': 'payload', 'mass': -10.5, 'com': [0.0, 0.0, 0.0]}], UR5
    )
    assert [(name, value) for name, value, _ in beyond(UR5, effects[0])] == [('mass', -10.5)]


def test_joints_of_an_arm_on_a_desk_may_be_softer_than_those_of_a_cobot():
    usual = plausible(UR5, 'joint_compliance', 'compliance', 'elbow_joint')
    assert (usual.sd, usual.low, usual.high) == (3e-5, -1e-5, 3e-4)
    desk = UR5.to_mapping()
    for link in desk['links']:
        link['mass'] *= 0.05
    for joint in desk['joints']:
        joint['a'], joint['d'] = 0.4 * joint['a'], 0.4 * joint['d']
    small = Robot.from_mapping(desk)
    soft = plausible(small, 'joint_compliance', 'compliance', 'elbow_joint')
    assert 3e-3 < soft.high < 3e-2
    assert soft.high / soft.sd == pytest.approx(usual.high / usual.sd)
    spring = [{'effect': 'joint_compliance', 'joint': 'elbow_joint', 'compliance': 2e-3}]
    assert not beyond(small, effects_from_list(spring, small)[0])
    bare = Robot.from_mapping({key: own for key, own in desk.items() if key != 'links'})
    for other in (bare, replace(UR5, gravity=np.zeros(3)), replace(UR5, mass=np.zeros(6))):
        assert plausible(other, 'joint_compliance', 'compliance', 'elbow_joint').high == usual.high


@pytest.mark.parametrize(
    'entry',
    [
        {'effect': 'thermal_growth', 'coefficient': 1e-4},
        {'effect': 'transmission_ripple', 'joint': 'elbow_joint', 'amplitude': 7e-3, 'order': 360},
        {'effect': 'link_offset', 'joint': 'elbow_joint', 'dd': -0.56},
        {'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': 3.14},
        {'effect': 'joint_compliance', 'joint': 'elbow_joint', 'compliance': -1e-4},
    ],
)
def test_what_was_once_named_and_no_machine_has(entry):
    assert beyond(UR5, effects_from_list([entry], UR5)[0])


def test_what_machines_have_is_not_beyond():
    small = [
        {'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': 3.5e-3},
        {'effect': 'link_twist', 'joint': 'elbow_joint', 'dalpha': 3.9e-3},
        {'effect': 'backlash', 'joint': 'elbow_joint', 'width': 4.4e-4},
        {'effect': 'thermal_growth', 'coefficient': 2.36e-5},
    ]
    assert not any(beyond(UR5, effect) for effect in effects_from_list(small, UR5))


def test_spreads_and_ranges_go_with_the_fit_coordinates():
    robot = UR5
    for kind in REGISTRY.values():
        if not kind.__module__.startswith('weld_twin') or 'curve' in kind.name:
            continue
        values = {'joint': 'elbow_joint'} if kind.of in ('joint', 'link') else {}
        effect = kind(**values)
        low, high = ranges(robot, effect)
        assert spreads(robot, effect).shape == low.shape == effect.fit.coordinates().shape
        assert (low <= effect.fit.coordinates()).all() and (effect.fit.coordinates() <= high).all()


def test_a_joint_that_slides_has_metres():
    axis = Robot.from_mapping({'joints': [{'name': 'z', 'type': 'prismatic'}]})
    assert plausible(axis, 'backlash', 'width', 'z').high <= 5e-3
    assert plausible(axis, 'backlash', 'width', 'z').high < table()['backlash', 'width'].high


def test_a_robot_file_narrows_and_keeps_what_it_says():
    content = UR5.to_mapping()
    content['plausible'] = {'backlash': {'width': {'sd': 1e-5, 'high': 1e-4}}}
    robot = Robot.from_mapping(content)
    found = plausible(robot, 'backlash', 'width', 'elbow_joint')
    assert (found.sd, found.low, found.high, found.source) == (1e-5, 0.0, 1e-4, 'the robot file')
    again = Robot.from_mapping(robot.to_mapping())
    assert again.plausible == robot.plausible
    assert np.isclose(plausible(again, 'gear_ratio', 'scale', 'elbow_joint').sd, 1e-3)


@pytest.mark.parametrize(
    ('limits', 'said'),
    [({'sd': 0.0}, 'above zero'), ({'low': 1.0, 'high': 0.0}, 'below high'), ({'x': 1}, 'x')],
)
def test_a_robot_file_that_makes_no_sense_is_refused(limits, said):
    content = UR5.to_mapping() | {'plausible': {'backlash': {'width': limits}}}
    with pytest.raises(ModelError, match=said):
        Robot.from_mapping(content)


def test_an_effect_of_ones_own_says_how_large_it_may_be():
    @register
    @dataclass(frozen=True, eq=False)
    class Sag(Effect):
        joint: str
        sag: float = 0.0
        name, of, stage = 'own_sag', 'joint', Stage.JOINT
        parameters = (
            Parameter(
                'sag',
                'rad',
                typical=1e-4,
                range=Plausible(1e-4, -1e-5, 1e-3, 'derived: it hangs down'),
                sliding=Plausible(1e-5, 0.0, 1e-4, 'derived: it hangs down'),
            ),
        )

        def displace(self, view):
            return {('q', view.robot.index(self.joint)): self.number('sag')}

    try:
        assert spreads(UR5, Sag('elbow_joint')) == [1e-4]
        assert beyond(UR5, Sag('elbow_joint', 2e-3)) == [('sag', 2e-3, 1e-3)]
        assert beyond(UR5, Sag('elbow_joint', 5e-4)) == []
        axis = Robot.from_mapping({'joints': [{'name': 'z', 'type': 'prismatic'}]})
        assert beyond(axis, Sag('z', 5e-4)) == [('sag', 5e-4, 1e-4)]
    finally:
        REGISTRY.pop('own_sag')


def test_names_and_not_files_decide_the_order_of_effects():
    names = [name for name, kind in REGISTRY.items() if kind.__module__.startswith('weld_twin')]
    assert names == sorted(names)


def test_what_slipped_a_day_later_is_told_in_hours(ur5):
    soon, late = (JointSlip('elbow_joint', 1e-3, time).remedy(ur5) for time in (60.5, 86_500.0))
    assert 'at t = 60.5; then' in soon and 'at t = 24.028 h; then' in late
