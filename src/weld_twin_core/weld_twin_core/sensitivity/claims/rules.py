# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Every claim of the paper, the measurement that decides it, and the verdict by many cases."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from ...errors import DataError

_Measured = Mapping[str, float]


_DEGREE_IN_MM = 1e3 * np.pi / 180.0
"""Factor from metres a radian to millimetres a degree."""
_UNITS = {
    'percent': 100.0,
    'mm': 1e3,
    'ppm': 1e6,
    'degrees': 180.0 / np.pi,
    'mm_per_degree': _DEGREE_IN_MM,
}
"""What a range may be told in, and its factor."""


class _Range:
    """What a measurement was over all cases; formats as its least and largest value."""

    def __init__(self, values: Sequence[float]) -> None:
        self.low, self.high = float(np.min(values)), float(np.max(values))

    def __format__(self, form: str) -> str:
        """Return 'low to high' by a format, or one number where both read the same."""
        kind = form or '.3g'
        low, high = format(self.low, kind), format(self.high, kind)
        return low if low == high else f'{low} to {high}'

    def __getattr__(self, unit: str) -> _Range:
        """Return the same in one of `_UNITS`."""
        return _Range([self.low * _UNITS[unit], self.high * _UNITS[unit]])

    @property
    def size(self) -> float:
        """Return the largest it was, to either side of zero."""
        return max(abs(self.low), abs(self.high))


@dataclass(frozen=True)
class Rule:
    """A claim and how it is decided."""

    key: str
    statement: str
    where: str
    """Name, what the paper says, and in which section."""
    holds: Callable[[_Measured], bool]
    """Whether the claim as written holds on one case."""
    reason: str
    """One line in which the ranges of the measurements are put."""
    shows: tuple[str, ...]
    """Measurements the table gives."""
    condition: str = ''
    """Under which condition the claim holds where it does not hold as written."""
    holds_then: Callable[[_Measured], bool] | None = None
    """Whether it holds on one case under that condition."""


_SAME = 1e-3
"""Ratios closer to one than this are the same."""

