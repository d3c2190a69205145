# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How sure a twin is of its poses: a Gaussian over frames and effects, carried to the tool.

A fitted model is one point in a cloud of models that the recordings allow. The cloud is a Gaussian
over the coordinates of the frames and of every effect that an arm of this kind may have, found or
not: narrow in directions that the recordings have shown, as wide as such arms differ in the
others. To first order the covariance of a pose is that cloud seen through the twin's derivatives.
On top comes a discrepancy, what no parameter explains. Beyond what was recorded all of it is larger,
for a model's own account is of the causes that it has. Of one joint state at a time it is told at a
cost that a control cycle can bear.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from ..arm.robot import Robot
from ..arrays import Array, halton, readonly
from ..effects.dated import from_now_on
from ..effects.effect import Effect
from ..effects.geometry import BasePose, FrameError, ToolPose
from ..errors import DataError, ModelError
from ..recording import JointMotion, JointSignal, Recording, Signal
from .compensation import commandable
from .directions import Directions, Discrepancy, Where
from .domain import Domain
from .features import Features, jumps, with_expected_effort
from .goal_motion import just_turned
from .poses import Poses
from .twin import Twin

_DRAWS = 400
"""Models drawn: enough for the 5th and 95th of a hundred to be steady within a few per cent."""
_PLACES = 300
"""Places of a motion at which models are drawn; between them what a model is off by hardly changes."""
_ALIKE = 1.0
"""Postures so near [rad or m] err alike in what no parameter explains. A judgement: on seven sealed
cells it held as many paths as one shift all along, with intervals a fifth narrower; 0.3 held fewer."""
_WAVES = 256
"""Functions of posture that it is drawn from."""
_SEED = 0
"""Of the draws: every promise is made of the same models."""
_CHUNK = 2000
"""Samples at once; a hundred coordinates of so many poses take some ten megabytes."""
_SETTLED = 1e-13
"""Share of the largest variance, coordinates at unit size, below which a direction is certain."""


