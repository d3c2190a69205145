# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What more than one place of page, terminal and print says of a diagnosis."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timezone
from functools import cached_property
from typing import NamedTuple

import numpy as np

from weld_twin_core.diagnosis.result import NAMING, Candidate, Diagnosis, Family
from weld_twin_core.effects.transmission_ripple import TransmissionRipple
from weld_twin_core.metrics.conformity import Rule
from weld_twin_core.recording import Recording
from weld_twin_nodes.offline.exports import elsewhere, undetermined, which_file
from weld_twin_nodes.wording import words
from weld_twin_nodes.wording.mending import correctable
from weld_twin_nodes.wording.quantities import (
    change,
    ends_to,
    millimetres,
    odds,
    parameter_rows,
    percent,
    turned,
)
from weld_twin_nodes.wording.verdict import verdict

from .cause_answer import CauseAnswer
from .page_data import places, remainder
from .to_do import weighed, worth_doing

_LARGEST = 3
"""Joints of a kind that are listed, those first that need it most."""
_LINES = 3
"""Orders of ripple listed for each joint."""


def family_rows(families: tuple[Family, ...]) -> list[list[str]]:
    """Return kind, what it accounts for, how much worse it is without, joints, what is like it."""
    rows = []
    for family in families:
        joints = [site.joint for site, _ in family.needed if site.joint] if family.named else []
        like = [words.site_name(site) for site, _ in family.like] if family.named else []
        name = words.cause(family.effect, None) + ('' if family.named else ' (exchangeable)')
        cells = [millimetres(family.rms_m), f'{100.0 * family.growth:+.0f} %']
        rows.append([name, *cells, ', '.join(joints[:_LARGEST]), ', '.join(like)])
    return rows


def ripple_rows(diagnosis: Diagnosis) -> list[list[str]]:
    """Return joint, RMS of its ripple, strongest lines, in chain order."""
    rows = []
    for effect in diagnosis.model.known + diagnosis.model.found:
        if isinstance(effect, TransmissionRipple):
            size = np.abs(np.atleast_1d(np.asarray(effect.amplitude)))
            order = np.broadcast_to(np.atleast_1d(np.asarray(effect.order)), size.shape)
            rms = float(np.sqrt((size**2).sum() / 2.0))
            lines = [
                f'{order[k]:g} ({turned(size[k])}, {1e6 * size[k]:.0f} µrad)'
                for k in np.argsort(-size)[:_LINES]
            ]
            if rms > 0.0:
                text = f'{turned(rms)} ({1e6 * rms:.0f} µrad)'
                rows.append([effect.joint, text, ', '.join(lines)])
    return rows


FAMILY_HEADS = ('Kind', 'Accounts for', 'Error without it', 'Needed at', 'Would do as well')
RIPPLE_HEADS = ('Joint', 'Ripple, RMS', 'Strongest orders per turn')


_WIDER = 2.0
"""Ratio of the error elsewhere in the reach to that where it was measured from which it is a warning."""
_ALIKE = 1.5
"""Ratio of probabilities below which two candidates are reported as alike."""
_HARDLY = 1000.0
"""Ratio of probabilities that is reported at most."""
_LISTED = 4
"""Causes whose figures are reported beside that of the whole."""
_DIFFERS = 0.005
"""Probability by which a part is surer than the whole, so that both read differently."""


class Table(NamedTuple):
    """A table as the page has it; the terminal writes its heads small."""

    title: str
    heads: Sequence[str]
    rows: list[list[str]]


class Alternative(NamedTuple):
    """A hypothesis: how likely it is against the likeliest, and what it leaves of the gap."""

    name: str
    likely: str
    left: str
    change: str
    length: float  # what it leaves, as a part of the gap


class Holds(NamedTuple):
    """Where what is said holds, which file holds it, what the data left open; and whether to warn."""

    elsewhere: str
    file: str
    open: list[str]
    wide: bool


