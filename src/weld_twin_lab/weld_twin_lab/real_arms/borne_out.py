# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Is a kind of error borne out by data that were not fitted? Plain least squares says so.

All kinds that a recording can show are fitted at once with the frames, each coordinate with the
spread that machines have. One kind is taken out, everything else is fitted anew, and both predict
what was not fitted: what else was recorded of the arm, or each part of the recording in its turn.
The kind is borne out where the error grows by a tenth in the median part and shrinks in none.

Nothing here chooses, learns a size or shares a step with the diagnosis; the twin gives the columns.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.frames.aligned import aligned
from weld_twin_core.diagnosis.frames.alignment import refined
from weld_twin_core.effects import REGISTRY
from weld_twin_core.effects.effect import Effect
from weld_twin_core.effects.plausible import plausible
from weld_twin_core.recording import Recording
from weld_twin_core.twin.twin import Twin

from ..blind.scoring import rms
from .rows import ArmRow, size

TINY = 1e-12
"""Least error [m] divided by."""
GROWS = 0.1
"""Growth of the unseen error from which on a kind is borne out."""
LEVER = 0.3
"""Metres that a turn of a measured pose counts over: half the reach of a small arm."""
REGIONS = 2
"""Halvings of the postures: four regions; there are as many stretches of time."""
NOISE = 1e-4
"""Spread of what is left [m] that a fit begins with."""
ROUNDS = 4
"""Fits, each with the spread that the last one left."""
FRAMES = 0.05
"""Spread of a frame [m, rad] about where it was aligned."""
STEP = 1e-2
"""Step of a difference, in spreads: far above rounding, far below what bends."""
ORDERS = (1.0, 2.0)
"""Orders of waves in a joint's angle: eccentric wheels and scales make one or two."""
MOST = 1500
"""Measurements that are looked at; more are thinned evenly."""
GENERAL = (
    'joint_offset',
    'link_length',
    'link_offset',
    'link_twist',
    'axis_parallelism',
    'gear_ratio',
    'joint_compliance',
    'transmission_ripple',
    'measurement_scale',
    'drift',
    'servo_lag',
    'friction',
    'time_delay',
)
"""Kinds that are fitted on every recording that can show them; what is told comes along."""
Kinds = Mapping[str, Sequence[tuple[Effect, int]]]
"""Of every kind its effects and the component of each that is turned."""


@dataclass(frozen=True)
class Borne:
    median: float
    least: float
    """Growth of the unseen RMS error without it, over the parts."""
    parts: int

    @property
    def out(self) -> bool:
        return self.median >= GROWS and self.least >= 0.0


def borne_out(
    row: ArmRow, reported: Sequence[Effect], claims: Sequence[Sequence[str]], told: Set[str]
) -> tuple[dict[str, Borne], list[tuple[Borne, Borne]]]:
    """
    Return what unseen data say of every kind against all others, and of every claim.

    Of a claim: against all other kinds there are, and against all others that are told.

    reported: what a diagnosis reports: shapes that are not straight are taken from it.
    claims: kinds that are named; several that are named as alike are taken out together.
    told: kinds that are told as likelier than not.
    """
    fitted, other = thinned(row.fitted), None if row.other is None else thinned(row.other)
    robot = _aligned(fitted, row)
    kinds = _kinds(robot, fitted, reported)
    own = _Columns.of(robot, row, fitted, kinds)
    if other is not None:
        judged = _Columns.of(robot, row, other, kinds)
        every = np.ones(size(fitted), dtype=bool)
        parts = [(every, judged, part) for part in _parts(other)]
    else:
        parts = [(~part, own, part) for part in _parts(fitted)]

    def errors(among: Set[str]) -> Array:
        return np.array([_left(own, used, judged, part, among) for used, judged, part in parts])

    def borne(among: Set[str], out: Sequence[str]) -> Borne:
        grows = errors(among - set(out)) / np.maximum(errors(among), TINY) - 1.0
        return Borne(float(np.median(grows)), float(grows.min()), grows.size)

    every_kind = set(kinds)
    return (
        {name: borne(every_kind, [name]) for name in kinds},
        [
            (borne(every_kind, claim), borne((told | set(claim)) & every_kind, claim))
            for claim in claims
        ],
    )


