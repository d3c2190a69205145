# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is said of one cause, wherever it is said: card, table of causes, terminal."""

import re
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from weld_twin_core.diagnosis.advice import actions
from weld_twin_core.diagnosis.result import NAMING, Cause, Diagnosis, Site
from weld_twin_core.effects import REGISTRY
from weld_twin_core.effects.effect import Effect
from weld_twin_nodes.wording import mending
from weld_twin_nodes.wording.mending import alternatives, as_it_is, cause_name, trusted
from weld_twin_nodes.wording.quantities import millimetres, odds, with_ends
from weld_twin_nodes.wording.words import (
    CURVES,
    DEPENDENCES,
    capital,
    cause,
    depending,
    leading,
    likely,
    place_name,
    same_words,
    site_name,
    unnamed,
)

from .charts import values
from .controllers import BRANDS, UNCHECKED, UNNAMED, correction, gearing
from .page_data import components, rms_words, seen_at, sides_words
from .to_do import TOGETHER

LEVEL_HEADS = ('Share of the gap', 'Where', 'Depends on', 'Name')
_LISTED = 3
"""Places, dependences or names listed for a level."""
_ACTIONS = 4
"""Effects of a cause whose remedies are listed; effects.yaml has all."""
_LATE = {'servo_lag', 'time_delay'}
"""Causes that read otherwise where the joints were commanded, not measured."""
_SOURCE = 'source of the joints'
"""Name of the check that tells so."""
_BY_CURVE = 'That is with programs corrected by the curve.'
_SHORT = ' That curve follows only part of what happens here, so it takes off less than the share.'
_RADIANS = re.compile(r' \([^)]*mrad\)')
_SENTENCE = re.compile(r'(?<=\.) (?=[A-Z])')


