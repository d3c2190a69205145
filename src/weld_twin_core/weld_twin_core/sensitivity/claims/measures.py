# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is measured of a robot on a seam for the claims: of geometry, of motion, of all errors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.stats import spearmanr

from ...arm.chain import jacobian
from ...arm.robot import Robot
from ...arm.rotation import rotation_matrix, transform
from ...arrays import Array
from ...effects import Effect
from ...effects.backlash import Backlash
from ...effects.geometry import BasePose, JointOffset
from ...effects.servo_lag import ServoLag
from ...motion.paths import Path
from ...motion.planned_motion import plan
from ...motion.profiles import Aggressive, Constant
from ...twin.twin import Twin
from ..evaluate import draws_at, exact_deviations, model
from ..indices import SobolDesign
from ..local import LocalSensitivity, local_sensitivity, posture
from ..seam_study import Study, planned_study, study_of_plan
from ..sweep import (
    DEGREE,
    cumulative,
    default_values,
    end_of_linearity,
    scenario_deviations,
    spread_of_passes,
    sweep,
    together,
)
from ..tolerance import Tolerance, default_tolerances, with_draws
from ..trajectory_advice import compare_profiles, rms_over_arc

_POINTS = 400
"""Path points; the aggressive motion passes each part of the seam many times."""
_BENT_TORCH = transform(rotation_matrix([0.0, 0.6, 0.0]), np.array([0.1, 0.0, 0.35]))
"""A torch of usual size, bent by 34 degrees, from flange to wire tip."""


@dataclass(frozen=True, eq=False)
class _Case:
    """A robot, a seam and the motions on it; see `measure_case`."""

    robot: Robot
    path: Path
    seed: int = 0

    @cached_property
    def tolerances(self) -> tuple[Tolerance, ...]:
        """Return the paper's error sources; a turn of the base is measured apart."""
        every = default_tolerances(self.robot)
        return tuple(t for t in every if (t.effect, t.parameter) != ('base_pose', 'rotvec'))

    @cached_property
    def smooth(self) -> Study:
        return planned_study(self.robot, self.path, 'smooth', points=_POINTS)

    @cached_property
    def aggressive(self) -> Study:
        return self.reversing(10)

    def reversing(self, reversals: int, points: int = _POINTS) -> Study:
        """Return an aggressive motion that turns a number of times."""
        law = Aggressive(reversals=reversals)
        return planned_study(self.robot, self.path, law, points=points)

    @cached_property
    def local(self) -> LocalSensitivity:
        return local_sensitivity(self.smooth, self.tolerances)

    @property
    def joint_levers(self) -> Array:
        """Return the peak slope of D by the offset of every joint, shape (n,) [m/rad]."""
        own = [k for k, t in enumerate(self.tolerances) if t.effect == 'joint_offset']
        return self.local.peak[own]


def _distance(study: Study, effects: Sequence[Effect]) -> Array:
    return np.asarray(np.linalg.norm(study.deviations(tuple(effects)), axis=-1))


_POSTURES = 2000
"""Postures drawn over the joint limits; a rank correlation is then good to 0.02."""


def _baseline(case: _Case) -> dict[str, float]:
    """Measure the seam without errors against the poses that were planned."""
    law = Constant()
    planned = plan(case.robot, case.path, law, _POINTS / (case.path.length / law.speed), fit=True)
    study = study_of_plan(case.robot, planned)
    off = np.linalg.norm(study.nominal.position - planned.poses[:, :3, 3], axis=1)
    return {'baseline_d_norm': off.max() / planned.length}


def _initialization(case: _Case) -> dict[str, float]:
    """Measure displacements and turns of the base, and how the deviation changes on the way."""
    study, size = case.smooth, 5e-4
    shifted = _distance(study, [BasePose(xyz=np.full(3, size / np.sqrt(3.0)))])
    turned = [_distance(study, [BasePose(rotvec=1e-3 * axis)]) for axis in np.eye(3)]
    worst = max(turned, key=lambda d: float(np.ptp(d)))
    growth = np.polyfit(study.s / study.length, shifted / size, 1)[0]
    return {
        'init_S': shifted.max() / size,
        'init_spread': np.ptp(shifted) / shifted.mean(),
        'init_growth': growth,
        'init_turn_S_m': max(d.max() for d in turned) / 1e-3,
        'init_turn_spread': np.ptp(worst) / worst.mean(),
    }


def _linearity(case: _Case) -> dict[str, float]:
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


def _leverage(case: _Case) -> dict[str, float]:
    """Measure which joints matter for equal angles, with the model's tool and a bent torch."""
    robot = case.robot.with_frames(tool=case.robot.T_flange_tool @ _BENT_TORCH)
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