def thinned(recording: Recording) -> Recording:
    if recording.measured is None or recording.measured.t.size <= MOST:
        return recording
    count = recording.measured.t.size
    keep = np.unique(np.linspace(0, count - 1, MOST).astype(int))
    return recording.with_measured(recording.measured.take(keep))


def _aligned(recording: Recording, row: ArmRow) -> Robot:
    """Return the robot with its frames where they fit best."""
    problem, model = aligned(recording, row.robot, row.align, ())
    model = refined(problem, model) if row.align else model
    return model.robot.with_frames(base=model.bases[0])


def _kinds(robot: Robot, recording: Recording, reported: Sequence[Effect]) -> Kinds:
    """Return every kind that the recording can show, with its effects on all joints."""
    out: dict[str, list[tuple[Effect, int]]] = {}
    known = {(e.name, e.site): e for e in reported}
    names = dict.fromkeys([*GENERAL, *(e.name for e in reported)])
    view = Twin(robot).joint_view(recording)
    for name in names:
        kind = REGISTRY[name]
        if recording.measured is None and name in ('measurement_scale', 'drift'):
            continue
        if not kind.traits.cause or (
            kind.stage.name in ('SERVO', 'CLOCK') and recording.joints.static
        ):
            continue
        sites = robot.joint_names if kind.of in ('joint', 'link') else (None,)
        for site in sites:
            if kind.applicable(view, site) is not None:
                continue
            each = [known[name, site]] if (name, site) in known else _usual(robot, name, site)
            out.setdefault(name, []).extend(_turned(robot, each))
    return {name: each for name, each in out.items() if each}


def _usual(robot: Robot, name: str, site: str | None) -> list[Effect]:
    """Return effects of one kind on one joint, of no size yet."""
    kind = REGISTRY[name]
    if name == 'transmission_ripple':
        phases = (0.0, np.pi / 2.0)
        return [
            kind(site, amplitude=0.0, order=k, phase=p)  # type: ignore[call-arg]
            for k in ORDERS
            for p in phases
        ]
    if name == 'joint_coupling':
        others = [joint for joint in robot.joint_names if joint != site]
        return [kind(site, source=joint) for joint in others]  # type: ignore[call-arg]
    if name == 'backlash':
        return [kind(site, width=0.0, form='coast')]  # type: ignore[call-arg]
    try:
        return [kind(site) if site is not None else kind()]  # type: ignore[call-arg]
    except TypeError:
        return []


def _turned(robot: Robot, effects: Sequence[Effect]) -> Iterator[tuple[Effect, int]]:
    for effect in effects:
        for k, (parameter, _) in enumerate(effect.components()):
            if parameter.differentiable or not effect.fit.fitted():
                yield effect, k


@dataclass(frozen=True, eq=False)
class _Columns:
    """What is left with the frames alone, and what every coordinate does, in spreads."""

    residual: Array
    frames: Array
    columns: dict[str, Array]
    labels: NDArray[np.str_] | None
    width: int

    @classmethod
    def of(cls, robot: Robot, row: ArmRow, recording: Recording, kinds: Kinds) -> _Columns:
        at = None if recording.measured is None else recording.measured.t
        poses = Twin(robot).poses(recording, at)
        labels = None
        if recording.contacts is not None:
            labels = np.array(recording.contacts.labels)
            residual, width = -poses.position, 3
        else:
            assert recording.measured is not None
            residual = recording.measured.position - poses.position
            width = 3
            if recording.measured.rotation is not None:
                width = 6
                turn = recording.measured.rotation @ np.swapaxes(poses.rotation, -1, -2)
                lever = LEVER * Rotation.from_matrix(turn).as_rotvec()
                residual = np.concatenate([residual, lever], axis=1)

        def column(effects: tuple[list[Effect], list[Effect]], step: float) -> Array:
            low, high = (Twin(robot, each).poses(recording, at) for each in effects)
            parts = [high.position - low.position]
            if width > 3:
                turn = high.rotation @ np.swapaxes(low.rotation, -1, -2)
                parts.append(LEVER * Rotation.from_matrix(turn).as_rotvec())
            return np.concatenate(parts, axis=1) / step

        frames = [
            column(([], [REGISTRY[f'{frame}_pose'](**{key: unit})]), STEP)
            for frame in row.align
            for key in ('xyz', 'rotvec')
            for unit in (STEP * FRAMES * np.eye(3)).tolist()
        ]
        columns = {}
        for name, each in kinds.items():
            columns[name] = np.array([column(*_ends(robot, e, k)) for e, k in each])
        count = residual.shape[0]
        return cls(residual, np.array(frames).reshape(-1, count, width), columns, labels, width)

    def rows(self, keep: NDArray[np.bool_], among: Set[str]) -> tuple[Array, Array]:
        """Return target and columns of some measurements, their free points taken out."""
        parts = [self.frames, *(c for name, c in self.columns.items() if name in among)]
        design = np.concatenate(parts)[:, keep]
        target = self.residual[keep]
        if self.labels is not None:
            here = self.labels[keep]
            target, design = target.copy(), design.copy()
            for label in np.unique(here):
                mine = here == label
                target[mine] -= target[mine].mean(axis=0)
                design[:, mine] -= design[:, mine].mean(axis=1, keepdims=True)
        return target.reshape(-1), design.reshape(design.shape[0], target.size)