class Expected(NamedTuple):
    """Where models have the tool, all together."""

    shift: Array
    """Of their middle from the twin's pose, shape (M, 6) [m, rad], turns about the world's axes."""
    covariance: Array
    """Of the true pose about that, shape (M, 6, 6)."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """The models that the recordings allow, about the one that was fitted."""

    directions: Directions
    mean: Array
    """Where the middle of the allowed models lies, counted from the fitted one, shape (P,)."""
    covariance: Array
    """Shape (P, P)."""
    discrepancy: Discrepancy
    domain: Domain
    """What was recorded."""
    left_open: tuple[str, ...] = ()
    """Directions that the recordings do not show, in words; they are as they were given."""
    recorded_m: float = 0.0
    anywhere_m: float = 0.0
    """Standard deviation of position in its worst direction [m], in the middle of the postures
    that were recorded and of those that the joints' limits allow."""
    prior_std: Array | None = None
    """Standard deviation of every coordinate on machines at large, shape (P,)."""
    single: tuple[Array, Array] | None = None
    """Mean and covariance under that one prior, of which it can be taken off again: what the data
    alone say, shape (P,), array, shape (P, P)). ``mean`` and ``covariance`` are weighed over
    many."""
    region: tuple[str, float] | None = None
    """A region that was asked for, as it was given, and the same standard deviation there [m]."""
    middle: float = 0.0
    """How far to go from the fitted model to the middle to predict best, from 0 to 1."""

    def __post_init__(self) -> None:
        count = self.directions.count
        object.__setattr__(self, 'mean', readonly(self.mean, (count,), 'posterior mean'))
        covariance = readonly(self.covariance, (count, count), 'posterior covariance')
        size = np.abs(covariance).max(initial=0.0)
        if np.abs(covariance - covariance.T).max(initial=0.0) > 1e-9 * size:
            raise DataError('the posterior covariance is not symmetric')
        object.__setattr__(self, 'covariance', covariance)

    @cached_property
    def factor(self) -> Array:
        """Return a factor S (P, R) with S S' the covariance; DataError where a variance is negative."""
        size = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        unit = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)
        # At unit size, so that metres and radians, open and settled coordinates weigh alike.
        values, vectors = np.linalg.eigh(self.covariance * np.outer(unit, unit))
        most = max(float(values.max(initial=0.0)), 1e-300)
        if values.min(initial=0.0) < -1e-6 * most:
            raise DataError('the posterior covariance has a negative variance')
        live = values > _SETTLED * most
        return np.asarray(size[:, None] * vectors[:, live] * np.sqrt(values[live]))

    def pose_covariance(self, features: Features, setup: int = 0) -> Array:
        """
        Return the second moment of the true pose about the twin's, shape (M, 6, 6).

        Position first [m^2], then turns about the world's fixed axes [rad^2]; without the noise
        of the instrument that will measure it.

        Raises ModelError: there is no such base frame.
        """
        return _spread(*self._ways(features, setup))

    def expected(self, features: Features, setup: int = 0) -> Expected:
        """
        Return where the models allowed have the tool, all together, counted from the twin's pose.

        The twin has what is named. Their middle has a little of all else besides, and errs less.

        Raises ModelError: there is no such base frame.
        """
        moved, rest, grown = self._ways(features, setup)
        return Expected(moved[-1].T, _spread(moved[:-1], rest, grown))

    def position_ways(self, features: Features, setup: int = 0) -> tuple[Array, Array]:
        """
        Return in which ways positions may be off (M, 3, R) [m], and the rest's covariance (M, 3, 3).

        One column for each independent way, of one standard deviation: what more measurements would
        take away. The rest is what no parameter explains.
        """
        moved, rest, grown = self._ways(features, setup)
        ways = (moved[:, :3] * grown).transpose(2, 1, 0)
        return ways, rest[:, :3, :3] * grown[:, None, None] ** 2

    def _ways(self, features: Features, setup: int) -> tuple[Array, Array, Array]:
        # A twin that is not the middle of what is allowed is off by that much too: the last way.
        ways = np.column_stack([self.factor, self.mean])
        moved = np.tensordot(ways, self._columns(features, setup), axes=(0, 0))
        here = self._where(features)
        return moved, self.discrepancy.covariance(here), self.discrepancy.grown(here)

    def doubt(self, effect: Effect, instead: Collection[tuple[str, str]] = ()) -> Array:
        """
        Return how far the coordinates of a fitted effect may be off, as standard deviations, (K,).

        Zero where the models differ by other coordinates than its own, as waves of a joint do.

        effect: of the fitted model.
        instead: names and joints of effects that may be at work in its place. Its size is given for
        the case that it is the one and they are not, so it is that given theirs (conditional
        covariance and mean of a normal vector, e.g. Bishop 2006, eq. 2.81): what the fitted model
        has of them would be its own.
        """
        what = self.directions
        for mine, here in zip(what.effects, what.own, strict=True):
            if mine.key != effect.key or effect.traits.waves is not None:
                continue
            if here.stop - here.start != effect.fit.coordinates().size:
                continue
            others = [
                np.arange(there.start, there.stop)
                for other, there in zip(what.effects, what.own, strict=True)
                if other is not mine and other.key[:2] in instead
            ]
            square = self.covariance + np.outer(self.mean, self.mean)
            size = np.sqrt(np.diag(square)) + np.finfo(float).tiny  # units differ by millions
            square /= np.outer(size, size)
            given = np.concatenate([np.zeros(0, dtype=int), *others])
            shared = square[here, given]
            known = shared @ np.linalg.pinv(square[np.ix_(given, given)], hermitian=True)
            theirs = known @ (what.fitted()[given] / size[given])
            variance = np.diag(square[here, here] - known @ shared.T) + theirs**2
            return np.asarray(size[here] * np.sqrt(np.maximum(variance, 0.0)))
        return np.zeros(effect.fit.coordinates().size)

    def of_the_arm(self) -> Posterior:
        """
        Return how sure the tool's own poses are on a motion to come, which nobody measures.

        What was found of the instrument, its clock and the set-up stays with the recording, and so does
        what grew while it lasted; what slipped is as it was after that (`from_now_on`). The
        middle of the allowed models may hold less of it than the fit, and more of the arm in its
        place: counted together, the two would cancel.
        """
        what = self.directions
        stays = [commandable(effect) and bool(from_now_on([effect])) for effect in what.effects]
        own = np.repeat(stays, what.sizes).astype(bool)
        keep = np.concatenate([np.ones(what.frame_count, bool), own, np.ones(what.shapes, bool)])
        effects = (e for e, stay in zip(what.effects, stays, strict=True) if stay)
        return replace(
            self,
            directions=replace(what, effects=from_now_on(tuple(effects))),
            mean=self.mean[keep],
            covariance=self.covariance[np.ix_(keep, keep)],
            prior_std=None if self.prior_std is None else self.prior_std[keep],
            single=None,
        )

    def centred(
        self, result: Sequence[Effect], setup: int | None = None
    ) -> tuple[tuple[Effect, ...], Posterior]:
        """
        Return the effects that predict best, and the posterior about them.

        What a diagnosis names is a few effects; most arms have a little of all others, and what the
        recordings say of these is kept here. A parameter that bends the twin, what a
        joint gives when it is accelerated, and the height of a curve, stay.

        result: of the fitted model.
        setup: whose fitted frames are taken as the middle of the allowed models has them, by effects of
        base and tool: a base that turns and an error of the arm that turns it back hardly show, and
        whoever takes the error for true has to take the turn, too.
        """
        if self.middle == 0.0:
            return tuple(result), self
        step, grown = self._step(result)
        effects = []
        waves = [effect for effect in result if effect.traits.waves is not None]
        ours = {effect.key for effect in self.directions.effects}
        for effect, here in zip(self.directions.effects, self.directions.own, strict=True):
            now = effect.fit.coordinates()
            if effect.traits.waves is not None:
                # Waves of a joint add up: those found stay as they are, beside what is missing.
                effects.append(effect.fit.with_coordinates(step[here]))
                continue
            straight = np.where(effect.fit.straight(), step[here], 0.0)
            moved = effect.fit.with_coordinates(now + straight)
            step[here] = moved.fit.coordinates() - now
            effects.append(moved)
        step[self.directions.frame_count + sum(self.directions.sizes) :] = 0.0
        others = [effect for effect in result if effect.key not in ours and effect not in waves]
        what = replace(self.directions, effects=tuple(effects))
        centred = replace(self, directions=what, mean=self.mean - step, single=None, middle=0.0)
        frames = () if setup is None else self._moved_frames(setup, step)
        there = (effect for effect in effects if effect.key not in grown)
        return (*there, *waves, *others, *frames), centred

    def _step(self, result: Sequence[Effect]) -> tuple[Array, set[tuple[Any, ...]]]:
        """
        Return how far the middle is from the fit, (P,), and what has no part in it, by key.

        A motion to come need not say how warm the arm is. So what goes with the warmth and was not
        found is none there, and the middle is that of the models without: what a warm arm has grown
        by is in its lengths (conditional mean of a normal vector, Bishop 2006, eq. 2.81).
        """
        what, found = self.directions, {effect.key for effect in result}
        grown = {e.key for e in what.effects if 'temperature' in e.needs} - found
        held = np.zeros(what.count, dtype=bool)
        for effect, here in zip(what.effects, what.own, strict=True):
            held[here] = effect.key in grown
        inverse = np.linalg.pinv(self.covariance[np.ix_(held, held)], hermitian=True)
        step = self.mean - self.covariance[:, held] @ (inverse @ self.mean[held])
        step[held] = 0.0
        return self.middle * step, grown

    def _moved_frames(self, setup: int, step: Array) -> tuple[Effect, ...]:
        """Return how far the middle of the allowed models has fitted frames from the fit."""
        what = self.directions
        at = {'base': 6 * setup, 'tool': what.frame_count - 6}
        kinds: dict[str, type[FrameError]] = {'base': BasePose, 'tool': ToolPose}
        each = {name: step[at[name] : at[name] + 6] for name in what.frames}
        return tuple(
            kinds[name](xyz=six[:3], rotvec=six[3:]) for name, six in each.items() if six.any()
        )

    def after(self, features: Features, noise: float) -> Posterior:
        """Return how sure a model fitted anew will be, poses measured with a coordinate's noise [m]."""
        columns = self._columns(features, 0)[:, :3].transpose(0, 2, 1)
        own = self.discrepancy.covariance(self._where(features))[:, :3, :3]
        count = own.shape[0]
        rest = np.zeros((count, 3, count, 3))
        rest[np.arange(count), :, np.arange(count), :] = own + noise**2 * np.eye(3)
        rows = columns.reshape(self.directions.count, 3 * count)
        # The middle of what is allowed is where the next fit will be.
        moment = self.covariance + np.outer(self.mean, self.mean)
        gain = moment @ rows
        seen = rows.T @ gain + rest.reshape(3 * count, 3 * count)
        remaining = moment - gain @ np.linalg.solve(seen, gain.T)
        return replace(
            self, mean=np.zeros_like(self.mean), covariance=0.5 * (remaining + remaining.T)
        )

    def drawn(self, features: Features, setup: int = 0, count: int = _DRAWS) -> Array:
        """
        Return by how much the true position is off the twin's, shape (M, 2, count, 3) [m].

        Under as many models as are drawn, the same ones for every motion: each is off alike over a
        path, as far as what it is off by shows there alike. First in the set-up that was recorded,
        with the frames that were fitted to it: their second moment is that of `pose_covariance`. Then
        of the arm between its own base and flange, which such frames hide.

        Raises ModelError: there is no such base frame.
        """
        rng = np.random.default_rng(_SEED)
        unit, ways = rng.standard_normal, self.factor.shape[1]
        # Every way by itself is as a normal law has it (Latin hypercube): draws are steadier so.
        ranks = rng.permuted(np.tile(np.arange(count), (ways, 1)), axis=1).T
        steps = self.mean + ndtri((ranks + 0.5) / count) @ self.factor.T
        columns, frames = self._columns(features, setup)[:, :3], self.directions.frame_count
        here = self._where(features)
        rest, bends = self.discrepancy, _bends(here.q)
        gears = rest.joints(here)
        own, joints = (
            np.tensordot(bends, unit((bends.shape[1], count, k)), axes=1) for k in (3, len(gears))
        )
        of_arm = (
            np.tensordot(columns[frames:], steps[:, frames:], axes=(0, 1)).transpose(1, 2, 0)
            + np.einsum('nim,nm,mdn->mdi', here.levers[:, :3], gears, joints, optimize=True)
            + rest.position * own
        )
        if rest.swings:
            # What swings has changed its way from one place to the next.
            swung = unit((len(gears), count, len(bends)))
            of_arm += np.einsum(
                'nim,nm,ndm->mdi', here.levers[:, :3], rest.swung(here), swung, optimize=True
            )
        if rest.peaks.size:
            # Each model strays at one place, as far as one of the stretches did.
            place = (bends @ unit((bends.shape[1], count))).argmax(axis=0)
            way = unit((count, 3))
            way *= (np.resize(rest.peaks, count) / np.linalg.norm(way, axis=1))[:, None]
            of_arm[place, np.arange(count)] += way
        _misplace(of_arm, jumps(features), rest.jumps, rng)
        of_frames = np.tensordot(columns[:frames], steps[:, :frames], axes=(0, 1))
        off = np.stack([of_arm + of_frames.transpose(1, 2, 0), of_arm], axis=1)
        return off * rest.grown(here)[:, None, None, None]

    def at_rest(self, twin: Twin, q: Array) -> Recording:
        """Return stations (M, n) as warm as recorded, without a load, with the efforts to expect."""
        t, warm = np.arange(float(len(q))), self.domain.temperature
        stations = Recording(
            'stations',
            JointMotion(t, q, None, True),
            wrench=None if self.domain.load is None else Signal(t[:1], np.zeros((1, 6))),
            temperature=None if warm is None else Signal(t[:1], np.array([np.mean(warm)])),
        )
        springs = (effect.twin.by_effort for effect in twin.effects if effect.twin.by_effort)
        return with_expected_effort(stations, twin.robot, next(springs, 0.0))

    def _columns(self, features: Features, setup: int) -> Array:
        if 'base' in self.directions.frames and not 0 <= setup < self.directions.setups:
            raise ModelError(f'the posterior has no base frame {setup}')
        return self.directions.columns(features, setup)

    def _where(self, features: Features) -> Where:
        joints = [features.column(('q', i)) for i in range(features.twin.robot.n)]
        recording, at = features.recording, features.at
        q, _ = recording.joints.at(at)
        turned = np.zeros(q.shape, dtype=bool)
        if np.any(self.discrepancy.turns):
            turned = just_turned(recording.joints, at)
        beyond, margins = self.domain.beyond(q), np.array(self.domain.margins)
        unlike = self.domain.unlike(recording, at)
        shaken = features.shaken if self.discrepancy.swings else np.zeros(q.shape)
        return Where(q, np.stack(joints), beyond, margins, unlike, turned, shaken)


