# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What somebody could be sure of who knows the plant: a bound on how often an answer can be right and sure.

The oracle draws other causes as the cases are drawn, moves the plant with them, and weighs each against
the cause at work on the same recordings: importance sampling, with Laplace's weight about each draw. It
knows how large causes are, which families there are, the noise, how many causes are at work and all of
them but one. So it is surer than anybody can be who has to find these out.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from math import lgamma, log, pi
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from weld_twin_core.arrays import Array

from ..blind.blind_cell import BlindCell, Take, deviation, exact, record
from ..blind.cause_sizes import CAUSES, FAMILIES, MOVING, SIZES, Cause, plausible, scaled, site
from ..blind.cause_sizes import draw as drawn_cause
from ..blind.making import STRATA, SealedCase
from ..blind.scoring import rms
from .judged import STEP, TURNING, alike_by_structure, changed, fitted, frame_columns, moved
from .trial import COMMON, OFTEN, SEVERAL, drawn

DRAWS = 2
"""Causes drawn of each family at each joint: phases and instants differ; sizes are fitted."""
PATIENCE = 12
"""Draws for each joint until all joints are thought to have theirs."""
HOPELESS = 400.0
"""Chi-square above that of the truth from which a cause with one number is not looked at further."""
NEAR = 60.0
"""Chi-square above that of the truth from which a cause has no weight: exp(-30)."""
AS_WELL = 0.32
"""RMS [noise] by which an answer may differ on the sealed motion: it leaves 1.05 noise instead of 1."""
WIDE = 1.15
"""Factor by which a size may leave the strata that sizes are drawn from."""
FLAT = log(STRATA[-1][1] / STRATA[0][0])
"""Width of the even prior over the logarithm of a size."""


class _Bench(NamedTuple):
    """The recordings of a case as the oracle looks at them; rows are over their noise."""

    cell: BlindCell
    """Nothing is aligned in it: frames are columns here."""
    takes: tuple[Take, ...]
    """The recordings diagnosed, and then the sealed one."""
    seen: int
    """Rows of those diagnosed."""
    sealed: slice
    """Rows of the sealed positions."""
    y: Array
    """What was measured, (rows,); on the sealed motion the truth without noise."""
    beside: list[Cause]
    """All causes but the one that is asked for."""
    without: Array
    """What these alone move, (rows,)."""
    nuisance: Array
    """Columns of frames and of the other causes, (rows, p)."""


class _Weighed(NamedTuple):
    """A cause held against what was measured."""

    chi2: float
    log_weight: float
    predicted: Array
    """On all rows."""


def certainty(seed: int, number: int, mix: str) -> float | None:
    """
    Return how sure the oracle is of all causes of a case; None where it is not asked.

    It is asked of cases with one and two causes in the library. A cause that no motion tells from
    the one at work, or that predicts the sealed motion as well, counts as right.

    seed, number, mix: of the case, as `trial.tried` takes them.
    """
    case = drawn(seed, number, mix).case
    if case.lot.kind not in ('single', 'double', 'several') or not 1 <= len(case.causes) <= 2:
        return None
    rng = np.random.default_rng([seed, 5000 + number])
    return float(np.prod([of_one(case, k, mix, rng) for k in range(len(case.causes))]))


def of_one(case: SealedCase, k: int, mix: str, rng: np.random.Generator) -> float:
    """Return the posterior probability of one cause, the others known."""
    bench, own = _bench(case, k, rng), case.causes[k]
    wanted = rms(deviation(case.cell, [own], case.train)) / case.cell.noise
    whole = moved(bench.cell, [*bench.beside, own], bench.takes)
    *_, true = _refined(bench, own, whole)
    alike = alike_by_structure(case.lot.robot, site(own))
    right = [true.log_weight + _log_prior(case, own['effect'], mix)]
    wrong: list[float] = []
    for cause, log_prior in _others(case, mix, site(own), rng):
        # Some causes need a wrench or a temperature that this cell has not, or cannot be simulated.
        with suppress(ValueError, FloatingPointError):
            size = rms(deviation(case.cell, [cause], case.train)) / case.cell.noise
            factor = wanted / max(size, 1e-9)
            factor = factor if plausible(case.cell.robot, cause, factor) else 1.0
            other = _weighed(bench, scaled(cause, factor), size * factor, true.chi2)
            if other is not None:
                off = (other.predicted - true.predicted)[bench.sealed].reshape(-1, 3)
                as_good = site(cause) in alike or rms(off) / np.sqrt(3.0) < AS_WELL
                (right if as_good else wrong).append(other.log_weight + log_prior)
    return float(np.exp(logsumexp(right) - logsumexp([*right, *wrong])))


def _bench(case: SealedCase, k: int, rng: np.random.Generator) -> _Bench:
    cell = replace(case.cell, align=())
    takes = (case.train, *case.also, case.test)
    beside = [*case.causes[:k], *case.causes[k + 1 :]]
    whole = moved(cell, [*beside, case.causes[k]], takes)
    seen = whole.size - moved(cell, (), takes[-1:]).size
    columns = [
        (moved(cell, new, takes) - whole) / STEP
        for j in range(len(beside))
        for new in changed([*beside, case.causes[k]], j)
    ]
    columns += frame_columns(cell, takes, case.cell.align)
    y = whole.copy()
    y[:seen] += rng.standard_normal(seen)
    nuisance = np.array(columns).T if columns else np.zeros((whole.size, 0))
    count = 3 * len(record(cell, (), case.test, exact(cell.tracker)).position)
    sealed, without = slice(seen, seen + count), moved(cell, beside, takes)
    return _Bench(cell, takes, seen, sealed, y, beside, without, nuisance)


