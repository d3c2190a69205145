# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a diagnosis says, as frozen values; `as_dict` is the content of diagnosis.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from ..arm.known_arms import fingerprint
from ..arrays import Array
from ..effects.effect import Effect
from ..recording import Recording
from ..twin.posterior import Posterior, as_dict
from .algebra.problem import Model
from .algebra.problem import Site as Site

SCHEMA = 'weld_twin/diagnosis/2'
NAMING = ('identified', 'ambiguous')
"""Verdicts that name something; the others are unknown, none and unsound."""
MISTAKES = (
    'units',
    'joints_swapped',
    'sign',
    'constant_angle',
    'coupled_axes',
    'base_turned',
    'other_robot',
    'reflector_jumped',
    'joint_slipped',
    'instrument_knocked',
    'joints_stuck',
    'zero_velocities',
    'clock',
    'stamps_in_bursts',
    'computed',
    'camera_inverted',
    'wrong_fixture',
    'intrinsics',
    'target_scale',
    'target_mirrored',
    'cameras_swapped',
    'other',
)
"""Kinds of mistakes in data and set-up; docs/unsound.md describes each."""


@dataclass(frozen=True)
class Gap:
    """Measured against the twin after alignment, before any found effect [m, rad]."""

    rms_m: float
    mean_m: float
    max_m: float
    orientation_rms_rad: float | None
    samples: int
    noise_floor_m: float


@dataclass(frozen=True)
class Check:
    """One finding about the data: what was looked at, whether it passed, and a sentence."""

    name: str
    level: str
    """'ok', 'note', 'warning', 'unsound'."""
    sentence: str


@dataclass(frozen=True)
class Unsound:
    """A mistake in data or set-up that looks like a cause in the arm."""

    kind: str
    """One of `MISTAKES`."""
    at: tuple[str, ...]
    """Joints by name, 'base', 'tool', 'instrument', 'clock' or 'robot'."""
    sentence: str
    remedy: str
    """What is wrong, and what to do about it."""
    applied: bool = False
    """Whether the remedy was made and the diagnosis went on with mended data."""
    alike: tuple[tuple[str, tuple[str, ...]], ...] = ()
    """Kinds and places of other mistakes that would explain the data as well."""
    mend: Mapping[str, Any] | None = None
    """The correction as plain values, to be made again on the same source; None where nothing can
    undo it."""

    def as_dict(self) -> dict[str, Any]:
        """Return the entry of ``unsound``."""
        alike = [{'kind': kind, 'at': list(at)} for kind, at in self.alike]
        return {**vars(self), 'at': list(self.at), 'alike': alike}


@dataclass(frozen=True)
class Where:
    """
    Where the gap lies; shares are of variance explained in folds not used for fitting.

    ``map_shares`` is the joint x regressor map: rows are joints, columns `map_regressors`.
    """

    joints: tuple[tuple[str, float], ...]
    regimes: dict[str, float]
    path: tuple[tuple[float, float, float, float], ...]
    """Start [s], end [s], share of the squared gap, RMS [m]."""
    direction: dict[str, float]
    map_regressors: tuple[str, ...]
    map_shares: tuple[tuple[float, ...], ...]


@dataclass(frozen=True, eq=False)
class Found:
    """One effect found, with the standard errors of its parameters."""

    effect: Effect
    std: dict[str, Any]

    def as_dict(self) -> dict[str, Any]:
        """Return the entry of ``verdict.effects``."""
        entry = self.effect.to_mapping()
        name = entry.pop('effect')
        joint = entry.pop('joint', None)
        return {'effect': name, 'joint': joint, 'parameters': entry, 'std': self.std}


@dataclass(frozen=True, eq=False)
class Changed:
    """What one recording has that the first has not."""

    recording: int
    """Counted from 0."""
    effect: Effect
    """By how much; a model of the first recording's arm with it is the arm of this one."""
    std: dict[str, Any]
    """Standard errors by parameter."""

    def as_dict(self) -> dict[str, Any]:
        """Return the entry of ``changed``; a lone parameter is given as a plain number."""
        value = self.effect.to_mapping()
        name, joint = value.pop('effect'), value.pop('joint', None)
        lone = len(value) == 1
        return {
            'recording': self.recording,
            'effect': name,
            'joint': joint,
            'value': next(iter(value.values())) if lone else value,
            'std': next(iter(self.std.values())) if lone else self.std,
        }


