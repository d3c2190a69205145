# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A person does literally what a sentence says, at every controller, and measures again.

The controllers are written here: each turns counts of a motor into a reading by the variable that its
maker keeps a zero in. The arm is the laboratory's, which shares no formula with the twin.
"""

import csv
import re

import numpy as np
import pytest

from weld_twin_core import effects_from_list, load
from weld_twin_core.diagnosis.advice import actions
from weld_twin_core.diagnosis.algebra.problem import Model
from weld_twin_lab.programs.plain import tool_pose
from weld_twin_nodes.offline.exports import write_offsets
from weld_twin_report.report.controllers import correction

ROBOT, JOINT, AT = load('kuka_kr6_r900'), 'joint_a3', 2
TOOL = np.eye(4)
Q = np.radians([20.0, -70.0, 95.0, 10.0, 40.0, -30.0])
GEAR, PULSES = -121.0, 1137.5
"""Radians of the motor per radian of the joint, and pulses per degree."""


class Axis:
    """An axis whose zero was set wrong by ``off`` [deg]: it stands at reading + off."""

    def __init__(self, brand, off):
        self.brand, self.off = brand, off
        self.motor = 17.0  # degrees of the joint from the notch at which the encoder was zero
        self.true_zero = 31.0  # where the joint really stands at the notch
        self.kept = {  # what the controller keeps, so that it reads ``off`` too little
            'kuka': self.true_zero - off,
            'fanuc': self.true_zero - off,
            'abb': -np.radians(self.true_zero - off) * GEAR,
            'yaskawa': -(self.true_zero - off) * PULSES,
            'ur': 0.0,
            None: self.true_zero - off,
        }[brand]

    @property
    def stands(self):
        return self.true_zero + self.motor

    @property
    def reads(self):
        if self.brand == 'abb':
            return np.degrees((np.radians(self.motor) * GEAR - self.kept) / GEAR)
        if self.brand == 'yaskawa':
            return (self.motor * PULSES - self.kept) / PULSES
        if self.brand == 'ur':  # readings stay; the model adds delta_theta to them
            return self.stands - self.off + np.degrees(self.kept)
        return self.motor + self.kept

    def does(self, told):
        """Take in a new value as a sentence says it."""
        old, sign, size, by = re.search(
            r'new (?:value|reading) = (.+?) ([+-]) ([\d.]+?)(?: deg)?( \* [GP])?[;,]', told
        ).groups()
        step = float(f'{sign}{size}') * {'* G': GEAR, '* P': PULSES}.get((by or '').strip(), 1.0)
        if old in ('what it reads now', 'old reading'):
            self.kept = self.reads + step - self.motor
        else:
            assert old == 'old value'
            self.kept += step


def off_by(off):
    """Return how far the tool is off [m] where a joint stands further than the model of it."""
    offsets = np.zeros(6)
    offsets[AT] = np.radians(off)
    return np.linalg.norm((tool_pose(ROBOT, Q, TOOL, offsets) - tool_pose(ROBOT, Q, TOOL))[:3, 3])


@pytest.mark.parametrize('off', [0.0456, -0.1213])
@pytest.mark.parametrize('brand', ['kuka', 'abb', 'fanuc', 'yaskawa', 'ur', None])
def test_a_zero_entered_as_it_is_told_is_gone_when_measured_again(brand, off):
    (zero,) = effects_from_list(
        [{'effect': 'joint_offset', 'joint': JOINT, 'offset': np.radians(off)}], ROBOT
    )
    axis = Axis(brand, off)
    assert axis.stands - axis.reads == pytest.approx(off)
    before = off_by(axis.stands - axis.reads)
    axis.does(correction(zero, brand, ROBOT))
    assert off_by(axis.stands - axis.reads) < 2e-3 * before


@pytest.mark.parametrize('off', [0.0456, -0.1213])
def test_action_table_and_card_say_the_same_of_where_the_joint_stands(off, tmp_path):
    effects = effects_from_list(
        [{'effect': 'joint_offset', 'joint': JOINT, 'offset': np.radians(off)}], ROBOT
    )
    (action,) = actions(effects, ROBOT)
    stands, becomes = re.search(
        r'At reading X \w+ stands at X ([+-] [\d.]+) deg\. To mend: .* becomes X ([+-] [\d.]+) deg',
        action,
    ).groups()
    assert float(stands.replace(' ', '')) == float(becomes.replace(' ', '')) == off
    write_offsets(tmp_path / 'o.csv', Model(ROBOT, (np.eye(4),), (), tuple(effects)), ())
    rows = {row['joint']: row for row in csv.DictReader((tmp_path / 'o.csv').open())}
    assert rows[JOINT]['meaning'] == action and float(rows[JOINT]['shown']) == pytest.approx(off)
    for brand in ('kuka', 'abb', 'fanuc', 'yaskawa', None):
        assert f'X {stands} deg' in correction(effects[0], brand, ROBOT) or brand is None


def test_a_zero_that_is_not_named_is_not_told_to_be_set(tmp_path):
    """It may stand against springs and lengths beside it, and does harm without them."""
    other = ROBOT.joint_names[1]
    effects = effects_from_list(
        [{'effect': 'joint_offset', 'joint': at, 'offset': 2e-3} for at in (JOINT, other)], ROBOT
    )
    named = (('joint_offset', JOINT),)
    model = Model(ROBOT, (np.eye(4),), found=tuple(effects), named=named)
    write_offsets(tmp_path / 'o.csv', model, ())
    rows = {row['joint']: row for row in csv.DictReader((tmp_path / 'o.csv').open())}
    assert float(rows[JOINT]['offset']) == 2e-3
    assert float(rows[other]['offset']) == 0.0 and not rows[other]['meaning']
