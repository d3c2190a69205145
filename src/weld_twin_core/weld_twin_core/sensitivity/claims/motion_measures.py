# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Measurements of claims about motion: smooth against aggressive, play, lag."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Array
from ...effects import Effect
from ...effects.backlash import Backlash
from ...effects.geometry import JointOffset
from ...effects.servo_lag import ServoLag
from ..seam_study import Study
from ..sweep import DEGREE, spread_of_passes
from ..tolerance import default_tolerances
from ..trajectory_advice import compare_profiles, rms_over_arc
from .claim_case import POINTS, Case, Measure

_WIDTH = 0.03 * DEGREE
"""Play [rad] of every joint where claims on backlash are measured; they are ratios."""
_LAG = 5e-3
"""Lag [s] of every joint where profiles are compared; the claims are ratios."""
_NEAR = 2
"""Path points to either side of a reversal that count as at it."""


def _distance(study: Study, effects: Sequence[Effect]) -> Array:
    return np.asarray(np.linalg.norm(study.deviations(tuple(effects)), axis=-1))


def _offset(case: Case) -> dict[str, float]:
    """Measure constant joint offsets on both motions at the same arc length."""
    effects = [JointOffset(joint, 0.05 * DEGREE) for joint in case.robot.joint_names]
    smooth, aggressive = (_distance(s, effects) for s in (case.smooth, case.aggressive))
    same = np.interp(case.aggressive.s, case.smooth.s, smooth)
    return {
        'offset_ratio': aggressive.max() / smooth.max(),
        'offset_same_arc': np.abs(aggressive / same - 1.0).max(),
        'offset_mean_ratio': aggressive.mean() / smooth.mean(),
    }


def _lag(case: Case) -> dict[str, float]:
    """Measure a servo lag on every joint, which does depend on the motion."""
    effects = [ServoLag(joint, _LAG) for joint in case.robot.joint_names]
    smooth, aggressive = (_distance(s, effects) for s in (case.smooth, case.aggressive))
    return {'lag_ratio': aggressive.max() / smooth.max(), 'lag_smooth_m': smooth.max()}


def _play(case: Case) -> dict[str, float]:
    """Measure play of every joint: peak, rms and range on both motions."""
    effects = [Backlash(joint, _WIDTH) for joint in case.robot.joint_names]
    studies = (case.smooth, case.aggressive)
    off = [study.deviations(tuple(effects)) for study in studies]
    smooth, aggressive = (np.linalg.norm(each, axis=-1) for each in off)
    spread = [float(spread_of_passes(s, each)) for s, each in zip(studies, off, strict=True)]
    return {
        'play_spread_smooth_m': spread[0],
        'play_spread_aggressive_m': spread[1],
        'play_peak_ratio': aggressive.max() / smooth.max(),
        'play_rms_ratio': rms_over_arc(case.aggressive, aggressive)
        / rms_over_arc(case.smooth, smooth),
        'play_smooth_m': smooth.max(),
        'play_aggressive_m': aggressive.max(),
        'play_mean_ratio': aggressive.mean() / smooth.mean(),
    }


def _locality(case: Case) -> dict[str, float]:
    """Measure how much of the squared deviation lies at reversals, as play and as written."""
    study = case.aggressive
    travel = np.ptp(study.recording.joints.q, axis=0)
    joint = int(np.argmax(travel * case.joint_levers))
    name, q = case.robot.joint_names[joint], study.recording.joints.q[:, joint]
    flips = np.flatnonzero(np.diff(np.sign(np.diff(q))) != 0.0) + 1
    near = np.zeros(study.samples, dtype=bool)
    for k in range(-_NEAR, _NEAR + 1):
        near[np.clip(flips + k, 0, study.samples - 1)] = True
    share = {}
    for form in ('play', 'reversal'):
        square = study.deviations((Backlash(name, _WIDTH, form),)) ** 2
        share[form] = square[near].sum() / square.sum()
    return {
        'local_share_play': share['play'],
        'local_share_written': share['reversal'],
        'local_share_of_points': near.mean(),
        'reversals': flips.size,
    }


def _frequency(case: Case) -> dict[str, float]:
    """Measure what more reversals do to the mean and the peak, as play and as written."""
    few, many = case.reversing(2), case.reversing(20)
    out: dict[str, float] = {}
    for form, label in (('play', 'play'), ('reversal', 'written')):
        effects = [Backlash(joint, _WIDTH, form) for joint in case.robot.joint_names]
        a, b = (_distance(s, effects) for s in (few, many))
        out |= {
            f'more_reversals_mean_{label}': b.mean() / a.mean(),
            f'more_reversals_peak_{label}': b.max() / a.max(),
        }
    effects = [Backlash(joint, _WIDTH, 'reversal') for joint in case.robot.joint_names]
    finer = case.reversing(10, 2 * POINTS)
    coarse_mean = _distance(case.aggressive, effects).mean()
    return out | {'finer_mean_written': _distance(finer, effects).mean() / coarse_mean}


def _planning(case: Case) -> dict[str, float]:
    """Measure the expected deviation by time law, geometry alone and with lag and play."""
    profiles = ('constant', 's-curve', 'smooth', 'aggressive')
    out: dict[str, float] = {}
    for label, families in (
        ('geometry', ('joint_offset', 'link_length', 'link_twist', 'base_pose')),
        ('lag', ('joint_offset', 'link_length', 'link_twist', 'backlash', 'servo_lag')),
    ):
        tolerances = default_tolerances(case.robot, families)
        result = {
            r.profile: r
            for r in compare_profiles(
                case.robot, case.path, tolerances, profiles=profiles, points=POINTS
            )
        }
        rough, fine = result['aggressive'], result['smooth']
        out |= {
            f'plan_{label}_ratio': rough.expected_m / fine.expected_m,
            f'plan_{label}_ratio_same_time': rough.same_time_m / fine.same_time_m,
        }
    return out


MEASURES: tuple[Measure, ...] = (_offset, _lag, _play, _locality, _frequency, _planning)