def _lengths(case: _Case) -> dict[str, float]:
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


def _conditioning(case: _Case) -> dict[str, float]:
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


def _anywhere(case: _Case) -> tuple[Array, Array]:
    """Return condition number and gain at random postures within the joint limits."""
    robot = case.robot
    low, high = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    rng = np.random.default_rng(case.seed)
    q = low + (high - low) * rng.random((_POSTURES, robot.n))
    strength = np.linalg.svd(jacobian(robot, q)[..., :3, :], compute_uv=False)
    gain = np.asarray(strength[:, 0], dtype=np.float64)
    return gain / np.maximum(strength[:, -1], 1e-12), gain


def _bound(case: _Case) -> dict[str, float]:
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
        parts.append((_distance(case.smooth, effects) / (gain * np.linalg.norm(offset))).mean())
    return {'bound_low': min(parts), 'bound_high': max(parts)}


_WIDTH = 0.03 * DEGREE
"""Play [rad] of every joint where claims on backlash are measured; they are ratios."""
_LAG = 5e-3
"""Lag [s] of every joint where profiles are compared; the claims are ratios."""
_NEAR = 2
"""Path points to either side of a reversal that count as at it."""


def _offset(case: _Case) -> dict[str, float]:
    """Measure constant joint offsets on both motions at the same arc length."""
    effects = [JointOffset(joint, 0.05 * DEGREE) for joint in case.robot.joint_names]
    smooth, aggressive = (_distance(s, effects) for s in (case.smooth, case.aggressive))
    same = np.interp(case.aggressive.s, case.smooth.s, smooth)
    return {
        'offset_ratio': aggressive.max() / smooth.max(),
        'offset_same_arc': np.abs(aggressive / same - 1.0).max(),
        'offset_mean_ratio': aggressive.mean() / smooth.mean(),
    }


def _lag(case: _Case) -> dict[str, float]:
    """Measure a servo lag on every joint, which does depend on the motion."""
    effects = [ServoLag(joint, _LAG) for joint in case.robot.joint_names]
    smooth, aggressive = (_distance(s, effects) for s in (case.smooth, case.aggressive))
    return {'lag_ratio': aggressive.max() / smooth.max(), 'lag_smooth_m': smooth.max()}


def _play(case: _Case) -> dict[str, float]:
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


def _locality(case: _Case) -> dict[str, float]:
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


def _frequency(case: _Case) -> dict[str, float]:
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
    finer = case.reversing(10, 2 * _POINTS)
    coarse_mean = _distance(case.aggressive, effects).mean()
    return out | {'finer_mean_written': _distance(finer, effects).mean() / coarse_mean}


def _planning(case: _Case) -> dict[str, float]:
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
                case.robot, case.path, tolerances, profiles=profiles, points=_POINTS
            )
        }
        rough, fine = result['aggressive'], result['smooth']
        out |= {
            f'plan_{label}_ratio': rough.expected_m / fine.expected_m,
            f'plan_{label}_ratio_same_time': rough.same_time_m / fine.same_time_m,
        }
    return out


_GROUPS = {
    'joint_offset': 'angular',
    'link_twist': 'angular',
    'backlash': 'backlash',
    'link_length': 'length',
    'base_pose': 'initial',
}
_ORDER = ('angular', 'backlash', 'length', 'initial')
"""The paper's final ranking (V.vii), the strongest first."""
_DRAWS = 200
"""Draws of all errors at once, of which median and extremes are reported."""
_RANKED = 500
"""Scalings of the tolerances under which the order of the groups is looked at."""
_FACTOR = 3.0
"""Tolerances of a group are multiplied by up to this, or divided, to see whether ranks hold."""


def _sums(case: _Case) -> dict[str, float]:
    """Measure the deviation by all errors over the sum of those by each source."""
    study, tolerances = case.smooth, case.tolerances
    rng = np.random.default_rng(case.seed)
    draws = draws_at(tolerances, rng.random((_DRAWS, len(tolerances))))
    combined = np.linalg.norm(exact_deviations(study, tolerances, draws), axis=-1)
    labels = np.array([_GROUPS[t.effect] for t in tolerances])
    parts = np.zeros_like(combined)
    for label in _ORDER:
        own = [k for k, name in enumerate(labels) if name == label]
        effects = with_draws((), [tolerances[k] for k in own], draws[:, own])
        parts = parts + np.linalg.norm(study.deviations(effects), axis=-1)
    ratio = combined / parts
    peaks = combined.max(axis=1) / parts.max(axis=1)
    return {
        'combined_ratio_median': np.median(peaks),
        'combined_ratio_max': ratio.max(),
        'combined_exceeds': (ratio > 1.0).mean(),
        **_coupling(case, draws, combined),
    }