@dataclass(frozen=True)
class Family:
    """Many small errors of one kind, fitted together, and how much worse unseen data get without it."""

    effect: str
    growths: tuple[float, ...]
    """By what share the RMS error of each part left out, stretches of time and regions of posture,
    grows without it, all other kinds chosen and the frames fitted anew. Of a kind that was not
    chosen: by what share it shrinks with it."""
    chosen: bool
    """Whether it is among the kinds that explain unseen data together."""
    members: tuple[tuple[Site, float], ...]
    """Its members and how far each moves the tool, RMS [m], largest first."""
    rms_m: float = 0.0
    """What it accounts for at the tool on unseen data: the root of how much the squared error
    grows without it, the other kinds that are needed fitted anew, [m]."""
    needed: tuple[tuple[Site, float], ...] = ()
    """The members without which unseen data get worse, each with its share of the kind."""
    like: tuple[tuple[Site, float], ...] = ()
    """What may do as well in its place, to a tenth of what is left, and how probable that is."""
    share: float = 0.0
    """Share of the squared unseen gap that it takes off; all that are chosen add up to what they
    take off together."""
    named: bool = False
    """Whether the verdict names it; one that it does not is exchangeable here."""
    alike: tuple[tuple[Site, ...], ...] = ()
    """Which of the members needed are one error everywhere, and share what it does evenly."""
    joined: tuple[str, ...] = ()
    """Other kinds that it is one set with: one of them is likelier right than wrong, and none alone."""

    @property
    def kinds(self) -> int:
        """Return how many kinds it stands for."""
        return 1 + len(self.joined)

    def group(self, site: Site) -> tuple[Site, ...]:
        """Return the members that are the same error as one everywhere, itself included."""
        return next((group for group in self.alike if site in group), (site,))

    @property
    def growth(self) -> float:
        """Return by what share the error grows without it in the median part left out."""
        return float(np.median(self.growths)) if self.growths else 0.0

    def missed(self, worth: float) -> bool:
        """Return whether unseen data get worse without it: in the median part, and better in none."""
        reported = self.chosen and len(self.growths) > 1
        return reported and self.growth >= worth and min(self.growths) >= 0.0

    def as_dict(self) -> dict[str, Any]:
        """Return the entry of ``verdict.families``."""
        return {
            'effect': self.effect,
            'named': self.named,
            'rms_m': self.rms_m,
            'members': [{'joint': site.joint, 'rms_m': size} for site, size in self.members],
            'growth': self.growth,
            'needed': [{'joint': site.joint, 'share': share} for site, share in self.needed],
            'like': [site.as_dict() for site, _ in self.like],
        }


@dataclass(frozen=True)
class Cause:
    """What is certain of one cause, level by level, most probable first."""

    place: tuple[tuple[str, float], ...]
    """A joint's name, 'base', 'tool', 'instrument', 'clock' or 'load', and its probability."""
    dependence: tuple[tuple[str, float], ...]
    """What it depends on; several may be certain at once."""
    name: tuple[tuple[Site, float], ...]
    """Effects of the library, or curves."""
    share: float
    """Of the squared gap."""
    share_ci90: tuple[float, float]
    members: tuple[int, ...] = ()
    """The effects of the model that stand for it, as `Model.found` counts them; none where nothing
    that can be carried over stands for it."""
    probability: float = 0.0
    """That one of its names is right; that its place is, where it has no name of an effect."""
    sure: bool = False
    """Whether that keeps the promise of being wrong hardly ever."""
    effect: int | None = None
    """Its index in `Diagnosis.effects` and in `Diagnosis.indistinguishable`."""
    rest: bool = False
    """Whether it is what is left beside everything that is reported; its share is the unexplained."""
    row: int | None = None
    """Which effect found by the search it is; for the steps of a diagnosis alone."""

    def as_dict(self) -> dict[str, Any]:
        """Return the entry of ``verdict.causes``."""
        return {
            'probability': self.probability,
            'sure': self.sure,
            'effect': self.effect,
            'rest': self.rest,
            'place': [{'at': at, 'probability': p} for at, p in self.place],
            'dependence': [{'on': on, 'probability': p} for on, p in self.dependence],
            'name': [{**site.as_dict(), 'probability': p} for site, p in self.name],
            'share': self.share,
            'share_ci90': list(self.share_ci90),
            'came_back': None,  # older readers ask for it
        }


@dataclass(frozen=True)
class Shares:
    """What of the squared gap no cause explains, and what is noise."""

    unexplained: float
    noise: float


