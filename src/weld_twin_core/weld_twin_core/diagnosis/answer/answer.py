# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole answer of a diagnosis, from what each step found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ...twin.posterior import Posterior
from ..advice import Limits, actions
from ..advice.next_step import next_step
from ..frames.places import NOT_TOLD, not_told
from ..hypotheses.search import Search
from ..hypotheses.structural_aliases import never_parted
from ..levels.causes import causes
from ..levels.contributions import contributions
from ..levels.curved import Curved
from ..levels.free_form import FreeForm
from ..result import Cause, Diagnosis, Shares, Shrink
from ..soundness import Examined
from ..soundness.efforts import compared
from ..stability.steadied import Stability, of_families, told_back
from ..trust.model import usual_trust
from ..trust.signs import Signs, signs_of_cause
from ..trust.trusted import trusted
from ..unseen.unseen_stretches import Unseen
from ..unseen.where import locate
from ..verdict.decision import Verdict
from ..verdict.evidence import Evidence
from ..verdict.weighing import Weighed
from .changed import changed, untold_check
from .contact_spreads import contact_spreads
from .gap import gap, traces
from .named_effects import named_effects
from .settled import settled
from .share_intervals import with_intervals
from .weighed_candidates import unexplained, weighed_candidates


def answer(
    found: Search,
    unseen: Unseen,
    evidence: Evidence,
    verdict: Verdict,
    shrink: Shrink,
    examined: Examined,
    posterior: Posterior,
    signs: Signs,
    rival: Curved | None = None,
    placing: FreeForm | None = None,
    limits: Limits | None = None,
    stability: Stability | None = None,
) -> Diagnosis:
    """
    Return the diagnosis.

    Parameters
    ----------
    found : Search
    unseen : Unseen
        Of the final model.
    evidence : Evidence
    verdict : Verdict
    shrink : Shrink
    examined : Examined
        Whether the data are sound, and what was mended.
    posterior : Posterior
        The models that the recordings allow.
    signs : Signs
        Of the answer, and of every effect found: what says how far it can be trusted.
    rival : Curved or None
        What explains the gap without a formula.
    placing : FreeForm or None
        What tells place and dependence of an unknown gap.
    limits : Limits or None
        What the next experiment may cost, and where it has to stay; None plans none.
    stability : Stability or None
        What halves of the data say of the names.

    """
    verdict, told, shares, own = _trusted(
        found, unseen, evidence, verdict, signs, rival, placing, stability
    )
    effects, verdict, told = named_effects(found, unseen, verdict, told)
    robot = found.baseline.model.robot
    return Diagnosis(
        gap=gap(found, evidence.floor),
        where=locate(found, unseen, told),
        status=verdict.status,
        effects=effects,
        indistinguishable=verdict.sets,
        reasons=verdict.reasons,
        candidates=weighed_candidates(found, evidence),
        shrink=shrink,
        unexplained=unexplained(found.work.beliefs, evidence, verdict, shrink, placing),
        next_experiment=None if limits is None else next_step(found, verdict, limits, rival),
        actions=actions([named.effect for named in effects], robot, found.final.model.mends),
        model=found.final.model,
        families=verdict.families,
        evidence=evidence,
        posterior=posterior,
        **_parted(unseen, told, shares, verdict),
        signs=own,
        contacts=contact_spreads(found, unseen),
        **_compared(found, examined, verdict),
    )


def _parted(
    unseen: Unseen,
    told: tuple[Cause, ...],
    shares: Shares,
    verdict: Verdict,
) -> dict[str, Any]:
    """Return what the levels of an answer say; what each cause adds, where the model stands for it."""
    return {
        'causes': told,
        'shares': shares,
        'contributions': contributions(unseen, told),
        'confidence': verdict.confidence,
        'sure': verdict.sure,
        'complete': verdict.complete,
    }


def _trusted(
    found: Search,
    unseen: Unseen,
    evidence: Evidence,
    verdict: Verdict,
    signs: Signs,
    rival: Curved | None,
    placing: FreeForm | None,
    stability: Stability | None,
) -> tuple[Verdict, tuple[Cause, ...], Shares, Signs]:
    """Return the verdict and the causes as far as they can be trusted, shares, and all signs."""
    told, shares = causes(
        found, unseen, verdict, rival, evidence.floor, found.work.beliefs, placing
    )
    sizes = (len(told), evidence.gap, evidence.floor)
    known = Signs(
        {
            **signs.answer,
            'top_share': told[0].share if told else 0.0,
            'partly': signs.answer.get('partly', 0.0) * bool(verdict.sets),
        },
        tuple(
            signs_of_cause(cause, k, *sizes, rival, _of_effect(cause, signs))
            for k, cause in enumerate(told)
        ),
    )
    complete = Weighed(evidence, found.work.beliefs).complete
    verdict, told = trusted(replace(verdict, complete=complete), told, known, usual_trust())
    told = told_back(told, verdict, stability)
    if evidence.families is not None:
        told = of_families(told, evidence.families, found.work.beliefs)
    verdict = settled(verdict, told)
    return verdict, with_intervals(told, found, unseen, verdict, evidence.floor), shares, known


def _of_effect(cause: Cause, signs: Signs) -> Mapping[str, float]:
    """Return the signs of the effect that stands for a cause; none of curves and of many."""
    return signs.causes[cause.slot] if cause.slot is not None and signs.causes else {}


def _compared(found: Search, examined: Examined, verdict: Verdict) -> dict[str, Any]:
    """Return the recordings, what they say of each other, and what no recording can say."""
    named = examined.given.may_change
    return {
        'efforts': compared(found.problem.recordings, found.baseline.model.robot),
        'recordings': found.problem.recordings,
        'traces': traces(found),
        'absent': found.library.absent | dict.fromkeys(not_told(found.problem), NOT_TOLD),
        'checks': (*examined.checks, *untold_check(found, named)),
        'changed': changed(found, named),
        'may_change': named,
        'unsound': examined.told(found.final.model.found),
        'same': never_parted(found, verdict.sets),
    }