def _coupling(case: _Case, draws: Array, combined: Array) -> dict[str, float]:
    """Return the part of the deviation that no sum of single errors explains."""
    study, tolerances = case.smooth, case.tolerances
    each = np.zeros((len(draws[:20]), study.samples, 3))
    for k, tolerance in enumerate(tolerances):
        each += exact_deviations(study, (tolerance,), draws[:20, k : k + 1])
    joint = exact_deviations(study, tolerances, draws[:20])
    remaining = np.linalg.norm(joint - each, axis=-1).max(axis=1)
    return {'coupling': float((remaining / combined[:20].max(axis=1)).max())}


def _drift(case: _Case) -> dict[str, float]:
    """Measure how the cumulative deviation grows with the path, by source and together."""
    study = case.smooth
    # Equal steps of arc length: on a time law the sum would follow the speed, not the path.
    grid = np.linspace(0.0, study.length, study.samples)
    out = {}
    for name, off in scenario_deviations(study).items():
        distance = np.interp(grid, study.s, np.linalg.norm(off, axis=-1))
        total = cumulative(distance[:, None])
        out[name] = growth_exponent(grid, total)
    off = scenario_deviations(study)['angular']
    speed = np.linalg.norm(off, axis=-1)
    return {
        'drift_exponent_angular': out['angular'],
        'drift_exponent_combined': out['combined'],
        'drift_exponent_init': out['initialization'],
        'drift_spread_angular': np.ptp(speed) / speed.mean(),
    }


def growth_exponent(path: Array, total: Array) -> float:
    """Return the power of the path length with which a sum grows over its second half."""
    late = slice(len(path) // 2, None)
    return float(np.polyfit(np.log(path[late]), np.log(total[late]), 1)[0])


def _ranking(case: _Case) -> dict[str, float]:
    """Measure the ranking by group Sobol indices, and how it stands changed tolerances."""
    tolerances = case.tolerances
    labels = tuple(_GROUPS[t.effect] for t in tolerances)
    design = SobolDesign(tuple(t.name for t in tolerances), 1024, labels, case.seed)
    fast = model(case.aggressive, tolerances)
    result = design.indices(fast.at_probabilities(design.samples()).d_norm)
    total = dict(zip(result.names, result.total, strict=True))
    out = {f'ST_{label}': total[label] for label in _ORDER}
    out['ST_half'] = float(result.total_half.max())
    out['rank_holds'] = all(total[a] > total[b] for a, b in pairwise(_ORDER))
    best = dict.fromkeys(_ORDER, 0.0)
    for tolerance, value in zip(case.local.tolerances, case.local.peak, strict=True):
        unit = 1e3 * DEGREE if tolerance.unit == 'rad' else 1.0
        label = _GROUPS[tolerance.effect]
        best[label] = max(best[label], float(value) * unit)
    return out | _stability(case) | {f'unit_{label}': value for label, value in best.items()}


def _stability(case: _Case) -> dict[str, float]:
    """Return how often groups keep the paper's order when their tolerances change."""
    square = dict.fromkeys(_ORDER, 0.0)
    for tolerance, value in zip(case.local.tolerances, case.local.contribution, strict=True):
        square[_GROUPS[tolerance.effect]] += float(value) ** 2
    size = np.sqrt([square[label] for label in _ORDER])
    rng = np.random.default_rng(case.seed)
    scaled = size * _FACTOR ** rng.uniform(-1.0, 1.0, (_RANKED, len(_ORDER)))
    return {
        'rank_share': float((np.diff(scaled, axis=1) < 0.0).all(axis=1).mean()),
        'rank_first_share': float((scaled.argmax(axis=1) == 0).mean()),
        **{f'contribution_{label}_m': v for label, v in zip(_ORDER, size, strict=True)},
    }


_MEASURES: tuple[Callable[[_Case], dict[str, float]], ...] = (
    _baseline,
    _initialization,
    _linearity,
    _leverage,
    _lengths,
    _conditioning,
    _bound,
    _offset,
    _lag,
    _play,
    _locality,
    _frequency,
    _planning,
    _sums,
    _drift,
    _ranking,
)


def measure_case(robot: Robot, path: Path, seed: int = 0) -> dict[str, float]:
    """Return all that the claims need of a robot on a seam by name; units as in `rules`."""
    case, out = _Case(robot, path, seed), dict[str, float]()
    for measure in _MEASURES:
        out |= {key: float(value) for key, value in measure(case).items()}
    return out
