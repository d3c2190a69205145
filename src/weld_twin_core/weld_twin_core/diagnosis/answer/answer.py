# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole answer of a diagnosis, from what each step found; or that there is none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import nan
from typing import Any

import numpy as np

from ...twin.posterior import Posterior
from ..advice import Limits, actions
from ..algebra.fit import trusted
from ..algebra.motions import never_parted
from ..algebra.problem import Model
from ..beliefs import Beliefs
from ..calibration.calibrated import Stated, calibrated
from ..calibration.features import of_form
from ..evidence import Alternative, Evidence, Left, Search, Verdict
from ..frames.aligned import NOT_TOLD, other_causes
from ..frames.changes import list_changes, list_undetectable
from ..levels.causes import causes, contributions
from ..levels.curved import Curved
from ..levels.free_form import FreeForm
from ..negligible import EMPTY
from ..result import (
    Candidate,
    Cause,
    Check,
    Diagnosis,
    Found,
    Gap,
    Shares,
    Shrink,
    Traces,
    Unexplained,
    Where,
)
from ..soundness.efforts import compared
from ..soundness.gate import Examined
from ..unseen.unseen_stretches import Unseen
from ..unseen.where import locate
from .contact_spreads import contact_spreads
from .named_effects import named_effects, with_intervals
from .next_step import next_step


def answer(
    result: Search,
    unseen: Unseen,
    evidence: Evidence,
    verdict: Verdict,
    shrink: Shrink,
    examined: Examined,
    posterior: Posterior,
    before: Stated,
    alternative: Curved | None,
    placing: FreeForm,
    limits: Limits | None,
) -> Diagnosis:
    """
    Return the diagnosis of what was found in data that were examined.

    before: the table of answers, and what is said of the names.
    placing: what tells place and dependence of an unknown gap.
    limits: what the next experiment may cost, and where it has to stay; None plans none.
    """
    forms = alternative, Left(evidence, result.work.beliefs), placing
    claims, shares = causes(result, unseen, before.table, verdict, *forms)
    groups = of_form(len(placing.parts), placing.steady)
    verdict, claims, statements = calibrated(verdict, claims, before, groups)
    claims = with_intervals(claims, result, unseen, verdict, evidence.floor)
    effects, verdict, claims = named_effects(result, unseen, verdict, claims, posterior)
    return Diagnosis(
        gap=_gap(result, evidence.floor),
        where=locate(result, evidence.structure, claims),
        status=verdict.status,
        effects=effects,
        indistinguishable=verdict.sets,
        candidates=_weighed_candidates(result, evidence),
        shrink=shrink,
        unexplained=_unexplained(result.work.beliefs, evidence, shrink, placing),
        next_experiment=None
        if limits is None
        else next_step(result, verdict, limits, alternative),
        actions=_mended(result, effects),
        model=_model(result, effects),
        evidence=evidence,
        posterior=posterior,
        **_parted(unseen, claims, shares, verdict),
        statements=statements,
        contacts=contact_spreads(result, unseen),
        **_compared(result, examined, verdict),
    )


def _model(result: Search, effects: Sequence[Found]) -> Model:
    named = tuple((each.effect.name, each.effect.site) for each in effects)
    return replace(result.final.model, named=named)


def _mended(result: Search, effects: Sequence[Found]) -> tuple[str, ...]:
    robot = result.baseline.model.robot
    return actions([each.effect for each in effects], robot, result.final.model.turned)


def _parted(
    unseen: Unseen, claims: tuple[Cause, ...], shares: Shares, verdict: Verdict
) -> dict[str, Any]:
    """Return what the levels of an answer say; what each cause adds, where the model stands for it."""
    return {
        'causes': claims,
        'shares': shares,
        'reasons': verdict.reasons,
        'families': verdict.families,
        'contributions': contributions(unseen, claims),
        'confidence': verdict.confidence,
        'sure': verdict.sure,
        'complete': verdict.complete,
    }


def _compared(result: Search, examined: Examined, verdict: Verdict) -> dict[str, Any]:
    """Return the recordings, what they say of each other, and what no recording can say."""
    named, fitted = examined.given.may_change, (result.problem, result.final.model)
    return {
        'efforts': compared(result.problem.recordings, result.baseline.model.robot),
        'recordings': result.problem.recordings,
        'traces': _traces(result),
        'absent': result.library.absent | dict.fromkeys(other_causes(result.problem), NOT_TOLD),
        'checks': (*examined.checks, *_undetectable_check(list_undetectable(*fitted, named))),
        'changed': list_changes(*fitted, result.scale, result.precision, named),
        'may_change': named,
        'unsound': examined.unsound_with(result.final.model.found, verdict.sets),
        'same': never_parted(result.baseline.model.robot, result.work.problem.align, verdict.sets),
    }


