# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Sealed cases of the plant: what is promised of poses, of the shrink, of shares and of parameters.

Every other case has all small errors that arms have, besides its causes: a model that is sharp because
nothing else acts would be wrong there. Poses are held against where the plant's tool really is, which no
instrument says: beside the noise of an instrument a promise that is ten times too narrow would show as
little as one ten times too wide.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from weld_twin_core.diagnosis import Diagnosis
from weld_twin_core.diagnosis.result import Shrink
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Recording
from weld_twin_core.twin.features import Features
from weld_twin_core.twin.posterior import Drawn
from weld_twin_core.twin.program_accuracy import SURE, accuracy
from weld_twin_core.twin.twin import Twin

from ..belief.mix import drawn
from ..belief.trial import diagnosed, recordings_of
from ..belief.visible import true_shares
from ..blind.blind_cell import GROSS, as_recording, exact, record
from ..blind.cause_sizes import Cause, site, small_errors
from ..blind.displacement import NORMAL_90, TO_90, gap_on, nominal_on, rms
from ..blind.making import SealedCase, one_arm
from ..real_arms.unseen import flagged
from .held import held, oracle_sigma, twin_for, within

PART = (0.005, 0.1)
"""Small errors, in parts of what machines have: a zero of 5 to 100 microradians, as an arm has it that
was calibrated well or never."""
PATH = 600
"""Poses of the middle of a sealed motion that are taken for a program: ten seconds of it."""
FEWEST = 15
"""Poses of a motion below which their share says nothing."""
ROUNDING = 1e-9
"""Of a true position [m]: a cell whose model is exact leaves no digits."""


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
    return replace(case, causes=[*case.causes, *_besides(case, seed, number)])


def of_drawn(
    name: str, case: SealedCase, named: Sequence[Cause], poor: str = ''
) -> tuple[dict[str, Any], Diagnosis | None]:
    """
    Return what all promises of one diagnosis are worth, and the diagnosis.

    named: those of the case that a diagnosis should name; the others are the arm's small errors.
    poor: how the motion was made poor.
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
    true = true_test(case)
    promises |= {kind: [told] for kind, told in _of_path(found, recordings[0], true)}
    regions = of_motion(found, recordings[0], true, case)
    return {**entry, **regions, 'promises': promises}, found


def _besides(case: SealedCase, seed: int, number: int) -> list[Cause]:
    """Return small errors at all places where no cause of a case is."""
    rng = np.random.default_rng([seed, number, 1])
    part, robot = float(np.exp(rng.uniform(*np.log(PART)))), case.cell.robot
    there = {site(cause) for cause in case.causes}
    return [cause for cause in small_errors(robot, rng, part) if site(cause) not in there]


def of_motion(
    found: Diagnosis, train: Recording, test: Recording, case: SealedCase | None = None
) -> dict[str, Any]:
    """
    Return what regions of poses hold on a motion that was not recorded, inside and outside.

    found: of ``train``.
    train, test: the motion is seen where the tool really is.
    case: for an oracle, which knows its causes.
    """
    assert test.measured is not None
    assert found.posterior is not None
    beyond = flagged(found.posterior, test, test.measured.t)
    good, sigma = within(test, test.measured), np.full(test.measured.t.size, ROUNDING)
    out = {}
    for region, mask in (('inside', good & ~beyond), ('outside', good & beyond)):
        if mask.sum() >= FEWEST:
            out[region] = held(found, train, test, sigma, mask)
            out[region] |= {} if case is None else oracle_sigma(case, (train, test), mask)
    return out


def _of_path(
    found: Diagnosis, train: Recording, test: Recording
) -> Iterator[tuple[str, dict[str, Any]]]:
    """
    Yield what is promised of a sealed motion as if it were a program, and what came of it [m].

    As it is meant by the nominal arm, before; and where the model has the tool, after. RMS over the
    way, and the largest distance that is kept with 95 %: the user's tolerance.
    """
    measured, posterior = test.measured, found.posterior
    assert measured is not None
    assert posterior is not None
    inside = within(test, measured) & ~flagged(posterior, test, measured.t)
    here = np.flatnonzero(inside)
    here = here[max(here.size - PATH, 0) // 2 :][:PATH]
    if here.size < FEWEST:
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


def true_test(case: SealedCase) -> Recording:
    """
    Return the sealed motion as it is, seen where the tool really is.

    Without what jitters in stamps: how well somebody stamps a motion to come is no matter of a model.
    """
    return as_recording(
        'test', record(case.cell, case.causes, case.test, exact(case.cell.tracker))
    )


def _of_shrink(
    case: SealedCase, found: Diagnosis, train: Recording
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the shrink that is told, and that on the sealed motion, inside and outside."""
    test = as_recording('test', record(case.cell, case.causes, case.test))
    assert test.measured is not None
    assert found.shrink is not None
    assert found.posterior is not None
    bare = nominal_on(case.cell.robot, found.model.known, train, case.cell.align)
    before, after = (np.linalg.norm(gap_on(m, test), axis=1) for m in (bare, found.model))
    # An instrument's outliers are nobody's shrink.
    good = within(test, test.measured) & (after < GROSS * np.median(after))
    beyond = flagged(found.posterior, test, test.measured.t)
    for region, mask in (('inside', good & ~beyond), ('outside', good & beyond)):
        if mask.sum() >= FEWEST:
            true = rms(after[mask, None]) / rms(before[mask, None])
            yield region, told_shrink(found.shrink, true, region)


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