def _ends(robot: Robot, effect: Effect, k: int) -> tuple[tuple[list[Effect], list[Effect]], float]:
    """Return an effect on both sides of a component, and the difference in spreads."""
    parameter = effect.components()[k][0]
    spread = plausible(robot, effect.name, parameter.name, effect.site).sd
    spread = spread if np.isfinite(spread) else 3.0 * parameter.typical
    vector = effect.vector()
    # What acts at a threshold does nothing over a small step.
    step = STEP if parameter.linear or vector[k] == 0.0 else 0.1
    high = vector.copy()
    high[k] = np.clip(vector[k] + step * spread, parameter.lower, parameter.upper)
    low = vector.copy()
    if high[k] == vector[k]:
        low[k] = vector[k] - step * spread
    low_effect, high_effect = effect.with_vector(low), effect.with_vector(high)
    return ([low_effect], [high_effect]), float((high[k] - low[k]) / spread)


def _left(
    own: _Columns,
    used: NDArray[np.bool_],
    judged: _Columns,
    part: NDArray[np.bool_],
    among: Set[str],
) -> float:
    """Return the RMS position error [m] on some measurements, fitted to others with some kinds."""
    target, design = own.rows(used, among)
    noise = NOISE
    normal, right = design @ design.T, design @ target
    for _ in range(ROUNDS):
        system = normal / noise**2 + np.eye(len(normal))
        step = np.linalg.solve(system, right / noise**2)
        determined = len(step) - float(np.trace(np.linalg.inv(system)))
        remaining = target - step @ design
        noise = float(
            np.sqrt(remaining @ remaining / max(target.size - determined, 0.1 * target.size))
        )
    seen, columns = judged.rows(part, among)
    return rms((seen - step @ columns).reshape(-1, judged.width)[:, :3])


def _parts(recording: Recording) -> list[NDArray[np.bool_]]:
    """Return the parts that take their turn: stretches of time, and regions of posture."""
    t = recording.joints.t if recording.measured is None else recording.measured.t
    if recording.contacts is not None:
        labels = np.array(recording.contacts.labels)
        order = {label: k for k, label in enumerate(dict.fromkeys(labels.tolist()))}
        places = np.array([order[label] for label in labels.tolist()]) // 2
        if np.unique(places).size > 1:
            return [places == k for k in np.unique(places)]
    count = 2**REGIONS
    fold = np.arange(t.size) * count // t.size
    q = recording.joints.at(t)[0]
    region = np.zeros(t.size, dtype=int)
    for _ in range(REGIONS):
        after = 2 * region
        for name in np.unique(region):
            here = np.flatnonzero(region == name)
            widest = int(np.argmax(np.ptp(q[here], axis=0)))
            ordered = here[np.argsort(q[here, widest], kind='stable')]
            after[ordered[ordered.size // 2 :]] += 1
        region = after
    parts = [fold == k for k in range(count)] + [region == k for k in range(count)]
    return [part for part in parts if part.any()]
