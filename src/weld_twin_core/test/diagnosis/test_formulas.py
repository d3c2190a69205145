# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Names whose formula does not hold: what no effect in the library does is not told as one."""

import numpy as np
from small_arm import small_arm

import weld_twin_core as wt

ELBOW = 2
NOISE = 2e-5
CENTRE = np.array([0.3, -1.2, 1.4])


def swinging(step: float) -> wt.JointMotion:
    """Return joints that swing at frequencies of their own, within the arm's limits."""
    t = np.arange(0.0, 12.0, step)
    way = 0.5 * np.sin(np.outer(t, 0.7 + 0.31 * np.arange(3)) + np.arange(3))
    return wt.JointMotion(t, CENTRE + way)


def recorded(bend=None, instrument=None, step=0.04) -> wt.Recording:
    """Return a recording with one joint, or the instrument, bent by a function."""
    commanded = swinging(step)
    q = np.array(commanded.q)
    if bend is not None:
        q[:, ELBOW] += bend(q[:, ELBOW])
    real = wt.Twin(small_arm()).poses(wt.Recording('real', wt.JointMotion(commanded.t, q)))
    seen = real.position if instrument is None else instrument(real.position)
    drawn = np.random.default_rng(5).normal(scale=NOISE, size=seen.shape)
    measured = wt.Measurements(commanded.t, seen + drawn)
    return wt.Recording('real', commanded, measured=measured)


def far_off(position):
    """Return positions that an instrument stretches by the square of their distance."""
    far = np.linalg.norm(position, axis=1, keepdims=True)
    return position * (1.0 + 1e-4 * far**2)


def jumping(angle):
    """Return how a link trails that sticks to its place until it is wound up, then jumps."""
    times = np.arange(angle.size * 100) / 100.0
    out, link = np.empty_like(angle), angle[0]
    for k, motor in enumerate(np.interp(times, np.arange(angle.size), angle)):
        if abs(motor - link) > 1e-3:
            link = motor - 2e-4 * np.sign(motor - link)
        if k % 100 == 0:
            out[k // 100] = link - motor
    return out


def rounded(angle):
    """Return how far a coarse encoder puts the link from where it is told to be."""
    return 6e-4 * np.round(angle / 6e-4) - angle


def first(found):
    cause = found.causes[0]
    return cause.place[0][0], cause.dependence[0][0]


def test_an_instrument_that_errs_by_a_law_of_its_own_is_no_scale():
    found = wt.diagnose(recorded(instrument=far_off, step=0.02), small_arm(), experiment=False)
    assert found.status == 'unknown'
    assert first(found) == ('instrument', 'place')
    assert not found.effects
    assert any('measurement_scale' in reason for reason in found.reasons)


def test_lost_motion_of_another_law_is_placed_and_not_named():
    found = wt.diagnose(recorded(jumping), small_arm(), experiment=False)
    assert found.status == 'unknown'
    place, dependence = first(found)
    assert place == 'elbow_joint'
    assert dependence in ('direction', 'speed')


def test_an_encoder_that_rounds_is_placed_though_its_family_was_taken_out():
    found = wt.diagnose(
        recorded(rounded), small_arm(), exclude=('quantization',), experiment=False
    )
    assert found.status == 'unknown'
    assert first(found)[0] == 'elbow_joint'