_RULES: tuple[Rule, ...] = (
    Rule(
        'baseline',
        'Without errors D_norm is about 0, at the limit of the arithmetic',
        'IV.i',
        lambda m: m['baseline_d_norm'] < 1e-9,
        'D_norm is {baseline_d_norm:.1e}, the closure of the inverse kinematics',
        ('baseline_d_norm',),
    ),
    Rule(
        'initialization_constant',
        'An initialization error shifts the path by a constant, without drift',
        'IV.ii',
        lambda m: m['init_spread'] < _SAME and m['init_turn_spread'] < _SAME,
        'a displaced base gives the same shift everywhere (spread {init_spread:.0e}), a turned '
        'base one that changes along the seam by {init_turn_spread.percent:.0f} %',
        ('init_spread', 'init_turn_spread'),
        'the error is a displacement, not a turn',
        lambda m: m['init_spread'] < _SAME,
    ),
    Rule(
        'initialization_unit',
        'S_init is about 1 and the error does not grow',
        'V.v',
        lambda m: (
            abs(m['init_S'] - 1.0) < _SAME
            and abs(m['init_growth']) < _SAME
            and abs(m['init_turn_S_m'] - 1.0) < 0.05
        ),
        'an identity for a displacement (S = {init_S:.3f}, growth {init_growth:.0e}); a turn '
        'has the lever arm, {init_turn_S_m:.2f} m/rad',
        ('init_S', 'init_growth', 'init_turn_S_m'),
        'the error is a displacement, not a turn',
        lambda m: abs(m['init_S'] - 1.0) < _SAME and abs(m['init_growth']) < _SAME,
    ),
    Rule(
        'smooth_below_aggressive',
        'The same angular error deviates more on an aggressive than on a smooth motion',
        'IV.iii',
        lambda m: m['offset_ratio'] > 1.0 + _SAME,
        'with a constant offset the peaks have the ratio {offset_ratio:.4f} and equal arc '
        'length means equal deviation (within {offset_same_arc:.0e}); with 5 ms of lag the '
        'ratio is {lag_ratio:.1f}',
        ('offset_ratio', 'offset_same_arc', 'lag_ratio'),
        'the error depends on the motion, as servo lag does',
        lambda m: m['lag_ratio'] > 1.0 + _SAME,
    ),
    Rule(
        'smooth_cumulative',
        'A smooth motion has the smaller cumulative drift',
        'IV.iii',
        lambda m: m['offset_mean_ratio'] > 1.0 + _SAME,
        'for a constant offset the mean deviation per sample has the ratio '
        '{offset_mean_ratio:.3f} aggressive to smooth; a sum over samples only counts for how '
        'long a motion lasts',
        ('offset_mean_ratio',),
    ),
    Rule(
        'smooth_mitigates',
        'Smooth planning is mitigation',
        'V.viii',
        lambda m: m['plan_geometry_ratio'] > 1.01 and m['plan_lag_ratio'] > 1.01,
        'expected deviation over arc length, aggressive to smooth: geometry '
        '{plan_geometry_ratio:.3f}; with lag and play {plan_lag_ratio:.2f}, and '
        '{plan_lag_ratio_same_time:.2f} when both take the same time',
        ('plan_geometry_ratio', 'plan_lag_ratio', 'plan_lag_ratio_same_time'),
        'errors follow speed (lag), and then mostly by being slow',
        lambda m: m['plan_lag_ratio'] > 1.01,
    ),
    Rule(
        'backlash_local',
        'Backlash deviates only locally, at reversals',
        'IV.iv',
        lambda m: m['local_share_play'] > 0.9,
        '{local_share_play.percent:.0f} % of the squared deviation of play lies at the '
        '{local_share_of_points.percent:.0f} % of points near a reversal, as half the gap '
        'stays until the next one; as written it is {local_share_written.percent:.0f} %',
        ('local_share_play', 'local_share_of_points', 'local_share_written'),
        "backlash is the paper's one-sample formula, not play",
        lambda m: m['local_share_written'] > 0.9,
    ),
    Rule(
        'backlash_reversals',
        'Frequent reversals make backlash accumulate',
        'IV.iv, V.iv',
        lambda m: m['more_reversals_mean_play'] > 1.1,
        'from 2 to 20 reversals the mean deviation of play changes by the factor '
        '{more_reversals_mean_play:.2f}; as written by {more_reversals_mean_written:.1f}, but '
        'then twice the sample rate makes it {finer_mean_written:.2f} of itself',
        ('more_reversals_mean_play', 'more_reversals_mean_written', 'finer_mean_written'),
        "backlash is the paper's one-sample formula, not play",
        lambda m: m['more_reversals_mean_written'] > 1.1,
    ),
    Rule(
        'backlash_profile',
        'S of backlash is larger on aggressive than on smooth motion',
        'V.iv',
        lambda m: m['play_peak_ratio'] > 1.01,
        'peak deviation of play, aggressive to smooth: {play_peak_ratio:.2f}; rms '
        '{play_rms_ratio:.2f}: half the gap on either motion; but passes over one place lie '
        '{play_spread_aggressive_m.mm:.2f} mm apart, smooth {play_spread_smooth_m.mm:.3f} mm',
        (
            'play_peak_ratio',
            'play_rms_ratio',
            'play_mean_ratio',
            'play_spread_smooth_m',
            'play_spread_aggressive_m',
        ),
        'the spread of passes over one place is meant, not peak or rms',
        lambda m: m['play_spread_aggressive_m'] > 2.0 * m['play_spread_smooth_m'],
    ),
    Rule(
        'proportional',
        'D_norm is proportional to |J| times the angular error',
        'IV.v',
        lambda m: max(abs(m['linear_departure_max']), abs(m['linear_departure_min'])) < 0.01,
        'single joints to 0.5 deg: proportional within {linear_departure_min.size:.0e}, 1 % '
        'off only from {linear_end_rad.degrees:.0f} deg; |J| is the upper bound, random '
        'offsets reach {bound_low.low:.2f} to {bound_high.high:.2f} of it',
        (
            'linear_departure_min',
            'linear_departure_max',
            'linear_end_rad',
            'bound_low',
            'bound_high',
        ),
    ),
    Rule(
        'nonlinear_growth',
        'Larger angular errors are amplified nonlinearly',
        'IV.v, V.ii',
        lambda m: m['linear_departure_max'] > 0.01,
        'at 0.5 deg a joint is {linear_departure_max.ppm:.1f} ppm from proportional, a chord '
        'below its arc; all joints together {linear_departure_all.percent:+.2f} %',
        ('linear_departure_max', 'linear_departure_all'),
    ),
    Rule(
        'tenth_degree',
        'Less than 0.1 deg already moves the tool measurably',
        'IV.v',
        lambda m: m['tenth_degree_m'] > 1e-4,
        '0.1 deg on the joint with most leverage moves the tool by {tenth_degree_m.mm:.2f} mm',
        ('tenth_degree_m',),
    ),
    Rule(
        'distal',
        'Distal joints influence the deviation more than proximal ones',
        'V.ii',
        lambda m: m['distal_ratio'] > 1.0,
        'equal angles act by their lever arm: outer to inner half of the joints '
        '{distal_ratio:.2f}, {distal_ratio_torch:.2f} with a bent torch; rank correlation with '
        'the joint number {distal_rank:.2f}; orientation does not tell joints apart (spread '
        '{turn_spread:.0e})',
        ('distal_ratio', 'distal_ratio_torch', 'distal_rank', 'distal_rank_torch', 'turn_spread'),
    ),
    Rule(
        'angle_above_length',
        'S_theta is larger than S_a',
        'V.iii',
        lambda m: m['S_theta_least_m'] > m['S_a_max'],
        'in m/rad against m/m {S_theta_max_m:.2f} at most against {S_a_max:.2f}; per degree '
        'and mm {S_theta_max_m.mm_per_degree:.1f} against {S_a_max:.2f}: the unit decides, '
        'joints near the tool stay below in either',
        ('S_theta_max_m', 'S_theta_mean_m', 'S_theta_least_m', 'S_a_max'),
        'the joint has leverage and it is taken per degree against per mm',
        lambda m: m['S_theta_max_m'] * _DEGREE_IN_MM > m['S_a_max'],
    ),
    Rule(
        'length_bias',
        'Link lengths give a systematic bias, proportional to the error',
        'V.iii',
        lambda m: m['S_a_departure'] < _SAME and m['S_a_spread'] < _SAME,
        'proportional within {S_a_departure:.0e} and equally large along the seam (spread '
        '{S_a_spread:.0e}); its direction turns with the link',
        ('S_a_departure', 'S_a_spread'),
    ),
    Rule(
        'length_place',
        'The effect of a link length scales with its place in the chain',
        'V.iii',
        lambda m: m['S_a_max'] - m['S_a_min'] > 0.01,
        'S_a is {S_a_max:.3f} for every link of every robot: a longer link moves all that '
        'follows by as much',
        ('S_a_min', 'S_a_max'),
    ),
    Rule(
        'condition',
        'A high condition number of J means high sensitivity to joint errors',
        'II.ii',
        lambda m: m['condition_rank'] > 0.5 and m['condition_rank_anywhere'] > 0.5,
        'rank correlation of condition number and gain: along these seams '
        '{condition_rank:.2f}, as both grow while the arm stretches; over random postures '
        '{condition_rank_anywhere:.2f}: the condition number compares directions, the gain '
        'amplifies',
        ('condition_rank', 'condition_rank_anywhere', 'condition_max', 'gain_max'),
        'the arm stretches, so that both grow',
        lambda m: m['condition_rank'] > 0.5,
    ),
    Rule(
        'combined',
        'Combined errors deviate more than the sum of the single ones',
        'IV.vi, V.vi',
        lambda m: m['combined_exceeds'] > 0.5,
        'the triangle inequality forbids it to first order: peak over sum '
        '{combined_ratio_median:.2f} (median of 200 draws), at most '
        '{combined_ratio_max.high:.3f}; the coupling of errors is {coupling.percent:.2f} % of '
        'the deviation',
        ('combined_ratio_median', 'combined_ratio_max', 'combined_exceeds', 'coupling'),
    ),
    Rule(
        'drift_linear',
        'Cumulative drift of angular errors is linear in the path length',
        'V.vi',
        lambda m: abs(m['drift_exponent_angular'] - 1.0) < 0.05,
        'D_cum grows with the power {drift_exponent_angular:.2f} of the path: it is a sum of '
        'deviations that differ along the seam by {drift_spread_angular.percent:.0f} %, not an '
        'accumulation',
        ('drift_exponent_angular', 'drift_spread_angular'),
        'the lever arms change little along the seam',
        lambda m: (
            abs(m['drift_exponent_angular'] - 1.0) < 0.05 or m['drift_spread_angular'] > 0.05
        ),
    ),
    Rule(
        'drift_superlinear',
        'Combined errors make the drift grow faster than the path',
        'V.vi',
        lambda m: m['drift_exponent_combined'] > 1.05,
        'power of the path length: combined {drift_exponent_combined:.2f}, angular '
        '{drift_exponent_angular:.2f}, initialization {drift_exponent_init:.2f}',
        ('drift_exponent_combined', 'drift_exponent_angular', 'drift_exponent_init'),
    ),
    Rule(
        'ranking',
        'Angular errors > backlash > link length > initialization',
        'V.vii',
        lambda m: bool(m['rank_holds']),
        'total indices on the stated tolerances: angular {ST_angular:.2f}, backlash '
        '{ST_backlash:.2f}, length {ST_length:.2f}, initialization {ST_initial:.2f}; '
        'tolerances changed by up to 3 leave the order in {rank_share.percent:.0f} % of cases; '
        'per degree and mm it is {unit_angular:.1f} > {unit_backlash:.1f} > {unit_length:.0f} '
        '= {unit_initial:.0f}',
        (
            'ST_angular',
            'ST_backlash',
            'ST_length',
            'ST_initial',
            'ST_half',
            'rank_share',
            'rank_first_share',
            'unit_angular',
            'unit_backlash',
            'unit_length',
            'unit_initial',
        ),
        'coefficients are taken per degree and per mm (length and initialization tie)',
        lambda m: (
            m['unit_angular'] > m['unit_backlash'] > m['unit_length'] - 1e-9
            and m['unit_length'] > m['unit_initial'] - 1e-6
        ),
    ),
)

