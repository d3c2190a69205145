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


@pytest.fixture(scope='module')
def recordings():
    """Return stations of an arm in three visits of its own postures, some visited each time."""
    rng, names = np.random.default_rng(4), ROBOT.joint_names
    causes = (Backlash(names[0], 6e-4), GearRatio(names[4], 1e-3), LinkLength(names[1], 4e-4))
    same, out = rng.uniform(-0.6, 0.6, (8, 6)), []
    for k, count in enumerate(SIZES):
        q = np.concatenate([same, 0.2 * k + rng.uniform(-0.5, 0.5, (count - 8, 6))])
        t = 5.0 * np.arange(count)
        commanded = wt.Recording(f'visit {k}', wt.JointMotion(t, q, static=True))
        seen = wt.Twin(ROBOT, causes).poses(commanded, t).position
        noise = 2e-5 * rng.standard_normal(seen.shape)
        out.append(commanded.with_measured(wt.Measurements(t, seen + noise)))
    return out


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


def test_a_diagnosis_says_the_same_in_any_order(recordings):
    rest = [name for name in REGISTRY if name not in KINDS]
    one, other = (
        wt.diagnose(given, ROBOT, align='tool', exclude=rest, experiment=False).as_dict()[
            'verdict'
        ]
        for given in (recordings, recordings[::-1])
    )
    assert [c['name'] for c in one['causes']]
    assert one['indistinguishable'] == other['indistinguishable']
    assert other['confidence'] == pytest.approx(one['confidence'], abs=1e-6)
    for mine, yours in zip(one['causes'], other['causes'], strict=True):
        assert yours['probability'] == pytest.approx(mine['probability'], abs=1e-6)
        assert [i['effect'] for i in yours['name']] == [i['effect'] for i in mine['name']]
