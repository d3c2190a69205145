# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The sim-to-real gap: where it lies, which effect causes it, how far it shrinks."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..arm.robot import Robot
from ..effects.effect import Effect
from ..recording import Recording
from .advice import actions, next_experiment
from .algebra.noise_floor import noise_floor
from .algebra.problem import Model, Problem, usable
from .algebra.uncertainty import standard_errors
from .frames.alignment import initial_frames
from .hypotheses.rivals import Rival
from .hypotheses.search import Search, search
from .many.family_verdict import family_verdict
from .result import (
    Candidate,
    Diagnosis,
    Found,
    Gap,
    Site,
    Traces,
    Unexplained,
)
from .soundness import check
from .unseen.held_out_shrink import held_out_shrink
from .unseen.leftover_structure import structure
from .unseen.unseen_stretches import TRUSTED, Unseen
from .unseen.where import locate
from .verdict.decision import Evidence, Verdict, decide
from .verdict.partial_ripple import glimpsed

Progress = Callable[[str], None]


def diagnose(
    recordings: Sequence[Recording],
    robot: Robot,
    *,
    align: frozenset[str] = frozenset(),
    known: Sequence[Effect] = (),
    exclude: Sequence[str] = (),
    holdout: Sequence[Recording] = (),
    progress: Progress = lambda text: None,
) -> Diagnosis:
    """
    Diagnose the gap between a robot and recordings of the real cell.

    Parameters
    ----------
    recordings : sequence of Recording
        Joint streams with measured poses or points; each has its own base frame when ``align``
        names 'base'.
    robot : Robot
        The nominal model.
    align : frozenset of str
        Frames fitted as nuisance in every hypothesis: 'base', 'tool'.
    known : sequence of Effect
        Put into the twin first; what remains is diagnosed.
    exclude : sequence of str
        Families taken out of the library.
    holdout : sequence of Recording
        Never fitted; judge the shrink. Left out, stretches of the recordings take their turn.
    progress : callable
        Told what has been done.

    Raises
    ------
    DataError
        The data cannot be diagnosed; the message says what to mend.

    """
    problem = Problem(tuple(usable(r) for r in recordings), frozenset(align))
    start = Model(robot, tuple(robot.T_world_base for _ in recordings), tuple(known))
    start = initial_frames(problem, start)
    checks = check(problem, start)
    progress('data checked')
    found = search(problem, start, exclude, progress)
    unseen = Unseen.of(found.problem, found.scale, found.final, found.precision)
    kept = list(range(len(found.final.model.found)))
    sigma, independent = noise_floor(found.problem, found.problem.residuals(found.final.model))
    floor = sigma * float(np.sqrt(3.0))
    loose = structure(unseen, found.final.model, kept)
    progress('looked for what is left')
    shrink = held_out_shrink(found, unseen, holdout)
    slots = found.slots
    evidence = Evidence(
        slots,
        loose,
        shrink.rms_before_m,
        shrink.rms_after_m,
        floor,
        unseen.rms(unseen.predict(kept)),
        independent,
        _parts(unseen),
        glimpsed(found.problem, found.final.model),
    )
    verdict = family_verdict(found, unseen, evidence) if found.dense else decide(evidence)
    baseline = Unseen.of(found.problem, found.scale, found.baseline, np.zeros(0))
    where = locate(found.problem, baseline, found.baseline.model, unseen, found.final.model)
    progress('located')
    effects = _effects(found, unseen, verdict)
    return Diagnosis(
        gap=_gap(found, floor),
        where=where,
        status=verdict.status,
        effects=effects,
        confidence=verdict.confidence,
        indistinguishable=verdict.sets,
        reasons=verdict.reasons,
        candidates=_candidates(found, slots, evidence),
        shrink=shrink,
        unexplained=_unexplained(evidence),
        next_experiment=_next(found, slots, verdict),
        actions=actions([f.effect for f in effects], robot),
        checks=checks,
        model=found.final.model,
        traces=_traces(found),
        absent=found.library.absent,
        recordings=found.problem.recordings,
        families=verdict.families,
    )