@dataclass(frozen=True, eq=False)
class Answer:
    """What is said of a diagnosis."""

    diagnosis: Diagnosis
    rule: Rule | None = None  # how the largest deviation is judged
    brand: str | None = None  # whose controller it is, as `controllers.BRANDS` has it

    @property
    def sound(self) -> bool:
        """Tell whether data and set-up are sound; nothing is said of causes else."""
        return self.diagnosis.status != 'unsound'

    @property
    def subject(self) -> str:
        """Return what was diagnosed."""
        recordings = self.diagnosis.recordings
        names = ', '.join(recording.name for recording in recordings)
        parts = [self.diagnosis.model.robot.name, names, recorded_at(recordings)]
        return ' · '.join(part for part in parts if part)

    @property
    def status(self) -> str:
        return words.status_word(self.diagnosis)

    @cached_property
    def verdict(self) -> tuple[str, str]:
        """Return the cause, and what knowing it brings."""
        return verdict(self.diagnosis)

    @property
    def mended(self) -> tuple[str, ...]:
        """Return what was wrong with the data and undone; all that follows stands on it."""
        return words.mended(self.diagnosis)

    @cached_property
    def to_do(self) -> list[str]:
        return worth_doing(self.diagnosis, self.rule)

    @cached_property
    def causes(self) -> tuple[CauseAnswer, ...]:
        count = len(self.diagnosis.causes)
        return tuple(CauseAnswer(self.diagnosis, k, self.brand) for k in range(count))

    @cached_property
    def holds(self) -> Holds | None:
        """Return where what is said holds, how wide it is beyond, and what the data left open."""
        posterior = self.diagnosis.posterior
        if posterior is None:
            return None
        return Holds(
            elsewhere(posterior, correctable(self.diagnosis)),
            which_file(self.diagnosis.model.alone),
            rest := undetermined(posterior),
            bool(rest) or posterior.anywhere_m > _WIDER * posterior.recorded_m,
        )

    @property
    def together(self) -> str:
        """Return why the verdict as a whole is less sure than its causes; nothing where it is not."""
        whole = self.diagnosis
        if whole.status not in NAMING or whole.families:
            return ''
        sure = [c.belief for c in self.causes if c.cause.name and c.belief is not None]
        if not sure or max(sure) < whole.confidence + _DIFFERS:
            return ''
        each = ', '.join(odds(p) for p in sure[:_LISTED])
        if len(sure) == 1:
            return f'. The cause alone, others or none beside it: {each}'
        return f'. All at once is less likely than each alone: {each}'

    # Shares of the squared gap: everywhere as finely as the finest of them needs.

    @cached_property
    def _places(self) -> int:
        return places(self.diagnosis)

    def percent(self, share: float) -> str:
        """Return a share in the words that all shares of this answer have."""
        return percent(share, self._places)

    def share_of(self, item: CauseAnswer) -> tuple[str, str]:
        """Return the share of a cause and the ends of its interval."""
        return ends_to(self._places, item.cause.share, *item.cause.share_ci90)

    @cached_property
    def remainder(self) -> tuple[tuple[str, float], ...]:
        """Return what the causes do not hold."""
        return remainder(self.diagnosis)

    # What was found, and what else was weighed.

    @cached_property
    def found(self) -> list[Table]:
        """Return the effects with their parameters, or the kinds of many small errors."""
        whole = self.diagnosis
        if whole.families:
            # What was fitted along and takes nothing off unseen data was not found.
            families = tuple(family for family in whole.families if family.rms_m > 0.0)
            kinds = Table('Errors found, by kind', FAMILY_HEADS, family_rows(families))
            ripples = any(family.effect == TransmissionRipple.name for family in families)
            lines = ripple_rows(whole) if ripples else []
            ripple = Table('Transmission ripple by joint', RIPPLE_HEADS, lines)
            return [each for each in (kinds, ripple) if each.rows]
        rows = []
        for result in whole.effects:
            values = parameter_rows(result.effect, result.std, whole.model.robot)
            names = [words.effect_name(result), *[''] * len(values)]
            rows += [[name, *row] for name, row in zip(names, values, strict=False)]
        heads = ('Effect', 'Parameter', 'Value ± standard error')
        return [Table('Effects found', heads, rows)] if rows else []

    @cached_property
    def alternatives(self) -> list[list[Alternative]]:
        """Return the hypotheses cause by cause: within one, probabilities do not rise."""
        groups: list[list[Candidate]] = []
        for c in weighed(self.diagnosis):
            if groups and c.probability <= groups[-1][-1].probability:
                groups[-1].append(c)
            else:
                groups.append([c])
        return [[_alternative(c, group[0].probability) for c in group] for group in groups]

    @cached_property
    def open(self) -> list[str]:
        """Return what these data cannot tell apart: the names of each set."""
        sets = words.open_sets(self.diagnosis)
        return [words.listed([words.site_name(site) for site in group], 'or') for group in sets]

    @cached_property
    def changed(self) -> Table | None:
        """Return what changed between the recordings, and by how much; None where it was not asked."""
        whole = self.diagnosis
        if not whole.may_change or len(whole.recordings) < 2:
            return None
        names = [recording.name for recording in whole.recordings]
        rows = [
            [names[item.recording], words.cause(item.effect.name, item.effect.site), *row]
            for item in whole.changed
            for row in parameter_rows(item.effect, item.std, whole.model.robot)
        ]
        title = f'changed since {whole.recordings[0].name}, whose arm the model is'
        return Table(title, ('Recording', 'Changed', 'Parameter', 'By'), rows)

    @property
    def nothing_changed(self) -> str:
        """Return that nothing was seen to change, of what."""
        names = words.listed([words.called(name) for name in self.diagnosis.may_change], 'or')
        return f'No {names} was seen to change between the recordings.'


def recorded_at(recordings: Sequence[Recording]) -> str:
    """Return when the first of the recordings was made; nothing where the stamps do not tell."""
    stamps = [r.epoch_ns for r in recordings if r.dated]
    if not stamps:
        return ''
    when = datetime.fromtimestamp(min(stamps) * 1e-9, tz=timezone.utc)
    return f'recorded {when:%Y-%m-%d %H:%M} UTC'


def _alternative(candidate: Candidate, best: float) -> Alternative:
    return Alternative(
        words.site_name(candidate.site),
        _against(candidate.probability, best),
        millimetres(candidate.rms_after_m),
        change(candidate.shrink),
        1.0 - candidate.shrink,
    )


def _against(probability: float, best: float) -> str:
    """Return how likely a candidate is against the likeliest: how sure that is stands elsewhere."""
    times = best / max(probability, 1e-12)
    if times == 1.0:
        return 'the likeliest'
    if times < _ALIKE:
        return 'as likely'
    if times > _HARDLY:
        return f'more than {_HARDLY:.0f} times less likely'
    return f'{times:.2g} times less likely' if times < 10.0 else f'{times:.0f} times less likely'