def _weighed(bench: _Bench, cause: Cause, ratio: float, best: float) -> _Weighed | None:
    """Return the weight of another cause, ``ratio`` times the noise; None where it has none."""
    whole, sizes = moved(bench.cell, [*bench.beside, cause], bench.takes), SIZES[cause['effect']]
    one_number = len(sizes) == 1 and np.ndim(cause[sizes[0]]) == 0
    if one_number and cause['effect'] not in TURNING:
        alone = (whole - bench.without)[:, None]
        if _solved(bench, bench.without, alone)[0] > best + HOPELESS:
            return None
    given, own, weighed = _refined(bench, cause, whole)
    growth = float(np.linalg.norm(own) / np.linalg.norm(given))
    possible = STRATA[0][0] / WIDE < ratio * growth < STRATA[-1][1] * WIDE
    possible = possible and (_signed(cause) or own[0] >= 0.0)
    return weighed if possible and weighed.chi2 <= best + NEAR else None


def _refined(bench: _Bench, cause: Cause, whole: Array) -> tuple[Array, Array, _Weighed]:
    """Return the sizes of a cause as given and as fitted, in units of its columns, and its weight."""
    changes = changed([*bench.beside, cause], len(bench.beside))
    columns = [(moved(bench.cell, new, bench.takes) - whole) / STEP for new in changes]
    chi2, step, predicted, volume = _solved(bench, whole, np.array(columns).T)
    sizes = np.concatenate([_scaled(cause, key) for key in SIZES[cause['effect']] if key in cause])
    own = sizes + step[: sizes.size]
    half_lines = log(2.0) + 0.5 * sizes.size * log(pi) - lgamma(0.5 * sizes.size)
    directions = half_lines if _signed(cause) else 0.0
    turns = (step.size - sizes.size) * log(2.0 * pi)
    radius = max(float(np.linalg.norm(own)), 1e-9)
    density = -log(FLAT) - directions - sizes.size * log(radius) - turns
    return sizes, own, _Weighed(chi2, density + volume - 0.5 * chi2, predicted)


def _signed(cause: Cause) -> bool:
    count = sum(np.size(cause[key]) for key in SIZES[cause['effect']] if key in cause)
    return CAUSES[cause['effect']].signed or count > 1


def _scaled(cause: Cause, key: str) -> Array:
    """Return a size in the unit of the columns: its largest number."""
    value = np.atleast_1d(np.asarray(cause[key], dtype=float))
    return np.asarray(value / np.abs(value).max())


def _solved(bench: _Bench, whole: Array, columns: Array) -> tuple[float, Array, Array, float]:
    """Return chi-square, coefficients of columns (rows, k), prediction, log volume of the posterior."""
    seen, design = slice(bench.seen), np.concatenate([columns, bench.nuisance], axis=1)
    gap = bench.y - whole
    step = fitted(design[seen], gap[seen])
    residual = gap - design @ step
    basis = np.linalg.qr(bench.nuisance[seen])[0]
    bare = columns[seen] - basis @ (basis.T @ columns[seen])
    sizes = np.maximum(np.linalg.svd(bare, compute_uv=False), 1e-3)
    volume = float(0.5 * sizes.size * log(2.0 * pi) - np.log(sizes).sum())
    chi2 = float((residual[seen] ** 2).sum())
    return chi2, step[: columns.shape[1]], bench.y - residual, volume


def _log_prior(case: SealedCase, family: str, mix: str) -> float:
    """Return the log prior of a family at one of its joints, up to what is the same for all."""
    often = OFTEN if mix == SEVERAL and family in COMMON else 1
    return log(often) - (log(case.cell.robot.n) if 'joint' in _any(case, family) else 0.0)


def _any(case: SealedCase, family: str) -> Cause:
    return drawn_cause(family, case.cell.robot, 1.0, np.random.default_rng(0))


def _others(
    case: SealedCase, mix: str, own: tuple[str, str | None], rng: np.random.Generator
) -> Iterator[tuple[Cause, float]]:
    """Yield causes drawn at every other place, with the log prior of each."""
    robot, t = case.cell.robot, case.train.command.t
    fitted = {f'{frame}_pose' for frame in case.cell.align}
    still = MOVING if all(taken.command.static for taken in (case.train, *case.also)) else ()
    for family in FAMILIES:
        if family in fitted or family in still:
            continue
        by_joint: dict[str | None, list[Cause]] = {}
        for _ in range(PATIENCE * robot.n if 'joint' in _any(case, family) else DRAWS):
            cause = drawn_cause(family, robot, float(t[-1] - t[0]), rng)
            kept = by_joint.setdefault(cause.get('joint'), [])
            if len(kept) < DRAWS and site(cause) != own:
                kept.append(cause)
        share = _log_prior(case, family, mix) - log(DRAWS)
        yield from ((cause, share) for kept in by_joint.values() for cause in kept)
