# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Sealed cells and seams whose promises are known to hold or not, and how often those held."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import Diagnosis
from weld_twin_core.diagnosis.algebra.fit import Fit, robust_fit
from weld_twin_core.diagnosis.algebra.problem import Model, Problem, Scale
from weld_twin_core.diagnosis.frames.aligned import aligned
from weld_twin_core.diagnosis.result import Shrink
from weld_twin_core.effects import effects_from_list
from weld_twin_core.effects.dated import seen_from
from weld_twin_core.errors import DataError, TwinError
from weld_twin_core.recording import Recording
from weld_twin_core.twin.directions import Directions, Discrepancy
from weld_twin_core.twin.domain import Domain
from weld_twin_core.twin.features import Features
from weld_twin_core.twin.posterior import (
    Drawn,
    Posterior,
    expected_poses,
    largest_sigma,
    pose_covariances,
)
from weld_twin_core.twin.program_correction import SURE, accuracy
from weld_twin_core.twin.twin import Twin

from ..belief.judged import true_shares
from ..belief.trial import diagnosed, drawn, recordings_of
from ..blind.blind_cell import GROSS, exact
from ..blind.cause_sizes import Cause, site, small_errors
from ..blind.making import SealedCase, one_arm
from ..blind.scoring import NORMAL_90, TO_90, counted, gap_on, measured_of, nominal_on, rms
from ..real_arms.unseen import flagged

PART = (0.005, 0.1)
"""Small errors, in parts of what machines have: a zero of 5 to 100 microradians, as an arm has it that
was calibrated well or never."""
PATH = 600
"""Poses of the middle of a sealed motion that are taken for a program: ten seconds of it."""
FEWEST = 15
"""Poses of a motion below which their share says nothing."""
ROUNDING = 1e-9
"""Of a true position [m]: a cell whose model is exact leaves no digits."""
Mask = NDArray[np.bool_]


def of_case(seed: int, number: int) -> dict[str, Any] | None:
    """Return what the promises of one sealed case are worth; None of one that has none."""
    try:
        case, poor, *_ = drawn(seed, number)
        case = one_arm(case)
    except DataError:
        return None
    named, case = case.causes, on_an_arm(case, seed, number)
    return of_drawn(f'{seed}/{number}', case, named, poor)[0]


def on_an_arm(case: SealedCase, seed: int, number: int) -> SealedCase:
    """Return a case whose arm is exact but for its causes, or, of every other number, is not."""
    if number % 2 == 0:
        return case
    rng = np.random.default_rng([seed, number, 1])
    part, there = float(np.exp(rng.uniform(*np.log(PART)))), set(map(site, case.causes))
    small = [own for own in small_errors(case.cell.robot, rng, part) if site(own) not in there]
    return replace(case, causes=[*case.causes, *small])


def of_drawn(
    name: str, case: SealedCase, named: Sequence[Cause], poor: str = ''
) -> tuple[dict[str, Any], Diagnosis | None]:
    """
    Return what all promises of one diagnosis are worth, and the diagnosis.

    named: those of the case that a diagnosis should name; the others are the arm's small errors.
    """
    exact_arm = len(named) == len(case.causes)
    entry: dict[str, Any] = {
        'name': name,
        'source': 'plant',
        'group': 'exact arms' if exact_arm else 'small errors everywhere',
        'kind': case.lot.kind,
        'motion': case.lot.motion,
        'poor': poor,
    }
    recordings = recordings_of(case)
    try:
        found = diagnosed(case, recordings)
    except DataError as error:
        return {**entry, 'refused': str(error)}, None
    entry['status'] = found.status
    if found.posterior is None:
        return entry, None
    promises = {
        f'shrink, {where}': [told] for where, told in _of_shrink(case, found, recordings[0])
    }
    if exact_arm and not case.cell.align and not case.also:
        promises['shares'] = list(_of_shares(case, found))
    promises['parameters'] = list(_of_parameters(named, found))
    # Without what jitters in stamps: how well somebody stamps a motion to come is no matter of a model.
    true = case.recorded('test', exact(case.cell.tracker))
    promises |= {kind: [told] for kind, told in _of_path(found, recordings[0], true)}
    regions = of_motion(found, recordings[0], true, case)
    return {**entry, **regions, 'promises': promises}, found


def of_motion(
    found: Diagnosis, train: Recording, test: Recording, case: SealedCase | None = None
) -> dict[str, Any]:
    """
    Return what regions of poses hold on a motion that was not recorded, inside and outside.

    found: of ``train``.
    train, test: the motion is seen where the tool really is.
    case: for an oracle, which knows its causes.
    """
    good, out = within(test), {}
    for region, mask in _regions(found, test, good):
        out[region] = held(found, train, test, np.full(good.size, ROUNDING), mask)
        out[region] |= {} if case is None else oracle_sigma(case, (train, test), mask)
    return out


def _regions(found: Diagnosis, test: Recording, good: Mask) -> Iterator[tuple[str, Mask]]:
    """Yield which good measurements lie inside of what was recorded, and outside, where enough do."""
    assert found.posterior is not None
    beyond = flagged(found.posterior, test, measured_of(test).t)
    for region, mask in (('inside', good & ~beyond), ('outside', good & beyond)):
        if mask.sum() >= FEWEST:
            yield region, mask


