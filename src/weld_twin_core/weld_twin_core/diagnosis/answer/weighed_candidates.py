# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The hypotheses weighed for every effect found, what each would bring, and what remains."""

from __future__ import annotations

import numpy as np

from ..beliefs import Beliefs
from ..hypotheses.rivals import Rival
from ..hypotheses.search import Search
from ..levels.free_form import FreeForm
from ..result import Candidate, Shrink, Unexplained
from ..verdict.decision import Left, Verdict
from ..verdict.evidence import Evidence


def weighed_candidates(found: Search, evidence: Evidence) -> tuple[Candidate, ...]:
    """Return the hypotheses for every slot, those of the strongest effect first."""
    out = []
    for slot in evidence.slots:
        least = _position_rms(found, slot[0])
        for rival in slot:
            rms = evidence.after * _position_rms(found, rival) / max(least, 1e-300)
            shrink = 1.0 - rms / max(evidence.gap, 1e-300)
            out.append(Candidate(rival.site, rival.probability, rms, shrink))
    return tuple(out)


def _position_rms(found: Search, rival: Rival) -> float:
    """Return the RMS position residual of a rival's fit, weighted, [m]."""
    parts = found.work.problem.by_sample(rival.fit.residual)
    total = sum(float((part[:, :3] ** 2).sum()) for part in parts)
    count = sum(found.work.problem.samples)
    return found.work.scale.position * float(np.sqrt(total / max(count, 1)))


def unexplained(
    beliefs: Beliefs,
    evidence: Evidence,
    verdict: Verdict,
    shrink: Shrink,
    placing: FreeForm | None,
) -> Unexplained:
    """
    Return what remains after the verdict, and what that or the gap itself depends on.

    Parameters
    ----------
    beliefs : Beliefs
    evidence : Evidence
    verdict : Verdict
    shrink : Shrink
        Of the model that is carried.
    placing : FreeForm or None
        What tells the places of an unknown gap, so that this says what the causes say.

    """
    case = Left(evidence, beliefs)
    names = evidence.structure.depends_on if case.structured else ()
    if verdict.status == 'unknown' and placing is not None and placing.parts:
        names = tuple(dict.fromkeys(part.words for part in placing.parts))
    return Unexplained(shrink.rms_after_m, case.above_noise, names)