@dataclass(frozen=True)
class Candidate:
    """A hypothesis in the place of an effect found, with its probability and what it would bring."""

    site: Site
    probability: float
    rms_after_m: float
    shrink: float
    """Share of the RMS gap that it takes away on data not used for fitting."""

    def as_dict(self) -> dict[str, Any]:
        """Return the entry of ``candidates``."""
        numbers = {key: value for key, value in vars(self).items() if key != 'site'}
        return {**self.site.as_dict(), **numbers}


@dataclass(frozen=True)
class Shrink:
    """Gap before and after on data not used for fitting."""

    rms_before_m: float
    rms_after_m: float
    ratio: float
    ci95: tuple[float, float]
    held_out: str
    steps: tuple[tuple[str, float], ...] = ()
    """The waterfall: RMS [m] on unseen data as each effect is added in turn."""
    alone: tuple[tuple[str, float], ...] = ()
    """RMS [m] that would remain if only this one were mended."""
    orientation_rad: tuple[float, float] | None = None
    """RMS orientation gap before and after, by cross-validation; poses only."""
    elsewhere_ci95: tuple[float, float] | None = None
    """Interval of the ratio on a motion where nothing was recorded."""


@dataclass(frozen=True, eq=False)
class Structure:
    """What groups of columns without a formula find."""

    rms_m: float
    """RMS error on unseen stretches with the best of them beside the model, [m]."""
    gain: float
    """Share of the squared error on unseen stretches that it takes away."""
    sure: float
    """The gain over its standard error between folds."""
    depends_on: tuple[str, ...]
    chance: float = 0.0
    """Share that the best of them hardly ever takes off noise alone; 0 where rows are many."""
    of_gap: Mapping[tuple[str, str], float] = field(default_factory=dict)
    """By joint and dependence: share of the squared gap, no effect fitted, that one takes off."""


@dataclass(frozen=True)
class Unexplained:
    """What remains after the verdict."""

    rms_m: float
    above_noise: bool
    structure: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Traces:
    """Arrays for pictures, one entry per recording; positions in the measuring frame."""

    t: tuple[Array, ...]
    measured: tuple[Array, ...]
    before: tuple[Array, ...]
    """Position residual before, shape (M, 3) [m]."""
    after: tuple[Array, ...]
    trusted: tuple[np.ndarray, ...] = ()
    """Which samples are no outliers, bool, shape (M,); empty for all of them."""


@dataclass(frozen=True, eq=False)
class Contributions:
    """
    What every cause adds to the position residual, sample by sample, one entry per recording [m].

    Each stretch is predicted from the others. What is left and all parts add up to the residual
    of the model without effects, so any combination of causes can be thought away.
    """

    left: tuple[Array, ...]
    """With the whole model, shape (M, 3)."""
    parts: tuple[Array, ...]
    """Of every cause in the order of `Diagnosis.causes`, shape (K, M, 3); then, if there are any,
    of the effects that the model holds and no cause stands for."""


@dataclass(frozen=True)
class Touched:
    """How far tool points are from one contact, on average [m]."""

    label: str
    postures: int
    before_m: float
    after_m: float
    held_out_m: float
    """With the nominal robot, with the effects found, and where its place was not fitted [m]."""


@dataclass(frozen=True)
class KnownLength:
    """A known distance [m] or angle [rad] between contacts, and what a model makes of it."""

    between: tuple[str, str]
    kind: str
    value: float
    sigma: float
    before: float
    after: float

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers."""
        unit = 'm' if self.kind == 'distance' else 'rad'
        return {'between': list(self.between), 'kind': self.kind} | {
            f'{name}_{unit}': getattr(self, name) for name in ('value', 'sigma', 'before', 'after')
        }


@dataclass(frozen=True)
class JointEffort:
    """One joint: measured load beside the model's."""

    joint: str
    model_rms: float
    difference_rms: float
    """Load by the statics, about its mean, and measured minus statics [N m, or N of a slide]."""
    factor: float | None
    """Measured load for each N m of the statics; None where the statics hardly load the joint."""


@dataclass(frozen=True)
class EffortCause:
    """What explains the difference by itself."""

    name: str
    """'payload', 'torque_constant', 'link_mass' or 'link_masses'."""
    joint: str | None
    value: float
    std: float
    """Mass beyond the declared one [kg], what is measured for each N m, or the factor on
    masses."""
    left: float
    """Share of the squared difference that it leaves."""


