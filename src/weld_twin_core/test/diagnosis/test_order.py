# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which recording is given first changes nothing of an answer."""

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.diagnosis.algebra.problem import Problem
from weld_twin_core.diagnosis.unseen.folds import posture_regions
from weld_twin_core.effects import REGISTRY, Backlash, GearRatio, LinkLength

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
def swing():
    """Return a recording of the arm in motion."""
    t = np.arange(0.0, 8.0, 0.02)
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


def test_a_diagnosis_says_the_same_in_any_order(recordings, swing):
    every = [*recordings[:2], swing]
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
