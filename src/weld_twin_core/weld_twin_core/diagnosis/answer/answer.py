# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole answer of a diagnosis, from what each step found."""

from __future__ import annotations

from typing import Any

from ...twin.posterior import Posterior
from ..advice import Limits, actions
from ..advice.next_step import next_step
from ..calibration.calibrated import Stated, calibrated
from ..frames.aligned import NOT_TOLD, not_told
from ..hypotheses.search import Search
from ..hypotheses.structural_aliases import never_parted
from ..levels.causes import causes
from ..levels.contributions import contributions
from ..levels.curved import Curved
from ..levels.free_form import FreeForm
from ..result import Cause, Diagnosis, Shares, Shrink
from ..soundness.efforts import compared
from ..soundness.gate import Examined
from ..unseen.unseen_stretches import Unseen
from ..unseen.where import locate
from ..verdict.decision import Verdict
from ..verdict.evidence import Evidence
from .changed import changed, untold_check
from .contact_spreads import contact_spreads
from .gap import gap, traces
from .named_effects import named_effects
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
    before: Stated,
    rival: Curved | None = None,
    placing: FreeForm | None = None,
    limits: Limits | None = None,
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
    before : Stated
        The table of answers, and what is said of the names.
    rival : Curved or None
        What explains the gap without a formula.
    placing : FreeForm or None
        What tells place and dependence of an unknown gap.
    limits : Limits or None
        What the next experiment may cost, and where it has to stay; None plans none.

    """
    forms = rival, evidence.floor, found.work.beliefs, placing
    told, shares = causes(found, unseen, before.table, verdict, *forms)
    verdict, told, statements = calibrated(verdict, told, before, placing)
    told = with_intervals(told, found, unseen, verdict, evidence.floor)
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
        statements=statements,
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
