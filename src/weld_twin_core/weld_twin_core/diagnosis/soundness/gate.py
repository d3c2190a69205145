# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The gate before any cause: what is wrong with data and set-up, and what is left once it is undone.

A mistake that is found is undone here on trial, so that the next one shows; only with ``apply``
does a diagnosis go on with the data so mended.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from ...effects.effect import Effect
from ...recording import Recording, on_one_clock
from ..algebra.problem import ROWS, Model, Problem
from ..beliefs import Beliefs
from ..frames.aligned import aligned, tracked_part
from ..frames.alignment import refined
from ..frames.changes import with_changes
from ..limits import MOST
from ..result import Check, Site, Unsound
from .computed import computed, source
from .efforts import efforts
from .evidence import Case, Finding, mistake
from .images import images
from .mending import ONE, Given, as_entry
from .mixups import mixups
from .richness import motion, outliers, quantity, repeats
from .rows import rows
from .set_up import gravity, orientation, parted, setup
from .slips import Slip
from .stamps import clocks, stamps, streams, velocities_checked
from .stuck import stuck, without_astray
from .touches import touches


def readings(case: Case) -> Sequence[Finding]:
    """
    Return what stands still, or the mix-up that explains it.

    A joint that is counted from the ground reads the same while the one before it carries it along.
    """
    still = list(stuck(case))
    return [each for each in mixups(case) if each.mend] or still if still else []


CHECKS: dict[str, tuple[Callable[[Case], Iterable[Finding]], str]] = {
    'quantity': (quantity, 'There is enough to work on.'),
    'readings': (readings, 'No reading stands still while the tool moves.'),
    'tools': (parted, 'No recording has another tool than the first.'),
    'images': (images, 'No camera measured.'),
    'rows': (rows, 'Each measurement belongs to the station that it stands beside.'),
    'units, signs, joints, robot': (mixups, 'Joints, positions and robot belong together.'),
    'gravity': (gravity, 'Gravity pulls down where the base stands.'),
    'efforts': (efforts, 'No measured effort of the joints is used.'),
    'orientation': (orientation, 'Orientations turn as the joints say.'),
    'instrument': (computed, 'The poses have the noise of an instrument.'),
    'clocks': (clocks, 'Joint and measurement stamps belong to one clock.'),
    'stamps': (stamps, 'Stamps come regularly and without gaps.'),
    'repeats': (repeats, 'Nothing was recorded twice.'),
    'source of the joints': (source, 'Joint positions are not plainly those of a command.'),
    'motion': (motion, 'Every joint moves, both ways, and the frames can be told apart.'),
    'outliers': (outliers, 'No single reading stands out from its neighbours.'),
    'set-up': (setup, 'The set-up did not move while it was measured.'),
}
"""Every check by name: the function, and what it says when it finds nothing."""


@dataclass(frozen=True, eq=False)
class Examined:
    given: Given  # as it came, or mended where mistakes were undone
    posed: tuple[Problem, Model] | None
    """To be diagnosed; None where something is wrong that was not undone."""
    checks: tuple[Check, ...]
    unsound: tuple[Unsound, ...]
    mistakes: tuple[Finding, ...]  # those that were undone
    slips: tuple[Slip, ...] = ()
    """What seems to have given way at an instant: causes that ``posed`` offers the search."""

    def unsound_with(
        self, result: Sequence[Effect], sets: Sequence[Sequence[Site]]
    ) -> tuple[Unsound, ...]:
        """
        Return the mistakes, and the slips that a fit has among what it found.

        sets: sites that all the data do not tell apart; what else looked the same at first is out.
        """
        kept = {effect.key for effect in result}
        slips = (
            slip.told_as(each, sets)
            for slip in self.slips
            for each in slip.any_of
            if each.key in kept
        )
        own = (_gave_way(slip, self.given).as_unsound(applied=True) for slip in slips)
        return (*self.unsound, *own)

    def comparing_tools(self, problem: Problem, model: Model) -> Examined:
        """
        Return the same, the tools of several recordings compared once more.

        Beside the gap that a spring makes another tool hardly shows: ``model`` has it explained. A
        tool that slipped is in the model, and is told as a cause.
        """
        if problem.touched:
            return self
        known = replace(model, known=(*model.known, *model.found), found=())
        told = [
            Check('tools', 'warning', f'{each.sentence} {each.remedy}'.strip())
            for each in parted(Case(problem, known))
        ]
        slipped = any(each.traits.dated and each.at == 'tool' for each in model.found)
        if not told and not slipped:
            return self
        return replace(self, checks=(*told, *(c for c in self.checks if c.name != 'tools')))

    def mended(self, recordings: Sequence[Recording]) -> tuple[Recording, ...]:
        """Return other recordings of the same cell after the corrections that are not of one alone."""
        out = Given(tuple(recordings), self.given.robot, self.given.align)
        for each in self.mistakes:
            if each.mend is not None and ONE not in (as_entry(each.mend) or {}):
                out = each.mend(out)
        names = out.robot.joint_names
        return tuple(without_astray(velocities_checked(one), names)[0] for one in out.recordings)