def _undetectable_check(names: Sequence[str]) -> tuple[Check, ...]:
    if not names:
        return ()
    return (
        Check(
            'changes',
            'note',
            'Whether it changed between the recordings cannot be told of: '
            f'{", ".join(names)}. Frames that are fitted take its place, or nothing shows it.',
        ),
    )


def _gap(result: Search, floor: float) -> Gap:
    """Return the gap over trusted samples, without frames and known effects; the floor is in m."""
    parts = result.problem.residuals(result.baseline.model)
    good = trusted(result.scale.weights)
    pairs = list(zip(parts, good, strict=True))
    distance = np.concatenate([np.linalg.norm(p[:3, g], axis=0) for p, g in pairs])
    turns = [p[3:, g] for p, g in pairs if p.shape[0] > 3]
    turn = None
    if turns:
        turn = float(np.sqrt(np.mean(np.concatenate([(t**2).sum(axis=0) for t in turns]))))
    return Gap(
        rms_m=float(np.sqrt((distance**2).mean())),
        mean_m=float(distance.mean()),
        max_m=float(distance.max()),
        orientation_rms_rad=turn,
        samples=int(distance.size),
        noise_floor_m=floor,
    )


def _traces(result: Search) -> Traces:
    recordings = result.problem.recordings
    before = result.problem.residuals(result.baseline.model)
    after = result.problem.residuals(result.final.model)
    return Traces(
        t=tuple(r.seen.t for r in recordings),
        measured=tuple(r.seen.position for r in recordings),
        before=tuple(p[:3].T for p in before),
        after=tuple(p[:3].T for p in after),
        trusted=tuple(trusted(result.scale.weights)),
    )


def _weighed_candidates(result: Search, evidence: Evidence) -> tuple[Candidate, ...]:
    """Return the hypotheses for every candidate set, those of the strongest effect first."""
    out = []
    for candidate_set in evidence.candidate_sets:
        least = _position_rms(result, candidate_set[0])
        for alternative in candidate_set:
            rms = evidence.after * _position_rms(result, alternative) / max(least, EMPTY)
            shrink = 1.0 - rms / max(evidence.gap, EMPTY)
            out.append(Candidate(alternative.site, alternative.probability, rms, shrink))
    return tuple(out)


def _position_rms(result: Search, alternative: Alternative) -> float:
    """Return the RMS position residual of an alternative's fit, weighted, [m]."""
    parts = result.work.problem.by_sample(alternative.fit.residual)
    total = sum(float((part[:, :3] ** 2).sum()) for part in parts)
    count = sum(result.work.problem.samples)
    return result.work.scale.position * float(np.sqrt(total / max(count, 1)))


def _unexplained(
    beliefs: Beliefs, evidence: Evidence, shrink: Shrink, placing: FreeForm
) -> Unexplained:
    """Return what remains after the verdict, and what that, or an unknown gap itself, depends on."""
    case = Left(evidence, beliefs)
    names = evidence.structure.depends_on if case.structured else ()
    if placing.parts:
        names = tuple(dict.fromkeys(part.words for part in placing.parts))
    return Unexplained(shrink.rms_after_m, case.above_noise or case.wide, names)


def refusal(examined: Examined) -> Diagnosis:
    """Return the diagnosis that there is none: status 'unsound', every figure not a number."""
    robot = examined.given.robot
    return Diagnosis(
        gap=Gap(nan, nan, nan, None, 0, nan),
        where=Where((), {}, (), {}, (), ()),
        status='unsound',
        effects=(),
        confidence=nan,
        indistinguishable=(),
        reasons=tuple(item.sentence for item in examined.unsound),
        candidates=(),
        shrink=Shrink(nan, nan, nan, (nan, nan), ''),
        unexplained=Unexplained(nan, above_noise=False),
        next_experiment=None,
        actions=tuple(f'{item.remedy}.' for item in examined.unsound),
        checks=examined.checks,
        model=Model(robot, (robot.T_world_base,)),
        traces=Traces((), (), (), ()),
        recordings=examined.given.recordings,
        unsound=examined.unsound,
    )