@dataclass(frozen=True)
class Efforts:
    """Measured efforts beside the model's statics."""

    holds: bool
    """The effort holds the load; else it is the load itself."""
    correlation: float
    """Of effort so taken and statics, all joints together; 0 where nothing is loaded."""
    weighed: bool
    """Whether the model has masses; without, every link counts alike, and only the sign is
    told."""
    joints: tuple[JointEffort, ...]
    difference: float
    """RMS difference for each of the statics' load."""
    causes: tuple[EffortCause, ...]
    """What explains the difference by itself, what leaves least first."""

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers, lists and strings in the public schema."""
        return asdict(self)


@dataclass(frozen=True)
class ContactResult:
    """How well contacts agree: mean distances of the tool points from where they touched [m]."""

    spread_before_m: float
    spread_after_m: float
    held_out_spread_m: float
    """With the nominal robot (its tool fitted where asked), with the effects found, and with each
    place predicted from the others [m]."""
    touched: tuple[Touched, ...] = ()
    lengths: tuple[KnownLength, ...] = ()
    not_seen: tuple[str, ...] = ()
    """What no contact shows, in words."""

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers."""
        return {
            'spread_before_m': self.spread_before_m,
            'spread_after_m': self.spread_after_m,
            'held_out_spread_m': self.held_out_spread_m,
            'touched': [dict(vars(item)) for item in self.touched],
            'distances': [item.as_dict() for item in self.lengths],
            'not_seen': list(self.not_seen),
        }


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """
    The whole answer of `diagnose`.

    With status 'unsound' there is none: no effects, and every figure is not a number.

    Examples
    --------
    `diagnose` makes it; its example shows how.

    >>> import weld_twin_core as wt
    >>> 'status' in wt.Diagnosis.__dataclass_fields__
    True

    """

    gap: Gap
    """Measured against the twin, before any effect that was found [m, rad]."""
    where: Where
    """On which joints, in which regimes, where on the path and in which direction it lies."""
    status: str
    """'identified', 'ambiguous', 'unknown', 'none' or 'unsound'."""
    effects: tuple[Found, ...]
    """The effects that count as named, whatever the status, with standard errors; those that move the
    tool most first."""
    confidence: float
    """Probability that the whole answer is right, as such answers were."""
    indistinguishable: tuple[tuple[Site, ...], ...]
    """One group per effect: what these data cannot tell apart."""
    reasons: tuple[str, ...]
    """Why the status is what it is, in sentences."""
    candidates: tuple[Candidate, ...]
    """Hypotheses with their probabilities."""
    shrink: Shrink
    """The gap before and after on data not used for fitting."""
    unexplained: Unexplained
    """What remains, and what it depends on."""
    next_experiment: dict[str, Any] | None
    """What to measure so that the remaining alternatives part."""
    actions: tuple[str, ...]
    """What to do about every effect found."""
    checks: tuple[Check, ...]
    """Whether the data are sound."""
    model: Model
    """The fitted frames and effects."""
    traces: Traces
    """Residuals before and after, as arrays."""
    absent: dict[str, str] = field(default_factory=dict)
    recordings: tuple[Recording, ...] = ()
    families: tuple[Family, ...] = ()
    """Where many small errors act together: what each kind accounts for, largest first."""
    evidence: object = None
    """What the verdict was drawn from, `evidence.Evidence`, to draw it anew."""
    statements: tuple[object, ...] = ()
    """What is said, on what evidence and how probable: `calibration.calibrated.Statement`."""
    posterior: Posterior | None = None
    """The models that the recordings allow: what makes a prediction certain or not."""
    causes: tuple[Cause, ...] = ()
    """What is certain of each cause, largest share of the squared gap first."""
    shares: Shares = Shares(0.0, 0.0)
    contributions: Contributions | None = None
    """What every cause adds to the gap; None where the model carries no cause."""
    unsound: tuple[Unsound, ...] = ()
    """Mistakes found in data and set-up; all of them undone unless the status is 'unsound'."""
    changed: tuple[Changed, ...] = ()
    """What differs between the recordings, of what was said to be able to."""
    may_change: tuple[str, ...] = ()
    """What was said to be able to differ."""
    contacts: ContactResult | None = None
    """How well contacts agree, where contacts took the place of an instrument."""
    same: tuple[tuple[Site, ...], ...] = ()
    """Those of ``indistinguishable`` that are the same error on any motion, the one to set first."""
    sure: bool = False
    """Whether the answer keeps the promise of being wrong hardly ever; docs/trust.md has it."""
    complete: float = 0.0
    """Probability that no cause above the noise and a tenth of the squared gap is missing."""

    efforts: Efforts | None = None
    """Measured efforts of the joints beside the model's statics, where springs take them."""

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers, lists and strings in the public schema."""
        sound = self.status != 'unsound'
        return {
            'schema': SCHEMA,
            'unsound': [item.as_dict() for item in self.unsound],
            'gap': dict(vars(self.gap)) if sound else None,
            'where': self._where() if sound else None,
            'verdict': self._verdict(),
            'candidates': [item.as_dict() for item in self.candidates] if sound else None,
            'shrink': self._shrink() if sound else None,
            'unexplained': self._unexplained() if sound else None,
            'next_experiment': self.next_experiment,
            'checks': [dict(vars(check)) for check in self.checks],
            'not_considered': dict(self.absent),
            'model': self._model() if sound else None,
            'changed': [item.as_dict() for item in self.changed],
            **({} if self.contacts is None else {'contacts': self.contacts.as_dict()}),
            **({} if self.efforts is None else {'efforts': self.efforts.as_dict()}),
            'posterior': None if self.posterior is None else as_dict(self.posterior),
        }

    def _verdict(self) -> dict[str, Any]:
        confidence = None if self.status == 'unsound' else self.confidence
        return {
            'status': self.status,
            'effects': [result.as_dict() for result in self.effects],
            'confidence': confidence,
            'learned': confidence,
            'sure': self.sure,
            'complete': None if confidence is None else self.complete,
            'indistinguishable': [
                [s.as_dict() for s in group] for group in self.indistinguishable
            ],
            'same_on_any_motion': [[s.as_dict() for s in group] for group in self.same],
            'reasons': list(self.reasons),
            'families': [family.as_dict() for family in self.families],
            'actions': list(self.actions),
            'causes': [cause.as_dict() for cause in self.causes],
        }

    def _shrink(self) -> dict[str, Any]:
        shrink, turned = self.shrink, self.shrink.orientation_rad
        return {
            'rms_before_m': shrink.rms_before_m,
            'rms_after_m': shrink.rms_after_m,
            'ratio': shrink.ratio,
            'ci95': list(shrink.ci95),
            'elsewhere_ci95': shrink.elsewhere_ci95 and list(shrink.elsewhere_ci95),
            'held_out': shrink.held_out,
            'steps': [{'added': n, 'rms_m': v} for n, v in shrink.steps],
            'alone': [{'mended': n, 'rms_m': v} for n, v in shrink.alone],
            'orientation_rms_rad': turned and {'before': turned[0], 'after': turned[1]},
        }

    def _unexplained(self) -> dict[str, Any]:
        return {
            **vars(self.unexplained),
            'structure': list(self.unexplained.structure),
            'share': self.shares.unexplained,
            'noise_share': self.shares.noise,
        }

    def _model(self) -> dict[str, Any]:
        robot = self.model.robot
        return {
            'robot': robot.name,
            'kinematics': fingerprint(robot),
            'statics': _statics(self.recordings),
            'tool': _frame(robot.T_flange_tool),
            'bases': [_frame(base) for base in self.model.bases],
            'epochs_ns': [r.clock_ns for r in self.recordings],
            'spans_ns': [list(r.span_ns) for r in self.recordings],
            'known': [effect.to_mapping() for effect in self.model.known],
            'found': [effect.to_mapping() for effect in self.model.found],
            'alone': None if self.model.alone is None else self.model.alone.as_dict(),
            'counted': None if self.model.counted is None else self.model.counted.as_mapping(),
        }

    def _where(self) -> dict[str, Any]:
        where = self.where
        return {
            'joints': [{'name': name, 'share': share} for name, share in where.joints],
            'regimes': dict(where.regimes),
            'path': [
                {'t_start': a, 't_end': b, 'share': share, 'rms_m': rms}
                for a, b, share, rms in where.path
            ],
            'direction': dict(where.direction),
            'map': {
                'regressors': list(where.map_regressors),
                'shares': [list(row) for row in where.map_shares],
            },
        }


def _statics(recordings: Sequence[Recording]) -> str:
    """Return what springs took for their load: the model's statics, or measured efforts."""
    if not recordings or recordings[0].effort is None:
        return 'equilibrium'
    return 'effort' if recordings[0].effort_holds else 'effort_reversed'


def _frame(matrix: Array) -> list[list[float]]:
    return [[float(v) for v in row] for row in matrix]
