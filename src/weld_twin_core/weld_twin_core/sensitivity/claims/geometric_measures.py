# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Measurements of claims about geometry: baseline, initialization, leverage, linearity."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import spearmanr

from ...arm.chain import jacobian
from ...arrays import Array
from ...effects import Effect
from ...effects.frame_errors import BasePose
from ...effects.geometry import JointOffset
from ...motion.planned_motion import plan
from ...motion.profiles import Constant
from ...twin.twin import Twin
from ..local import local_sensitivity, posture
from ..seam_study import study_of_plan
from ..sweep import DEGREE, default_values, end_of_linearity, sweep, together
from ..tolerance import default_tolerances
from .claim_case import BENT_TORCH, POINTS, Case, Measure

_POSTURES = 2000
"""Postures drawn over the joint limits; a rank correlation is then good to 0.02."""


def _baseline(case: Case) -> dict[str, float]:
    """Measure the seam without errors against the poses that were planned."""
    law = Constant()
    planned = plan(case.robot, case.path, law, POINTS / (case.path.length / law.speed), fit=True)
    study = study_of_plan(case.robot, planned)
    off = np.linalg.norm(study.nominal.position - planned.poses[:, :3, 3], axis=1)
    return {'baseline_d_norm': off.max() / planned.length}


def _initialization(case: Case) -> dict[str, float]:
    """Measure displacements and turns of the base, and how the deviation changes on the way."""
    study, size = case.smooth, 5e-4
    shifted = _distance(case, BasePose(xyz=np.full(3, size / np.sqrt(3.0))))
    turned = [_distance(case, BasePose(rotvec=1e-3 * axis)) for axis in np.eye(3)]
    worst = max(turned, key=lambda d: float(np.ptp(d)))
    growth = np.polyfit(study.s / study.length, shifted / size, 1)[0]
    return {
        'init_S': shifted.max() / size,
        'init_spread': np.ptp(shifted) / shifted.mean(),
        'init_growth': growth,
        'init_turn_S_m': max(d.max() for d in turned) / 1e-3,
        'init_turn_spread': np.ptp(worst) / worst.mean(),
    }


def _distance(case: Case, *effects: Effect) -> Array:
    return np.asarray(np.linalg.norm(case.smooth.deviations(effects), axis=-1))


def _linearity(case: Case) -> dict[str, float]:
    """Measure how far a sweep of joint offsets departs from proportion, alone and together."""
    offsets = default_tolerances(case.robot, ('joint_offset',))
    result = [sweep(case.smooth, t, default_values(t)) for t in offsets]
    all_equal = together(case.smooth, offsets, default_values(offsets[0]), 'all joints')
    ends = [end_of_linearity(case.smooth, t) for t in offsets]
    moving = [f for f in result if f.max_m.max() > 1e-9]
    tenth = [float(np.interp(0.1 * DEGREE, f.values, f.max_m)) for f in result]
    return {
        'linear_departure_max': max(f.departure[-1] for f in moving),
        'linear_departure_min': min(f.departure[-1] for f in moving),
        'linear_departure_all': all_equal.departure[-1],
        'linear_end_rad': min((e for e in ends if e is not None), default=1.0),
        'tenth_degree_m': max(tenth),
    }


def _leverage(case: Case) -> dict[str, float]:
    """Measure which joints matter for equal angles, with the model's tool and a bent torch."""
    robot = case.robot.with_frames(tool=case.robot.T_flange_tool @ BENT_TORCH)
    nominal = Twin(robot).poses(case.smooth.recording)
    long = replace(case.smooth, robot=robot, nominal=nominal)
    offsets = default_tolerances(case.robot, ('joint_offset',))
    bare, torch = (local_sensitivity(study, offsets) for study in (case.smooth, long))
    order = np.arange(len(offsets))
    half = len(offsets) // 2
    return {
        'distal_rank': spearmanr(order, bare.peak).statistic,
        'distal_rank_torch': spearmanr(order, torch.peak).statistic,
        'distal_ratio': bare.peak[-half:].mean() / bare.peak[:half].mean(),
        'distal_ratio_torch': torch.peak[-half:].mean() / torch.peak[:half].mean(),
        'turn_spread': np.ptp(bare.turns),
        'S_theta_max_m': bare.peak.max(),
        'S_theta_mean_m': bare.peak.mean(),
        'S_theta_least_m': bare.peak.min(),
    }


def _lengths(case: Case) -> dict[str, float]:
    """Measure link length errors: their coefficients, their proportion, their shape."""
    links = default_tolerances(case.robot, ('link_length',))
    result = local_sensitivity(case.smooth, links)
    bends = [abs(sweep(case.smooth, t, default_values(t)).departure[-1]) for t in links]
    return {
        'S_a_max': result.peak.max(),
        'S_a_min': result.peak.min(),
        'S_a_departure': max(bends),
        'S_a_spread': np.ptp(result.analytic, axis=1).max(),
    }


def _conditioning(case: Case) -> dict[str, float]:
    """Measure whether a high condition number goes with a high gain along the seam."""
    stand = posture(case.smooth)
    condition, gain = _anywhere(case)
    return {
        'condition_rank': spearmanr(stand.condition, stand.amplification).statistic,
        'condition_rank_anywhere': spearmanr(condition, gain).statistic,
        'condition_max': stand.condition.max(),
        'gain_max': stand.amplification.max(),
        'gain_min': stand.amplification.min(),
        'manipulability_min': stand.manipulability.min(),
    }


def _anywhere(case: Case) -> tuple[Array, Array]:
    """Return condition number and gain at random postures within the joint limits."""
    robot = case.robot
    low, high = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    rng = np.random.default_rng(case.seed)
    q = low + (high - low) * rng.random((_POSTURES, robot.n))
    strength = np.linalg.svd(jacobian(robot, q)[..., :3, :], compute_uv=False)
    gain = np.asarray(strength[:, 0], dtype=np.float64)
    return gain / np.maximum(strength[:, -1], 1e-12), gain


def _bound(case: Case) -> dict[str, float]:
    """Measure the deviation by random offsets as a part of the bound |J| |dtheta|."""
    rng = np.random.default_rng(case.seed)
    gain = posture(case.smooth).amplification
    parts = []
    for _ in range(20):
        offset = rng.normal(size=case.robot.n) * 1e-4
        effects = [
            JointOffset(name, float(v))
            for name, v in zip(case.robot.joint_names, offset, strict=True)
        ]
        parts.append((_distance(case, *effects) / (gain * np.linalg.norm(offset))).mean())
    return {'bound_low': min(parts), 'bound_high': max(parts)}


MEASURES: tuple[Measure, ...] = (
    _baseline,
    _initialization,
    _linearity,
    _leverage,
    _lengths,
    _conditioning,
    _bound,
)
