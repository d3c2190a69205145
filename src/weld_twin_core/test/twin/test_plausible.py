# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a machine can have: every parameter has a range with a source, and files may narrow it."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from weld_twin_core.arm import catalog
from weld_twin_core.arm.robot import Robot
from weld_twin_core.effects import (
    REGISTRY,
    Effect,
    Parameter,
    Plausible,
    Stage,
    effects_from_list,
    register,
)
from weld_twin_core.effects.loads import mass_range
from weld_twin_core.effects.plausible import beyond, plausible, ranges, spreads, table
from weld_twin_core.errors import ModelError

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