def examine(
    given: Given,
    known: Sequence[Effect] = (),
    *,
    apply: bool = False,
    beliefs: Beliefs | None = None,
) -> Examined:
    """
    Return what is wrong with data and set-up, some effects known; DataError for nothing to work on.

    apply: go on with mended data where every mistake can be undone.
    beliefs: what a difference between recordings must be worth.
    """
    if len(given.recordings) > 1:
        given = replace(given, recordings=on_one_clock(given.recordings))
    left_out, given = _astray(given)
    trial, mistakes, look = given, list[Finding](), _Look()
    for _ in range(MOST + 1):  # what is undone shows what it hid
        look = _Look(mistakes=streams(trial))
        if not look.mistakes:
            # Known effects of another robot mean nothing on this one.
            own = known if trial.robot.joint_names == given.robot.joint_names else ()
            posed = aligned(trial.recordings, trial.robot, trial.align, tuple(own))
            look = _looked(*with_changes(*posed, trial.may_change, beliefs or Beliefs()))
        earlier = {each.sentence for each in mistakes}
        fresh = [each for each in look.mistakes if each.sentence not in earlier]
        mistakes += fresh
        mends = [each.mend for each in fresh if each.mend is not None]
        if not fresh or len(mends) < len(fresh):
            break
        for mend in mends:
            trial = mend(trial)
    done = apply and look.posed is not None and all(m.mend is not None for m in mistakes)
    return Examined(
        trial if done else given,
        look.marked(mistakes) if done or not mistakes else None,
        # What the checks say of data mended on trial holds for nothing that was given.
        (
            *left_out,
            *_first(mistakes, applied=done),
            *(look.checks if done or not mistakes else ()),
        ),
        (*(m.as_unsound(applied=done) for m in mistakes), *look.unsound),
        tuple(mistakes) if done else (),
        look.dated,
    )


def _astray(given: Given) -> tuple[list[Check], Given]:
    """Return which joints' readings strayed by themselves, and what was given without them."""
    each = [without_astray(own, given.robot.joint_names) for own in given.recordings]
    out = [Check('joint readings', 'warning', sentence) for _, said in each for sentence in said]
    return out, replace(given, recordings=tuple(kept for kept, _ in each))


def _first(mistakes: Sequence[Finding], *, applied: bool) -> list[Check]:
    what = 'mended' if applied else 'data and set-up'
    return [Check(what, each.level, each.sentence) for each in mistakes]


class _Look(NamedTuple):
    posed: tuple[Problem, Model] | None = None
    checks: tuple[Check, ...] = ()
    mistakes: list[Finding] = []
    dated: tuple[Slip, ...] = ()
    unsound: tuple[Unsound, ...] = ()

    def marked(self, mistakes: Sequence[Finding]) -> tuple[Problem, Model] | None:
        """Return the problem with what gave way, and the model with what was undone."""
        if self.posed is None:
            return None
        sudden = tuple(each for slip in self.dated for each in slip.any_of)
        problem = replace(self.posed[0], dated=sudden)
        sentences = tuple(each.sentence for each in mistakes)
        made = tuple(e for each in mistakes if (e := as_entry(each.mend)) is not None)
        return problem, replace(self.posed[1], mended=sentences, mends=made)


def _looked(problem: Problem, model: Model) -> _Look:
    if not problem.touched:
        return _checked(problem, model)
    touched = touches(problem, model)
    said = tuple(Check('contacts', 'warning', item.sentence) for item in touched.unsound)
    look = _Look(touched[:2], said, list(touched.mistakes), (), touched.unsound)
    if problem.untracked:
        return look
    # Of an instrument's recordings beside contacts nothing is mended.
    part = tracked_part(touched.problem, touched.model)
    beside = _checked(*part)
    mistakes = [*beside.mistakes, *(_gave_way(slip, part[0]) for slip in beside.dated)]
    found = [*look.mistakes, *(each._replace(mend=None) for each in mistakes)]
    return look._replace(checks=(*said, *beside.checks), mistakes=found)


def _checked(problem: Problem, model: Model) -> _Look:
    """Return what the checks say, the mistakes among it, and what gave way; a mistake ends it."""
    case = Case(problem, refined(problem.thinned(ROWS), model) if problem.align else model)
    out: list[Check] = []
    for name, (look, passed) in CHECKS.items():
        result = list(look(case))
        mistakes = [each for each in result if each.level == 'unsound']
        if mistakes:
            return _Look((problem, model), tuple(out), mistakes)
        out += [Check(name, f.level, f.sentence) for f in result] or [Check(name, 'ok', passed)]
    return _Look((problem, model), tuple(out), [], tuple(case.slips))


def _gave_way(slip: Slip, of: Given | Problem) -> Finding:
    """Return the mistake that a slip is."""
    sentence = slip.sentence(of.recordings[slip.recording])
    return mistake(sentence, slip.kind, (slip.effect.at,), slip.remedy, alike=slip.alike)