def _spread(moved: Array, rest: Array, grown: Array) -> Array:
    """Return the second moment of poses, shape (M, 6, 6), of ways, what no parameter has, and growth."""
    whole = np.einsum('rim,rjm->mij', moved, moved, optimize=True) + rest
    return np.asarray(whole * grown[:, None, None] ** 2)


def _bends(q: Array) -> Array:
    """
    Return functions of posture, shape (M, `_WAVES`), whose sums with normal weights have unit variance.

    Alike within `_ALIKE` and unlike beyond [1]_: what no parameter explains is not one shift all along a
    path, or how far the tool strays at its worst would be no more than how far it strays.

    References
    ----------
    .. [1] A. Rahimi, B. Recht, "Random features for large-scale kernel machines", NIPS 2007.

    """
    rng = np.random.default_rng(_SEED)
    slopes = rng.standard_normal((q.shape[1], _WAVES)) / _ALIKE
    phase = rng.uniform(0.0, 2.0 * np.pi, _WAVES)
    return np.asarray(np.sqrt(2.0 / _WAVES) * np.cos(q @ slopes + phase))


def _misplace(moved: Array, jumped: Array, recorded: float, rng: np.random.Generator) -> None:
    """
    Let some jumps come a place sooner or later in what models move a path, in place.

    moved: shape (M, count, 3). jumped: from each place to the next, shape (M - 1, 3).
    recorded: how many were seen, all where the model has them; by Laplace's rule of succession so
    many of the next ones are elsewhere.
    """
    if not jumped.any():
        return
    shape = (len(jumped), moved.shape[1], 1)
    amiss = rng.random(shape) < rng.beta(1.0, 1.0 + recorded, shape[1:])
    late = rng.random(shape) < 0.5
    moved[:-1] += (amiss & ~late) * jumped[:, None]
    moved[1:] -= (amiss & late) * jumped[:, None]


