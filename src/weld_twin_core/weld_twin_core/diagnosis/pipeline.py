# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The steps of a diagnosis, in order; every step is a room of its own."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ..arm.robot import Robot
from ..effects.effect import Effect
from ..recording import Recording
from .algebra.noise_floor import noise_floor
from .answer.answer import answer
from .frames.aligned import aligned
from .hypotheses.search import search
from .many.family_verdict import family_verdict
from .many.fitted_together import fitted_together
from .result import Diagnosis
from .soundness import check
from .unseen.held_out_shrink import held_out_shrink
from .unseen.leftover_structure import structure
from .unseen.unseen_stretches import Unseen
from .verdict.decision import decide
from .verdict.gathered_evidence import gathered

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
    problem, start = aligned(recordings, robot, align, known)
    checks = check(problem, start)
    progress('data checked')
    found = search(problem, start, exclude, progress)
    found = fitted_together(found, exclude, progress)
    unseen = Unseen.of(found.problem, found.scale, found.final, found.precision)
    leftover = structure(unseen, found.final.model)
    progress('looked for what is left')
    noise = noise_floor(found.problem, found.problem.residuals(found.final.model))
    shrink = held_out_shrink(found, unseen, holdout)
    evidence = gathered(found, unseen, leftover, shrink, noise)
    verdict = family_verdict(found, unseen, evidence) if found.dense else decide(evidence)
    return answer(
        found=found,
        unseen=unseen,
        evidence=evidence,
        verdict=verdict,
        noise=noise,
        shrink=shrink,
        checks=checks,
    )
