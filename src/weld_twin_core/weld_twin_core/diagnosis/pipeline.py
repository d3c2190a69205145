# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The steps of a diagnosis, in order; every step is a room of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from math import sqrt

from ..arm.robot import Robot
from ..effects.effect import Effect
from ..recording import Recording
from .advice import Limits
from .algebra.fit import LEAST_NOISE, NOISE_TRUST
from .algebra.noise_floor import noise_floor
from .algebra.open_directions import keep_open_directions
from .algebra.problem import frames_named
from .answer.answer import answer, refusal
from .beliefs import Beliefs
from .calibration.calibrated import Stated, stated
from .evidence import LIKELIER, Evidence, Row, Search, Verdict, beyond_doubt
from .frames.aligned import other_causes
from .frames.changes import families_named, settled_between
from .hypotheses.search import borne_out, search
from .hypotheses.selection import implausible
from .levels.curved import choose_model, curved, locate_gap, no_noise
from .levels.gathered import gathered
from .many.fitted_together import fitted_together
from .many.weighed_families import Weighed, weighed_families
from .predicting.allowed import allowed, elsewhere, shown_beside_others
from .predicting.alone import alone
from .result import Diagnosis, Shrink, Structure
from .soundness.efforts import with_sign
from .soundness.gate import Examined, examine
from .soundness.mending import Given
from .soundness.richness import refuse_reused, with_temperatures
from .unseen.held_out_shrink import held_out_shrink, left_on
from .unseen.unseen_stretches import Unseen
from .unseen.where import structure
from .verdict.decision import decide

Progress = Callable[[str], None]


def diagnose(
    recordings: Recording | Sequence[Recording],
    robot: Robot,
    *,
    align: str | Iterable[str] = (),
    known: Sequence[Effect] = (),
    exclude: Sequence[str] = (),
    holdout: Sequence[Recording] = (),
    beliefs: Beliefs | None = None,
    apply: bool = False,
    may_change: str | Iterable[str] = (),
    limits: Limits | None = None,
    experiment: bool = True,
    progress: Progress = lambda text: None,
) -> Diagnosis:
    """
    Say where the gap between a robot's model and the real cell lies, and what causes it.

    Parameters
    ----------
    recordings : Recording, or sequence of Recording
        Joint streams with measured poses or points; each has its own base frame when ``align``
        names 'base'.
    robot : Robot
        The nominal model.
    align : str or iterable of str
        Frames that are not known, fitted along in every hypothesis: 'base', 'tool',
        'base,tool', or the names in a list or a set.
    known : sequence of Effect
        Put into the twin first; what remains is diagnosed.
    exclude : sequence of str
        Families that are still tried, but never named alone.
    holdout : sequence of Recording
        No effect is fitted to them; they judge the shrink. Without any, each fold of the recordings
        is left out in turn.
    beliefs : Beliefs, optional
        The numbers that decide the verdict; the usual ones when left out.
    apply : bool
        Where data or set-up are wrong in a way that can be undone: undo it and go on. Otherwise
        the answer is then 'unsound' and says what is wrong.
    may_change : str or iterable of str
        Constant errors that may differ between the recordings, with commas between or in a list:
        'joint_offset,tool_pose,base_pose'. They are fitted along, and ``changed`` says what the
        later recordings have that the first has not.
    limits : Limits, optional
        What the next experiment may cost, and where it has to stay.
    experiment : bool
        Plan the next experiment where one is needed; without, that takes no time.
    progress : callable
        Called with a few words on what has been done.

    Returns
    -------
    Diagnosis
        ``status`` is 'identified', 'ambiguous', 'unknown', 'none' or 'unsound'; ``effects`` holds
        what was found, with standard errors; ``traces`` holds the residuals as arrays.

    Raises
    ------
    DataError
        The data cannot be diagnosed; the message says what to mend.
    ModelError
        ``align`` names something else than base and tool, or ``may_change`` an error that is not
        constant.

    Examples
    --------
    A UR5 with 0.5 mrad of play in its elbow, measured with 20 um of noise, is diagnosed.

    >>> import numpy as np
    >>> import weld_twin_core as wt
    >>> robot = wt.load('ur5')
    >>> plan = wt.plan(robot, wt.default_seam(robot, 'spline'), 'aggressive', rate_hz=50.0)
    >>> commanded = wt.Recording('seam', plan.motion)
    >>> play = wt.effects.Backlash('elbow_joint', width=5e-4)
    >>> real = wt.Twin(robot, [play]).poses(commanded)
    >>> noise = np.random.default_rng(7).normal(scale=2e-5, size=real.position.shape)
    >>> measured = wt.Measurements(plan.motion.t, real.position + noise)
    >>> found = wt.diagnose(commanded.with_measured(measured), robot)
    >>> print(found.status, found.effects[0].effect.name, found.effects[0].effect.joint)
    identified backlash elbow_joint

    """
    beliefs = beliefs or Beliefs()
    recordings = (recordings,) if isinstance(recordings, Recording) else tuple(recordings)
    refuse_reused(recordings, holdout)
    recordings = with_sign(with_temperatures(recordings, holdout), robot)
    given = Given(recordings, robot, frames_named(align), families_named(may_change))
    examined = examine(given, known, apply=apply, beliefs=beliefs)
    progress('data checked')
    if examined.posed is None:
        return refusal(examined)
    exclude = (*exclude, *other_causes(examined.posed[0]))
    asked = (limits or Limits()) if experiment else None
    return _explained(examined, exclude, holdout, beliefs, asked, progress)