class Drawn(NamedTuple):
    """By how much the models that the recordings allow are off the fitted one along a motion."""

    near: NDArray[np.int_]
    """The nearest of some places of the motion for every sample, shape (N,)."""
    off: Array
    """At the places, as `Posterior.drawn` returns it, shape (K, 2, D, 3) [m]."""

    def where(self, keep: NDArray[np.bool_]) -> Drawn:
        """Return some of the samples."""
        return self._replace(near=self.near[keep])


def places(count: int) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Return the samples at which models are drawn, shape (K,), and `Drawn.near`, shape (count,)."""
    at = np.unique(np.linspace(0, count - 1, min(_PLACES, count)).round().astype(int))
    middles = 0.5 * (at[1:] + at[:-1])
    return at, np.searchsorted(middles, np.arange(count))


def pose_covariances(
    posterior: Posterior, twin: Twin, recording: Recording, at: Array, setup: int = 0
) -> Array:
    """Return `Posterior.pose_covariance` of a long motion at stamps (M,) [s], in pieces, (M, 6, 6)."""
    parts = [
        posterior.pose_covariance(Features(twin, recording, piece), setup) for piece in _pieces(at)
    ]
    return np.concatenate([np.zeros((0, 6, 6)), *parts])


def expected_poses(
    posterior: Posterior, twin: Twin, recording: Recording, at: Array, setup: int = 0
) -> tuple[Poses, Array]:
    """Return where `Posterior.expected` has the tool at stamps of a long motion, and the covariance."""
    parts = [posterior.expected(Features(twin, recording, piece), setup) for piece in _pieces(at)]
    shift = np.concatenate([np.zeros((0, 6)), *(part.shift for part in parts)])
    covariance = np.concatenate([np.zeros((0, 6, 6)), *(part.covariance for part in parts)])
    return twin.poses(recording, at).displaced(shift), covariance


def _pieces(at: Array) -> Iterator[Array]:
    for start in range(0, at.size, _CHUNK):
        yield at[start : start + _CHUNK]


def usual_sigma(posterior: Posterior, twin: Twin, q: Array) -> float:
    """Return the median of `largest_sigma` over postures at rest (M, n) [m]."""
    still = posterior.at_rest(twin, q)
    return float(
        np.median(largest_sigma(pose_covariances(posterior, twin, still, still.joints.t)))
    )


def postures_within_limits(robot: Robot, count: int) -> Array:
    """Return postures spread evenly over what the joints' limits allow, shape (count, n)."""
    reach = np.where(robot.prismatic, 1.0, np.pi)
    low, high = np.maximum(robot.lower, -reach), np.minimum(robot.upper, reach)
    drawn = halton(robot.n, count)
    return np.asarray(low + drawn * (high - low))


