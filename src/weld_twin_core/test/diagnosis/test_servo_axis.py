# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A servo axis simulated from its forces: lag and friction are named with the sizes that follow."""

import numpy as np
import pytest

import weld_twin_core as wt

MASS, VISCOUS, COULOMB, OFFSET = 95.0, 200.0, 20.0, -3.0
GAIN, KP, KV = 35.0, 160.0, 243.0
"""Mass [kg], friction [N s/m, N] and gains of a position loop round a velocity loop, as large as
those of a published servo axis."""


@pytest.fixture(scope='module')
def found():
    """Return the diagnosis of ten seconds back and forth, measured with 1 um of noise."""
    step, count = 1e-4, 100_000
    t = step * np.arange(count)
    wanted = 0.1 * (1.0 - np.cos(1.3 * t)) + 0.02 * (1.0 - np.cos(3.1 * t))
    at, speed, out = 0.0, 0.0, np.empty(count)
    for k, place in enumerate(wanted):
        out[k] = at
        drive = GAIN * KV * (KP * (place - at) - speed)
        rubbing = VISCOUS * speed + COULOMB * np.tanh(speed / 2e-4) + OFFSET
        speed += step * (drive - rubbing) / MASS
        at += step * speed
    robot = wt.Robot.from_mapping({'joints': [{'name': 'axis', 'type': 'prismatic'}]})
    position = np.zeros((count, 3))
    position[:, 2] = out
    position += np.random.default_rng(2).normal(scale=1e-6, size=position.shape)
    every = slice(None, None, 25)
    motion = wt.JointMotion(t[every], wanted[every, None])
    measured = wt.Measurements(t[every], position[every])
    return wt.diagnose(wt.Recording('axis', motion, measured), robot)


def test_lag_and_friction_are_named_and_nothing_else(found):
    assert found.status in ('identified', 'ambiguous')
    assert {found.effects[k].effect.name for k in range(len(found.effects))} == {
        'servo_lag',
        'friction',
    }


def test_their_sizes_follow_from_the_forces_and_the_gains(found):
    effects = {each.effect.name: each.effect for each in found.effects}
    stiffness = GAIN * KV * KP
    lag, friction = effects['servo_lag'], effects['friction']
    assert lag.time_constant == pytest.approx((VISCOUS + GAIN * KV) / stiffness, rel=0.01)
    damping = 0.5 * (VISCOUS + GAIN * KV) / np.sqrt(stiffness * MASS)
    assert lag.damping == pytest.approx(damping, rel=0.1)
    assert friction.windup == pytest.approx(COULOMB / stiffness, rel=0.1)
    assert friction.asymmetry == pytest.approx(OFFSET / COULOMB, abs=0.05)