@dataclass(frozen=True, eq=False)
class CauseAnswer:
    diagnosis: Diagnosis
    k: int  # the cause, counted from 0
    brand: str | None = None  # whose controller it is, as `controllers.BRANDS` has it

    @cached_property
    def cause(self) -> Cause:
        return self.diagnosis.causes[self.k]

    @cached_property
    def name(self) -> str:
        return capital(cause_name(self.diagnosis, self.cause))

    @cached_property
    def effects(self) -> list[Effect]:
        """Return the effects in the twin that stand for it; of a cause without a name only curves do."""
        result = self.diagnosis.model.found
        effects = [result[m] for m in self.cause.members if m < len(result)]
        return [e for e in effects if e.name in CURVES] if unnamed(self.cause) else effects

    @cached_property
    def alike(self) -> tuple[Site, ...]:
        """Return what these data cannot tell apart; nothing where its name is settled."""
        return alternatives(self.diagnosis, self.cause)

    @property
    def meaning(self) -> list[str]:
        """Return what is wrong, in plain words: of each name that it may have."""
        names = [site.effect for site in self.alike] or [e.name for e in self.effects]
        kinds = [REGISTRY[name].traits for name in dict.fromkeys(names)]
        kinds = [traits for traits in kinds if traits.meaning]
        if len(kinds) < 2:
            return [f'{capital(each.meaning)}.' for each in kinds]
        return [f'{each.title}: {each.meaning}.' for each in kinds]

    @property
    def _should_it_be(self) -> str:
        """Return which of those that fit alike has its values and remedies listed."""
        return f'hould it be {cause(self.effects[0].name, self.effects[0].site)}:'

    # How sure it is.

    @cached_property
    def belief(self) -> float | None:
        """
        Return how sure it is: its name, one of its names that fit alike, or its place.

        A part of the verdict is never reported as less sure than the whole.
        """
        if all(site.effect in CURVES for site, _ in self.cause.name):
            place = self.cause.place
            return sum(p for _, p in leading(place)) if place else None
        own = self.cause.probability
        if self.diagnosis.families:
            return own
        whole = self.diagnosis.confidence if self.diagnosis.status in NAMING else 0.0
        return max(own, whole)

    @cached_property
    def sure(self) -> list[str]:
        """Return how sure it is, a sentence each; the first has the figure."""
        if self.belief is None:
            return []
        sure, named = odds(self.belief), [s for s, _ in self.cause.name if s.effect not in CURVES]
        if not named:
            return [f'{sure} that it sits at {likely(self.cause.place)}.', *self._on]
        if self.alike:
            return [f'{sure} that it is one of these; which of them is open.']
        if self.diagnosis.families and len(named) > 1:
            return [f'{sure} that these are there.']
        return [f'{sure} that it is {cause_name(self.diagnosis, self.cause)}.']

    @property
    def _on(self) -> list[str]:
        if not self.cause.dependence:
            return ['What it depends on was not found.']
        dependences = leading(self.cause.dependence)
        on = depending(*(name for name, _ in dependences))
        return [f'{odds(sum(p for _, p in dependences))} that it {on}; what it is, is open.']

    @cached_property
    def levels(self) -> str:
        """Return what is believed of place, dependence and name, each by itself."""
        at = str(self.cause.place[0][0]) if self.cause.place else ''
        levels = {
            'Place': [(place_name(a), p) for a, p in self.cause.place],
            'Depends on': [(DEPENDENCES.get(on, on), p) for on, p in self.cause.dependence],
            # The place stands there already; other joints stand with their names.
            'Name': [
                (cause(s.effect, None) if s.joint == at else site_name(s), p)
                for s, p in self.cause.name
                if s.effect not in CURVES
            ],
        }
        each = '. '.join(
            f'{head}: {", ".join(f"{name} {odds(p)}" for name, p in items[:_LISTED])}'
            for head, items in levels.items()
            if items
        )
        return f'{each}. Learned for each level by itself.' if each else ''

    @cached_property
    def row(self) -> list[str]:
        """Return share, place, dependence and name, each with its odds, as `LEVEL_HEADS` has it."""
        value, ends = with_ends(self.cause.share, *self.cause.share_ci90)
        levels = (
            [(place_name(at), p) for at, p in self.cause.place],
            [(DEPENDENCES.get(on, on), p) for on, p in self.cause.dependence],
            [(site_name(site), p) for site, p in self.cause.name if site.effect not in CURVES],
        )
        cells = [', '.join(f'{n} ({odds(p)})' for n, p in items[:_LISTED]) for items in levels]
        cells[-1] = 'none that was tried' if unnamed(self.cause) else cells[-1]
        return [f'{value} ({ends})', *cells]

    # How large it is, and what is left without it.

    @cached_property
    def off_by(self) -> list[str]:
        """Return by how much it is off, the most telling first; of those that fit alike, of one."""
        amounts = values(self.diagnosis, self.cause, self.effects)
        return [f's{self._should_it_be}', *amounts] if self.alike and amounts else amounts

    def off_in_short(self, most: int) -> list[str]:
        """Return the most telling of them, without radians, which the card has."""
        return [_RADIANS.sub('', text) for text in self.off_by[: most + bool(self.alike)]]

    @cached_property
    def moved(self) -> list[np.ndarray]:
        """Return how it moves the tool at every stamp, (M, 3) [m], for each recording where known."""
        contributions = self.diagnosis.contributions
        if contributions is None or self.diagnosis.contacts is not None:
            return []
        return [parts[self.k] for parts in contributions.parts]

    @cached_property
    def own_square(self) -> float:
        """Return how far it moves the tool by itself, as a part of the squared gap."""
        runs = range(len(self.moved))
        good = [trusted(self.diagnosis, run) for run in runs]
        own = sum(float((self.moved[run][good[run]] ** 2).sum()) for run in runs)
        whole = sum(float((as_it_is(self.diagnosis, r)[good[r]] ** 2).sum()) for r in runs)
        return own / max(whole, 1e-300)

    @cached_property
    def most(self) -> tuple[int, np.ndarray, np.ndarray] | None:
        """Return the recording where it moves the tool most, its samples and how far [m]."""
        best: tuple[int, np.ndarray, np.ndarray] | None = None
        for run, part in enumerate(self.moved if self.cause.members else []):
            size = np.linalg.norm(part, axis=1)
            good = np.flatnonzero(trusted(self.diagnosis, run))
            if good.size and (best is None or size[good].max() > best[2].max()):
                best = run, good, size[good]
        return best

    @cached_property
    def moves(self) -> tuple[str, str] | None:
        """Return how far it moves the tool and to which side, and how much of it goes which way."""
        if self.most is None:
            return None
        run, good, size = self.most
        peak = int(np.argmax(size))
        worst = int(good[peak])
        text = (
            f'moves the tool by {millimetres(float(np.sqrt((size**2).mean())))} RMS, at most '
            f'{seen_at(self.diagnosis, run, worst, float(size[peak]))}'
        )
        parts = components(self.diagnosis, run, self.moved[run])
        if parts is None:
            return f'{text}.', ''
        sides = sides_words(parts[worst])
        return f'{text} ({sides}).' if sides else f'{text}.', f' RMS {rms_words(parts[good])}.'

    @cached_property
    def remaining(self) -> mending.Remaining | None:
        """Return what is left with it alone mended; None where it cannot be thought away."""
        return mending.remaining_without(self.diagnosis, self.k)

    @cached_property
    def mended(self) -> tuple[str, str] | None:
        """Return what mending it alone does to the gap, and what mended means without a name."""
        if self.remaining is None:
            return None
        rms, rms_after, largest, largest_after = map(millimetres, self.remaining)
        change = (
            f'RMS {"falls" if self.remaining.rms_after < self.remaining.rms else "rises"} from '
            f'{rms} to {rms_after}, the largest '
            f'{"grows" if self.remaining.grows else "goes"} from {largest} to {largest_after}'
        )
        if not unnamed(self.cause):
            return change, ''
        short = mending.taken_by_curve(self.diagnosis, self.k) is not None
        return change, f' {_BY_CURVE}{_SHORT * short}'

    # What to do about it.

    @property
    def stands_on(self) -> str | None:
        """Return what was noted of the joints, where it is a matter of command and arm."""
        names = {effect.name for effect in self.effects} | {s.effect for s, _ in self.cause.name}
        if not names & _LATE:
            return None
        checks = self.diagnosis.checks
        return (
            ' '.join(c.sentence for c in checks if c.name == _SOURCE and c.level != 'ok') or None
        )

    @cached_property
    def to_do(self) -> list[str]:
        """Return what to do about it, a sentence or two each."""
        effects, model = self.effects[:_ACTIONS], self.diagnosis.model
        if self.diagnosis.families and len(effects) > 1:
            return [TOGETHER]
        if unnamed(self.cause):
            steps = mending.look_at(self.diagnosis, self.k)
        elif not effects:
            return ['Measure as said under "What to measure next".']
        else:
            twins = same_words(self.diagnosis, *(Site(e.name, e.site) for e in effects))
            warned = mending.warning(self.diagnosis, self.k)
            ways = filter(None, [*dict.fromkeys(map(gearing, effects)), warned])
            steps = [*dict.fromkeys(actions(effects, model.robot, model.turned)), *twins, *ways]
        if effects and self.alike:
            first = f'Which of them it is must be measured first. S{self._should_it_be}'
            return [first, *steps]
        return steps

    @property
    def _correction(self) -> str:
        robot = self.diagnosis.model.robot
        return UNNAMED if unnamed(self.cause) else correction(self.effects[0], self.brand, robot)

    @property
    def at_the_controller(self) -> tuple[str, str]:
        """Return whose controller it is, and where that takes a correction."""
        head = f'At the {BRANDS[self.brand]} controller' if self.brand else 'At the controller'
        if not self.effects:
            return head, 'Nothing can be entered before the cause is known.'
        fault = mending.curve_fault(self.diagnosis, self.k)
        if fault:
            return head, f'Nothing is to be entered: the curve {fault}.'
        others = mending.against(self.diagnosis) if unnamed(self.cause) else ''
        entry = self._correction
        if others:
            # A correction is made without the curves that are advised against.
            model = 'Its model is a copy of diagnosis.json'
            entry += f' {model} without the entries of {others} under found.'
        if self.alike:
            entry = f'Nothing before it is known which it is. S{self._should_it_be} {entry}'
        return head, entry

    @property
    def where_to_enter(self) -> str:
        """Return where the controller takes it, without the way through its menus."""
        if mending.curve_fault(self.diagnosis, self.k) or not self.effects:
            return 'nothing yet'
        if self.alike:
            return 'nothing before it is known which it is'
        return _SENTENCE.split(self._correction.removesuffix(UNCHECKED).rstrip())[0]
