# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The causes that a reader can think away, what that leaves, and where it makes the seam worse."""

from collections.abc import Collection, Sequence
from itertools import combinations
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.result import Cause, Diagnosis, Site

from .quantities import STAYS, UNCHANGED, millimetres
from .words import (
    CURVES,
    depending,
    leading,
    likely,
    listed,
    not_to_be_tried,
    open_sets,
    site_name,
    someplace,
    unnamed,
    untried_in_short,
)
from .words import cause as called

MOST = 8
"""Causes with a switch of their own; the others share one."""
OTHERS = 'all smaller ones together'
_NAMED = 3
"""Names in a heading; more are counted."""


class Switch(NamedTuple):
    """One switch: its name, and the causes (as the contributions count them) that it mends."""

    label: str
    members: tuple[int, ...]


def cause_name(diagnosis: Diagnosis, cause: Cause) -> str:
    """Return a cause as a heading: every name it may have, or its place where it has none."""
    named = [site for site, _ in cause.name if site.effect not in CURVES]
    if not named:
        return someplace(cause)
    if diagnosis.families and len(named) > 1:
        return _together(named)
    alike = alternatives(diagnosis, cause) or tuple(named[:1])
    more = [f'{len(alike) - _NAMED} more'] if len(alike) > _NAMED else []
    return listed([*map(site_name, alike[:_NAMED]), *more], 'or')


def _together(sites: Sequence[Site]) -> str:
    """Return a kind of small errors with the joints that need it, and what would do as well."""
    kind = sites[0].effect
    own = [str(site.joint) for site in sites if site.effect == kind and site.joint]
    more = [f'{len(own) - _NAMED} more'] if len(own) > _NAMED else []
    name = called(kind, listed([*own[:_NAMED], *more]) if own else None)
    return listed([name, *(site_name(site) for site in sites if site.effect != kind)], 'or')


def alternatives(diagnosis: Diagnosis, cause: Cause) -> tuple[Site, ...]:
    """Return what these data cannot tell apart, the most probable first; nothing where one is."""
    result = [effect for k, effect in enumerate(diagnosis.model.found) if k in cause.members]
    own = {Site(effect.name, effect.site) for effect in result} | {s for s, _ in cause.name[:1]}
    return next((group for group in open_sets(diagnosis) if own & set(group)), ())


def switches(diagnosis: Diagnosis) -> tuple[Switch, ...]:
    """Return the switches, largest share first; none where no cause can be thought away."""
    contributions = diagnosis.contributions
    if contributions is None or not contributions.parts or diagnosis.contacts is not None:
        return ()
    count = contributions.parts[0].shape[0]
    own = [k for k, cause in enumerate(diagnosis.causes) if cause.members]
    out = [Switch(cause_name(diagnosis, diagnosis.causes[k]), (k,)) for k in own[:MOST]]
    rest = tuple(own[MOST:]) + tuple(range(len(diagnosis.causes), count))
    return (*out, *([Switch(OTHERS, rest)] if rest else []))