def largest_sigma(covariances: Array) -> Array:
    """Return the largest standard deviation of position in any direction, shape (M,) [m]."""
    return np.asarray(np.sqrt(np.linalg.eigvalsh(covariances[:, :3, :3])[:, -1]))


def _lower(matrix: Array) -> list[list[float]]:
    """Return the lower triangle of a matrix, row by row."""
    return [[float(v) for v in row[: k + 1]] for k, row in enumerate(matrix)]


def _single(posterior: Posterior) -> dict[str, Any]:
    """Return the entry ``single_prior``, where it is known."""
    if posterior.single is None:
        return {}
    mean, covariance = posterior.single
    value = [float(v) for v in posterior.directions.fitted() + mean]
    return {'single_prior': {'value': value, 'covariance': _lower(covariance)}}


def as_dict(posterior: Posterior) -> dict[str, Any]:
    """Return plain numbers, lists and strings: the entry ``posterior`` of diagnosis.json."""
    what, rest = posterior.directions, posterior.discrepancy
    deviation = np.sqrt(np.maximum(np.diag(posterior.covariance), 0.0))
    coordinates = [
        {'name': name, 'std': float(std), 'mean': float(mean), 'value': float(at + mean)}
        for name, std, mean, at in zip(
            what.names(), deviation, posterior.mean, what.fitted(), strict=True
        )
    ]
    if posterior.prior_std is not None:
        for entry, width in zip(coordinates, posterior.prior_std, strict=True):
            entry['prior_std'] = float(width)
    return {
        'frames': list(what.frames),
        'setups': what.setups,
        'effects': [effect.to_mapping() for effect in what.effects],
        'knots': [knots.tolist() for knots in what.knots],
        'gives': what.gives,
        'coordinates': coordinates,
        'covariance': _lower(posterior.covariance),
        **_single(posterior),
        'discrepancy': {
            'position_m': rest.position,
            'orientation_rad': rest.orientation,
            'gears': [float(v) for v in rest.gears],
            'curves': [float(v) for v in rest.curves],
            'reach': rest.reach,
            'turns': np.asarray(rest.turns).tolist(),
            'peaks_m': rest.peaks.tolist(),
            'jumps': rest.jumps,
            'swings': rest.swings,
        },
        'middle': posterior.middle,
        'recorded': posterior.domain.as_dict(),
        'left_open': list(posterior.left_open),
        'sigma_recorded_m': posterior.recorded_m,
        'sigma_anywhere_m': posterior.anywhere_m,
        **({} if posterior.region is None else {'region': list(posterior.region)}),
    }