def _explained(
    examined: Examined,
    exclude: Sequence[str],
    holdout: Sequence[Recording],
    beliefs: Beliefs,
    limits: Limits | None,
    progress: Progress,
) -> Diagnosis:
    """Return the diagnosis of recordings that were found sound."""
    assert examined.posed is not None
    result = search(*examined.posed, exclude, beliefs, progress)
    result = fitted_together(result, exclude, beliefs, progress)
    result = settled_between(result, examined.given.may_change, beliefs)
    examined = examined.comparing_tools(result.problem, result.final.model)
    out = _conclude(result, examined, holdout, beliefs, limits, progress)
    other = result.other_way
    if other is None or _named(out):
        return out
    # Where the answer that no name fits is itself probably right, the many are not tried.
    nameless = max(out.confidence, getattr(out.evidence, 'nameless', 0.0)) > LIKELIER
    if other.dense and (nameless or out.status != 'unknown'):
        return out
    progress('nothing is named: the other way to explain it')
    instead = _conclude(other, examined, holdout, beliefs, limits, progress)
    return instead if _named(instead) else out


def _named(out: Diagnosis) -> bool:
    """Return whether a cause is named that is likelier right than wrong."""
    return any(cause.effect is not None and cause.probability > LIKELIER for cause in out.causes)


def _conclude(
    result: Search,
    examined: Examined,
    holdout: Sequence[Recording],
    beliefs: Beliefs,
    limits: Limits | None,
    progress: Progress,
) -> Diagnosis:
    """Return the diagnosis of what was found."""
    holdout = examined.mended(holdout)
    result = _borne_out(result, holdout, beliefs)
    result, unseen, leftover, with_strays = _without_strays(result, beliefs)
    progress('looked for what is left')
    residuals = result.problem.residuals(result.final.model)
    # As many coordinates as rows leave nothing of a noise that is there all the same.
    expected = LEAST_NOISE * sqrt(NOISE_TRUST / result.problem.size) if result.dense else 0.0
    floor = noise_floor(result.problem, residuals, expected)
    shrink = held_out_shrink(result, unseen, holdout, beliefs)
    weighed = weighed_families(result, unseen, beliefs) if result.dense else None
    families = None if weighed is None else weighed.families
    evidence = gathered(result, unseen, leftover, shrink, floor, families, beliefs, with_strays)
    evidence = replace(evidence, shown=_shown(result))
    table = tuple(Row.of(candidate_set, beliefs) for candidate_set in result.candidate_sets)
    statements = stated(evidence, table, beliefs)
    evidence = statements.put_to(evidence)
    verdict = _decided(evidence, weighed, statements, beliefs)
    alternative = curved(result, verdict, beliefs)
    verdict = no_noise(verdict, alternative, beliefs)
    unseen.forget_other_parts()
    places = locate_gap(result, verdict, alternative, evidence, beliefs)
    progress('held against curves without a formula')
    which = verdict, alternative, holdout, beliefs
    result, unseen, shrink, verdict = choose_model(result, unseen, shrink, *which)
    result = _alone(_near_given_frames(result, examined.given.robot), shrink)
    fitted = (result.final.model, result.scale, result.precision)
    posterior = allowed(result.problem, *fitted, floor, nameless=verdict.status == 'unknown')
    if result.final.model.found:
        shrink = elsewhere(shrink, posterior)
    progress('weighed what the data leave open')
    reported = (statements, alternative, places, limits)
    return answer(result, unseen, evidence, verdict, shrink, examined, posterior, *reported)


def _shown(result: Search) -> tuple[float, ...]:
    """Return how sure each of a few effects is beside all small errors of an arm."""
    if result.dense:
        return ()
    return shown_beside_others(result.problem, result.final.model, result.scale)


def _decided(
    evidence: Evidence, weighed: Weighed | None, statements: Stated, beliefs: Beliefs
) -> Verdict:
    """Return the verdict; kinds of many errors that are doubted by themselves are put together."""
    verdict = decide(evidence, beliefs)
    if weighed is None:
        return verdict
    families = weighed.joined(verdict.families, statements.believed)
    return decide(replace(evidence, families=families), beliefs)


def _borne_out(result: Search, holdout: Sequence[Recording], beliefs: Beliefs) -> Search:
    """Return what was found as held-out recordings, if there are any, bear it out."""
    if not holdout:
        return result
    return borne_out(result, partial(left_on, holdout=holdout, beliefs=beliefs), beliefs)


def _without_strays(result: Search, beliefs: Beliefs) -> tuple[Search, Unseen, Structure, float]:
    """
    Return what was found, unseen parts of the data, and what generic columns find there.

    Readings that stray by themselves are noise, and are left out, unless something regular is left
    with them: a cause that shows at few places only looks like strays. What is left with them on unseen
    data, RMS [m], comes last.
    """
    unseen = Unseen.of(result.problem, result.scale, result.final, result.precision)
    model, baseline = result.final.model, result.baseline
    leftover, left = structure(unseen, model, baseline, beliefs), unseen.rms(unseen.whole)
    apart = result.apart_from_strays()
    if apart is result or beyond_doubt(leftover, beliefs):
        return result, unseen, leftover, left
    unseen = Unseen.of(apart.problem, apart.scale, apart.final, apart.precision)
    return apart, unseen, structure(unseen, model, baseline, beliefs), left


def _alone(result: Search, shrink: Shrink) -> Search:
    """Return what was found with what a robot file alone does of it."""
    model = result.final.model
    fitted = result.problem, model, result.scale
    own = replace(model, alone=alone(*fitted, shrink, result.work.beliefs, many=result.dense))
    return replace(result, final=replace(result.final, model=own))


def _near_given_frames(result: Search, robot: Robot) -> Search:
    """Return what was found with its frames as near to the given ones as machines and data bear."""
    final = keep_open_directions(
        result.final, result.problem, result.scale, result.precision, robot
    )
    pushed = implausible(final.model) and not implausible(result.final.model)
    return result if pushed else replace(result, final=final)