def _gap(found: Search, floor: float) -> Gap:
    parts = found.problem.residuals(found.baseline.model)
    good = [w >= TRUSTED for w in found.scale.weights]
    distance = np.concatenate(
        [np.linalg.norm(p[:3, g], axis=0) for p, g in zip(parts, good, strict=True)]
    )
    turns = [p[3:, g] for p, g in zip(parts, good, strict=True) if p.shape[0] > 3]
    turn = None
    if turns:
        turn = float(np.sqrt(np.mean(np.concatenate([(t**2).sum(axis=0) for t in turns]))))
    return Gap(
        float(np.sqrt((distance**2).mean())),
        float(distance.mean()),
        float(distance.max()),
        turn,
        int(distance.size),
        floor,
    )


def _effects(found: Search, unseen: Unseen, verdict: Verdict) -> tuple[Found, ...]:
    """Return the effects named, those that move the tool most first."""
    if verdict.status in ('none', 'unknown') and not verdict.sets:
        return ()
    model = found.final.model
    worth = (unseen.targets[1:] ** 2).sum(axis=1)
    errors = standard_errors(
        found.problem, model, found.scale, found.precision, _independent(found)
    )
    named = {site for group in verdict.sets for site in group}
    out = [
        (worth[k], Found(effect, errors[k]))
        for k, effect in enumerate(model.found)
        if Site(effect.name, effect.site) in named
    ]
    return tuple(item for _, item in sorted(out, key=lambda pair: -pair[0]))


def _independent(found: Search) -> float:
    return max(found.effective(found.small) / found.small.residual.size, 1e-3)


def _candidates(
    found: Search, slots: tuple[tuple[Rival, ...], ...], evidence: Evidence
) -> tuple[Candidate, ...]:
    """Return the hypotheses for every slot, those of the strongest effect first."""
    out = []
    for slot in slots:
        least = _position_rms(found, slot[0])
        for rival in slot:
            rms = evidence.after * _position_rms(found, rival) / max(least, 1e-300)
            shrink = 1.0 - rms / max(evidence.gap, 1e-300)
            out.append(Candidate(rival.site, rival.probability, rms, shrink))
    return tuple(out)


def _parts(unseen: Unseen) -> tuple[float, ...]:
    parts = unseen.targets[1:]
    total = parts.sum(axis=0)
    return tuple(float(p @ p) / max(float(total @ total), 1e-300) for p in parts)


def _position_rms(found: Search, rival: Rival) -> float:
    """Return the RMS position residual of a rival's fit, weighted, [m]."""
    at, total, count = 0, 0.0, 0
    for c, m in zip(found.work.problem.rows, found.work.problem.samples, strict=True):
        part = rival.fit.residual[at : at + c * m].reshape(m, c)[:, :3]
        at += c * m
        total += float((part**2).sum())
        count += m
    return found.work.scale.position * float(np.sqrt(total / max(count, 1)))


def _unexplained(evidence: Evidence) -> Unexplained:
    names = evidence.structure.depends_on if evidence.structured else ()
    return Unexplained(evidence.after, evidence.above_noise, names)


def _next(
    found: Search, slots: tuple[tuple[Rival, ...], ...], verdict: Verdict
) -> dict[str, object] | None:
    if verdict.status not in ('ambiguous', 'unknown'):
        return None
    model = found.small.model
    alternatives = [model.found]
    for slot in slots:
        chosen = [r for r in slot if r.site in {s for group in verdict.sets for s in group}]
        alternatives += [r.fit.model.found for r in chosen if r.fit.model.found != model.found]
    return next_experiment(found.work.problem, model, alternatives[:4], found.work.scale)


def _traces(found: Search) -> Traces:
    recordings = found.problem.recordings
    before = found.problem.residuals(found.baseline.model)
    after = found.problem.residuals(found.final.model)
    return Traces(
        tuple(r.measured.t for r in recordings if r.measured is not None),
        tuple(r.measured.position for r in recordings if r.measured is not None),
        tuple(p[:3].T for p in before),
        tuple(p[:3].T for p in after),
        tuple(w >= TRUSTED for w in found.scale.weights),
    )