_HOLDS, _HOLDS_WHEN, _DOES_NOT = 'holds', 'holds when', 'does not hold'


class CaseName(NamedTuple):
    """Which robot on which seam."""

    robot: str
    seam: str


@dataclass(frozen=True)
class Claim:
    """A claim with its verdict."""

    key: str
    statement: str
    where: str
    verdict: str
    """'holds', 'holds when ...' with the condition, or 'does not hold'."""
    reason: str
    held: int
    """On how many of the cases the claim holds as written."""
    cases: int
    measured: dict[str, tuple[float, float]]
    """Least and largest value of every measurement behind it."""

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers and strings."""
        measured = {key: {'least': a, 'largest': b} for key, (a, b) in self.measured.items()}
        told = asdict(self)
        return {'claim': told.pop('key'), **told, 'measured': measured}


def judge(cases: Mapping[CaseName, _Measured]) -> tuple[Claim, ...]:
    """Return a verdict on every claim by the measurements of all cases; DataError for none."""
    if not cases:
        raise DataError('the claims need at least one robot on one seam')
    return tuple(_decide(rule, list(cases.values())) for rule in _RULES)


def _decide(rule: Rule, cases: Sequence[_Measured]) -> Claim:
    ranges = {key: _Range([case[key] for case in cases]) for key in cases[0]}
    held = sum(bool(rule.holds(case)) for case in cases)
    verdict = _DOES_NOT
    if held == len(cases):
        verdict = _HOLDS
    elif rule.holds_then is not None and all(rule.holds_then(case) for case in cases):
        verdict = f'{_HOLDS_WHEN} {rule.condition}'
    measured = {key: (ranges[key].low, ranges[key].high) for key in rule.shows}
    told = rule.key, rule.statement, rule.where, verdict, rule.reason.format_map(ranges)
    return Claim(*told, held, len(cases), measured)