def parted(diagnosis: Diagnosis) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Return what is left, (M, 3), and what switches add to it, (S, M, 3), by recording."""
    traces, contributions, all_switches = (
        diagnosis.traces,
        diagnosis.contributions,
        switches(diagnosis),
    )
    if contributions is None or not all_switches:
        return traces.after, tuple(np.zeros((0, *part.shape)) for part in traces.after)
    return contributions.left, tuple(
        np.array([part[list(switch.members)].sum(axis=0) for switch in all_switches])
        for part in contributions.parts
    )


def as_it_is(diagnosis: Diagnosis, k: int) -> Array:
    """Return the deviation of a recording before anything is mended, (M, 3) [m]."""
    remaining, parts = (item[k] for item in parted(diagnosis))
    return remaining + parts.sum(axis=0) if parts.size else diagnosis.traces.before[k]


def trusted(diagnosis: Diagnosis, k: int) -> np.ndarray:
    """Return which samples of a recording to draw: a gross outlier would hide all the others."""
    traces = diagnosis.traces
    if traces.trusted:
        return traces.trusted[k]
    return np.ones(traces.t[k].size, dtype=bool)


_GROWS = 1.02
"""Ratio of the largest deviation after to before from which it is reported as grown: less than that is
a matter of which sample has the largest noise."""
_APART = 0.02
"""Share of the squared gap by which a curve may fall short of its place before both are reported."""
_EVERY = 3
"""Switches of which every combination is reported; of more, each alone and all together."""
_LOOK = {
    'constant': 'zeros and frames',
    'angle': 'gear and encoder',
    'direction': 'gear, belt and bearing (play, friction)',
    'speed': 'gains and feed-forward of the drive',
    'acceleration': 'what is loose or soft',
    'load': 'what yields (gear, bearing, mount)',
    'temperature': 'what grows warm',
    'time': 'what creeps, slips or wears',
    'place': 'the line of sight',
}
"""Where a fitter looks first when a cause has no name, by what it depends on."""
_CLOCKS = 'clocks'
"""Name of the check of the clocks: what is late by a clock grows with the speed, as a lag does."""


class Remaining(NamedTuple):
    """RMS and largest deviation [m], as it is and with one cause mended."""

    rms: float
    rms_after: float
    largest: float
    largest_after: float

    @property
    def grows(self) -> bool:
        """Tell whether the worst spot gets worse."""
        return self.largest_after > _GROWS * self.largest

    @property
    def rises(self) -> bool:
        """Tell whether the whole gets worse."""
        return self.rms_after > (1.0 + UNCHANGED) * self.rms


_KEPT: WeakKeyDictionary[Diagnosis, dict[tuple[int, ...], Remaining]] = WeakKeyDictionary()
"""What was asked for, by diagnosis and by the switches thrown."""


def remaining_without(diagnosis: Diagnosis, k: int) -> Remaining | None:
    """Return what is left with cause ``k`` alone mended; None where it cannot be thought away."""
    for at, switch in enumerate(switches(diagnosis)):
        if switch.members == (k,):
            return remaining_with(diagnosis, (at,))
    return None


def remaining_with(diagnosis: Diagnosis, mended: Collection[int]) -> Remaining:
    """Return what is left with some of the `switches` thrown, counted from 0; kept."""
    kept = _KEPT.setdefault(diagnosis, {})
    key = tuple(sorted(mended))
    if key not in kept:
        kept[key] = _worked_out(diagnosis, key)
    return kept[key]


def _worked_out(diagnosis: Diagnosis, mended: tuple[int, ...]) -> Remaining:
    runs: list[tuple[np.ndarray, np.ndarray]] = []
    for run, (remaining, parts) in enumerate(zip(*parted(diagnosis), strict=True)):
        good = trusted(diagnosis, run)
        there = [k for k in range(len(parts)) if k not in mended]
        before, after = as_it_is(diagnosis, run), remaining + parts[there].sum(axis=0)
        runs.append((_sizes(before[good]), _sizes(after[good])))
    sides = zip(*runs, strict=True) if runs else ((), ())
    both = [np.concatenate([np.zeros(0), *side]) for side in sides]
    (rms, largest), (rms_after, largest_after) = (
        (float(np.sqrt((s**2).mean())) if s.size else 0.0, float(s.max(initial=0.0))) for s in both
    )
    return Remaining(rms, rms_after, largest, largest_after)


def _sizes(vectors: np.ndarray) -> np.ndarray:
    return np.asarray(np.linalg.norm(vectors, axis=1))


def switch_sets(diagnosis: Diagnosis) -> list[tuple[int, ...]]:
    """Return which switches are thrown together where the page says what is left: none first."""
    count = len(switches(diagnosis))
    sizes = range(count + 1) if count <= _EVERY else (0, 1, count)
    return [mended for size in sizes for mended in combinations(range(count), size)]


def advised(diagnosis: Diagnosis) -> tuple[int, ...]:
    """Return the `switches` that may be thrown: all but those of curves that are advised against."""
    return tuple(
        at
        for at, switch in enumerate(switches(diagnosis))
        if not any(k < len(diagnosis.causes) and curve_fault(diagnosis, k) for k in switch.members)
    )


def correctable(diagnosis: Diagnosis) -> bool:
    """Tell whether anything was found that may be corrected."""
    return bool(diagnosis.effects or diagnosis.families or advised(diagnosis))


def taken_by_curve(diagnosis: Diagnosis, k: int) -> float | None:
    """Return the share of the squared gap that the curve of a cause without a name takes off."""
    cause = diagnosis.causes[k]
    remaining = remaining_without(diagnosis, k) if unnamed(cause) else None
    if remaining is None:
        return None
    taken = max(1.0 - (remaining.rms_after / max(remaining.rms, 1e-300)) ** 2, 0.0)
    # Beside the interval of its share, what the curve falls short by is no news.
    return taken if taken < cause.share_ci90[0] - _APART else None


def warning(diagnosis: Diagnosis, k: int) -> str:
    """Return that mending a cause makes the worst spot of the seam worse; nothing where not."""
    remaining = remaining_without(diagnosis, k)
    if remaining is None or not (remaining.grows or remaining.rises):
        return ''
    words = (
        f'the largest deviation would grow from {_both(remaining)}'
        if remaining.grows
        else f'the RMS would rise from {millimetres(remaining.rms)} to '
        f'{millimetres(remaining.rms_after)}'
    )
    if unnamed(diagnosis.causes[k]):
        return f'Do not correct programs by its curve: {words}.'
    return f'Not this alone: {words}; mend it together with the others.'


def look_at(diagnosis: Diagnosis, k: int) -> list[str]:
    """Return where to look for a cause without a name, and whether its curve helps so long."""
    cause = diagnosis.causes[k]
    where = likely(cause.place) or 'the whole cell'
    first = f'Look at {where}: {_no_effect(diagnosis)} gives what is found there.'
    if cause.dependence:
        # Where two fit alike, both are named: the first alone would send a fitter to the wrong part.
        on = [name for name, _ in leading(cause.dependence)]
        at = [_LOOK.get(name, 'all that moves') for name in on]
        at += ['the clocks'] * ('speed' in on and not _one_clock(diagnosis))
        first = (
            f'Look at {where}, first at {"; then at ".join(dict.fromkeys(at))}: what is found there '
            f'{depending(*on)}, and {_no_effect(diagnosis)} gives it.'
        )
    remaining = remaining_without(diagnosis, k)
    if remaining is None:
        return [first]
    if remaining.grows or remaining.rises:
        return [first, warning(diagnosis, k)]
    fault = curve_fault(diagnosis, k)
    if fault:
        return [first, f'Its curve {fault}: do not correct programs by it.']
    others = against(diagnosis)
    without = f', without that of {others}' if others else ''
    falls = f'the largest deviation goes from {_both(remaining)}'
    if remaining.largest_after >= remaining.largest:
        falls = (
            f'the RMS goes from {millimetres(remaining.rms)} to {millimetres(remaining.rms_after)}'
        )
    return [
        first,
        f'Until that is found, programs can be corrected by its curve{without} (weld-twin '
        f'correct): {falls}.',
    ]


def against(diagnosis: Diagnosis) -> str:
    """Return of which places no curve is to be in a correction; nothing where all may."""
    taken = advised(diagnosis)
    return listed(
        [
            likely(diagnosis.causes[switch.members[0]].place)
            for at, switch in enumerate(switches(diagnosis))
            if at not in taken
        ]
    )


def _no_effect(diagnosis: Diagnosis) -> str:
    """Return that no effect gives it, and of how many that can be said."""
    if not not_to_be_tried(diagnosis):
        return 'no known effect'
    return f'no effect that was tried ({untried_in_short(diagnosis)}, as asked)'


def curve_fault(diagnosis: Diagnosis, k: int) -> str:
    """Return why programs are not to be corrected by the curve of a cause; nothing where they can."""
    remaining = remaining_without(diagnosis, k)
    if remaining is None or not unnamed(diagnosis.causes[k]):
        return ''
    if remaining.grows:
        return 'makes the worst spot worse'
    if remaining.rises:
        return 'makes the whole worse'
    return 'takes hardly anything off' if remaining.rms_after > STAYS * remaining.rms else ''


def _one_clock(diagnosis: Diagnosis) -> bool:
    """Tell whether the clocks were looked at and nothing was found."""
    levels = [check.level for check in diagnosis.checks if check.name == _CLOCKS]
    return bool(levels) and set(levels) == {'ok'}


def _both(remaining: Remaining) -> str:
    return f'{millimetres(remaining.largest)} to {millimetres(remaining.largest_after)}'