def _of_path(
    found: Diagnosis, train: Recording, test: Recording
) -> Iterator[tuple[str, dict[str, Any]]]:
    """
    Yield what is promised of a sealed motion as if it were a program, and what came of it [m].

    As it is meant by the nominal arm, before; and where the model has the tool, after. RMS over the
    way, and the largest distance that is kept with 95 %: the user's tolerance.
    """
    measured, posterior = measured_of(test), found.posterior
    assert posterior is not None
    here = np.flatnonzero(dict(_regions(found, test, within(test))).get('inside', False))
    here = here[max(here.size - PATH, 0) // 2 :][:PATH]
    if not here.size:
        return
    t, real = measured.t[here], measured.position[here]
    twin = twin_for(found.model, train, test)
    foretold, nominal = (each.poses(test, t).position for each in (twin, Twin(twin.robot)))
    drawn = Drawn(np.arange(t.size), posterior.drawn(Features(twin, test, t)))
    for when, wanted in (('before', nominal), ('after', foretold)):
        told = accuracy([wanted - foretold], [drawn])
        assert told is not None
        assert told.worsts is not None
        off = np.linalg.norm(wanted - real, axis=1)
        yield f'path {when}', {'ci90': list(told.same or ()), 'true': rms(wanted - real)}
        sure = float(np.quantile(told.worsts[0], SURE))
        yield f'path {when}, within (95 %)', {'ci90': [0.0, sure], 'true': float(off.max())}


def _of_shrink(
    case: SealedCase, found: Diagnosis, train: Recording
) -> Iterator[tuple[str, dict[str, Any]]]:
    """
    Yield the shrink that is told, and that on the sealed motion, inside and outside.

    It is told of a motion. Of the lesser part of one, a few samples in a corner perhaps, it says less:
    such parts are counted by themselves.
    """
    test = case.recorded('test')
    assert found.shrink is not None
    bare = nominal_on(case.cell.robot, found.model.known, train, case.cell.align)
    before, after = (np.linalg.norm(gap_on(m, test), axis=1) for m in (bare, found.model))
    # An instrument's outliers are nobody's shrink.
    good = within(test) & (after < GROSS * np.median(after))
    for region, mask in _regions(found, test, good):
        true = rms(after[mask, None]) / rms(before[mask, None])
        part = '' if 2 * mask.sum() > good.sum() else 'a part '
        yield f'{part}{region}', told_shrink(found.shrink, true, region)


def told_shrink(told: Shrink, true: float, region: str) -> dict[str, Any]:
    """Return the shrink that is told, its interval as 90 % and as it stands, and the true one."""
    ends = told.ci95 if region == 'inside' else told.elsewhere_ci95
    assert ends is not None
    low, high = (max(end, ROUNDING) for end in ends)
    ratio = max(told.ratio, ROUNDING)
    narrow = [float(ratio * (end / ratio) ** TO_90) for end in (low, high)]
    return {'told': ratio, 'ci90': narrow, 'ci95': [low, high], 'true': true}


def _of_shares(case: SealedCase, found: Diagnosis) -> Iterator[dict[str, Any]]:
    """Yield the share of every cause that is named rightly, its interval and its true share."""
    sites = [site(cause) for cause in case.causes]
    true = dict(zip(sites, true_shares(case), strict=True)) if sites else {}
    for cause in found.causes:
        named = (cause.name[0][0].effect, cause.name[0][0].joint) if cause.name else None
        if named in true:
            yield {'ci90': list(cause.share_ci90), 'true': true[named]}


def _of_parameters(named: Sequence[Cause], found: Diagnosis) -> Iterator[dict[str, Any]]:
    """Yield every parameter of a cause that is named rightly: its interval and its true value."""
    true = {site(cause): cause for cause in named}
    for told in found.effects:
        cause = true.get((told.effect.name, told.effect.site))
        values: Mapping[str, Any] = told.effect.to_mapping()
        if cause is None:
            continue
        for name, std in told.std.items():
            if isinstance(cause.get(name), float) and np.ndim(std) == 0 and std is not None:
                half = NORMAL_90 * float(std)
                value = float(values[name])
                yield {'ci90': [value - half, value + half], 'true': cause[name]}


HOLD = 0.9
"""Share of the errors that a region promises to hold."""


def inside_region(errors: Array, covariances: Array, sigma: Array) -> Mask:
    """
    Return which errors (M, 3) [m] lie in their 90 % region, shape (M,).

    sigma: noise of the instrument per axis, shape (M,) [m]; it comes on top.
    """
    whole = covariances + (sigma**2)[:, None, None] * np.eye(3)
    solved = np.linalg.solve(whole, errors[..., None])[..., 0]
    return np.asarray((errors * solved).sum(axis=1) <= chi2.ppf(HOLD, 3))


def held(
    diagnosis: Diagnosis,
    train: Recording,
    other: Recording,
    sigma: Array,
    good: Mask | None = None,
) -> dict[str, Any]:
    """
    Return how well the regions hold on a recording that was not fitted, as plain JSON values.

    sigma: the instrument's noise at the other's measurements, shape (M,) [m].
    good: measurements that count, shape (M,).
    """
    posterior, measured = diagnosis.posterior, measured_of(other)
    assert posterior is not None
    twin = twin_for(diagnosis.model, train, other)
    use = within(other) if good is None else good & within(other)
    t = measured.t[use]
    expected, covariances = expected_poses(posterior, twin, other, t)
    errors = measured.position[use] - expected.position
    regions = inside_region(errors, covariances[:, :3, :3], sigma[use])
    flags = flagged(posterior, other, t)
    size = np.linalg.norm(errors, axis=1)
    return {
        'poses': int(t.size),
        'held': _mean(regions),
        'flagged': _mean(flags),
        'held_unflagged': _mean(regions[~flags]),
        'held_flagged': _mean(regions[flags]),
        'mean_error_m': _mean(size),
        'median_sigma_m': float(np.median(largest_sigma(covariances))) if t.size else None,
        'largest_error_m': float(size.max()) if t.size else None,
    }


def twin_for(model: Model, train: Recording, other: Recording) -> Twin:
    """Return the model of a recording for another."""
    found = seen_from(model.found, train.epoch_ns, train.span_ns, other)
    return Model(model.robot, model.bases[:1], model.known, found).twin(0)


def within(other: Recording) -> Mask:
    """Return which measurements lie inside the joint stream, shape (M,)."""
    inside = np.asarray(counted(other, []), dtype=bool)
    return np.ones_like(inside) if other.joints.static else inside


def _mean(values: Array | Mask) -> float | None:
    return float(np.mean(values)) if values.size else None


UNSEEN = 1e-9
"""Least size of a column in noises; one that does nothing in the recording counts as known."""
STEPS = 40
"""Halvings in which the size of what the oracle misses is sought; far below rounding."""


def oracle_sigma(
    case: SealedCase, pair: tuple[Recording, Recording], mask: NDArray[np.bool_]
) -> dict[str, float]:
    """
    Return the median of the largest standard deviation of position [m], by two measures, or nothing.

    Least squares with the true causes and the true noise, on the recording that the diagnosis had.
    ``formal_sigma_m`` is its covariance alone, as if real gears and drives were no richer than the
    textbook. ``oracle_sigma_m`` adds, alike in all directions, just as much as makes its regions
    hold nine of ten true poses of the very motion that is predicted: nobody who is right nine times
    in ten can be narrower by the same model.

    pair: what is fitted, and the motion that is predicted, seen where the tool really is.
    """
    train, other = pair
    cell = case.cell
    try:
        causes, known = (
            tuple(effects_from_list([dict(one) for one in some], cell.robot))
            for some in (case.causes, cell.known)
        )
    except TwinError:
        return {}
    problem, start = aligned([train], cell.robot, frozenset(cell.align), known)
    found, scale = robust_fit(problem, start.with_found(causes))
    own = replace(scale, position=cell.tracker.sigma)
    posterior = _posterior(problem, found, own, train)
    if not posterior.directions.count:
        return {}
    at = measured_of(other).t[mask]
    twin = twin_for(found.model, train, other)
    covariances = pose_covariances(posterior, twin, other, at)[:, :3, :3]
    errors = measured_of(other).position[mask] - twin.poses(other, at).position
    missed = _missed(errors, covariances)
    return {
        'formal_sigma_m': float(np.median(largest_sigma(covariances))),
        'oracle_sigma_m': float(np.median(largest_sigma(covariances + missed * np.eye(3)))),
    }


def _posterior(problem: Problem, found: Fit, scale: Scale, train: Recording) -> Posterior:
    """Return the fitted coordinates and their covariance; what nothing shows counts as known."""
    frames = tuple(frame for frame in ('base', 'tool') if frame in problem.align)
    what = Directions(frames, 1, found.model.found)
    features = problem.features(found.model)
    rows = problem.whitened(
        [problem.seen(k, what.columns(maker, k)) for k, maker in enumerate(features)], scale
    )
    size = np.maximum(np.linalg.norm(rows, axis=1), UNSEEN)
    unit = rows / size[:, None]
    covariance = np.linalg.pinv(unit @ unit.T, rcond=1e-12, hermitian=True) / np.outer(size, size)
    robot = found.model.robot
    none = Discrepancy(0.0, 0.0, np.zeros(robot.n), np.zeros(robot.n), 1.0)
    middle = 0.5 * (covariance + covariance.T)
    return Posterior(what, np.zeros(what.count), middle, none, Domain.of([train], robot))


def _missed(errors: Array, covariances: Array) -> float:
    """Return the least variance per axis [m^2] that makes regions hold as many errors as they shall."""

    def held(variance: float) -> bool:
        wider = np.full(len(errors), np.sqrt(variance))
        return bool(inside_region(errors, covariances, wider).mean() >= HOLD)

    low, high = 1e-18, max(1e-18, float((errors**2).sum(axis=1).max()))
    for _ in range(STEPS):
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if held(middle) else (middle, high)
    return high