_EVERY = 0.1
"""Shortest time between two looks [s]. One takes some milliseconds, so that this costs some
per cent of a core at any rate of joint states; in between the covariance is held, while a tool at
1 m/s goes on by 100 mm and its covariance changes by some per cent."""
_MOVED = 0.005
"""Least motion of a joint [rad or m] that is worth another look."""
_LEAD = np.linspace(-0.5, 0.0, 6)
"""Motion at constant speed before the sample [s], so that lag and play are as in the middle of a
motion. No joint gives, as none is accelerated: a look is held for longer than that lasts."""


class LivePosterior:
    """Where the models allowed have the tool, and how sure that is, while joint states come in."""

    def __init__(self, posterior: Posterior) -> None:
        self.posterior = posterior
        self._time = -np.inf
        self._q: Array | None = None
        self._moving = False
        self._expected = Expected(np.zeros(6), np.zeros((6, 6)))
        self._outside: tuple[str, ...] = ()

    @property
    def outside(self) -> tuple[str, ...]:
        """Return why the latest posture looked at lies outside what was recorded."""
        return self._outside

    def expected(
        self,
        twin: Twin,
        t: float,
        q: Array,
        wrench: Array | None = None,
        wrench_frame: str = 'tool',
        temperature: float | None = None,
        effort: Array | None = None,
    ) -> Expected:
        """
        Return what `Posterior.expected` does, of one pose at steady speed, held between two looks.

        t: stamp of the joint state [s].
        q: shape (n,).
        wrench: shape (6,) [N, N m].
        temperature: [degC]
        effort: shape (n,) [N m, or N of a slide].
        """
        since = t - self._time
        if self._q is None or since < 0.0:
            speed = np.zeros_like(q)
        elif since >= _EVERY and (self._moving or np.abs(q - self._q).max() > _MOVED):
            speed = (q - self._q) / since
            self._moving = bool(np.abs(q - self._q).max() > _MOVED)
        else:
            return self._expected
        self._time, self._q = t, np.array(q)
        now = _LEAD[-1:]
        pull = None if wrench is None else wrench[None]
        warm = None if temperature is None else np.array([temperature])
        recording = Recording(
            'live',
            JointMotion(_LEAD, q + _LEAD[:, None] * speed, np.tile(speed, (_LEAD.size, 1))),
            None,
            None if pull is None else Signal(now, pull),
            wrench_frame,
            None if warm is None else Signal(now, warm),
            effort=None if effort is None else JointSignal(now, effort[None]),
        )
        shift, covariance = self.posterior.expected(Features(twin, recording, now))
        self._expected = Expected(shift[0], covariance[0])
        outside = self.posterior.domain.outside(q[None], speed[None], pull, warm)
        self._outside = tuple(item.why for item in outside)
        return self._expected
