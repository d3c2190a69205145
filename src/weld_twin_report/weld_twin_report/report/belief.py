# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How sure it is: one figure for a cause, and why the whole is less sure than its parts."""

from __future__ import annotations

from weld_twin_core.diagnosis.result import NAMING, Cause, Diagnosis
from weld_twin_nodes.wording.quantities import odds
from weld_twin_nodes.wording.switches import alternatives, cause_name
from weld_twin_nodes.wording.words import (
    CURVES,
    DEPENDENCES,
    cause,
    depending,
    leading,
    likely,
    place_name,
    site_name,
)

from .html import Html, tag

_LISTED = 3
"""Places, dependences or names told of a level."""
_TOLD = 4
"""Causes whose figures are told beside that of the whole."""
_DIFFERS = 0.005
"""Probability by which a part is surer than the whole, so that both read differently."""


def belief_of(diagnosis: Diagnosis, cause: Cause) -> float | None:
    """
    Return how sure one cause is: its name, one of its names that fit alike, or its place.

    Who believes the whole verdict believes each part of it: a part is never told as less sure.
    None where nothing is believed of it.
    """
    named = {site: p for site, p in cause.name if site.effect not in CURVES}
    if not named:
        return sum(p for _, p in leading(cause.place)) if cause.place else None
    if diagnosis.families:
        return cause.probability
    alike = alternatives(diagnosis, cause)
    own = sum(named.get(site, 0.0) for site in alike) if alike else max(named.values())
    whole = diagnosis.confidence if diagnosis.status in NAMING else 0.0
    return min(max(own, whole), 1.0)


def belief_lines(diagnosis: Diagnosis, cause: Cause) -> list[str]:
    """Return what is told of how sure a cause is, a sentence each; the first has the figure."""
    sure = belief_of(diagnosis, cause)
    if sure is None:
        return []
    named = [site for site, _ in cause.name if site.effect not in CURVES]
    if not named:
        return [f'{odds(sure)} that it sits at {likely(cause.place)}.', *_on(cause)]
    if alternatives(diagnosis, cause):
        return [f'{odds(sure)} that it is one of these; which of them is open.']
    if diagnosis.families and len(named) > 1:
        return [f'{odds(sure)} that these are there.']
    return [f'{odds(sure)} that it is {cause_name(diagnosis, cause)}.']


def _on(cause: Cause) -> list[str]:
    if not cause.dependence:
        return ['What it depends on was not found.']
    told = leading(cause.dependence)
    on = depending(*(name for name, _ in told))
    return [f'{odds(sum(p for _, p in told))} that it {on}; what it is, is open.']


def sure_entry(diagnosis: Diagnosis, cause: Cause) -> Html | None:
    """Return how sure a cause is, and for engineers what each level of it is believed to be."""
    lines = belief_lines(diagnosis, cause)
    if not lines:
        return None
    levels = _levels(cause)
    return tag(
        'span',
        *(tag('span', line) for line in lines),
        tag('details', tag('summary', 'place, dependence and name'), levels, class_='detail')
        if levels
        else None,
        class_='lines',
    )


def _levels(told: Cause) -> str:
    """Return what is believed of place, dependence and name, each by itself."""
    at = str(told.place[0][0]) if told.place else ''
    # The place stands there already; other joints stand with their names.
    names = [
        (cause(s.effect, None) if s.joint == at else site_name(s), p)
        for s, p in told.name
        if s.effect not in CURVES
    ]
    parts = [
        _list('Place', [(place_name(a), p) for a, p in told.place]),
        _list('Depends on', [(DEPENDENCES.get(on, on), p) for on, p in told.dependence]),
        _list('Name', names),
    ]
    each = '. '.join(part for part in parts if part)
    return f'{each}. Learned for each level by itself.' if each else ''


def _list(head: str, told: list[tuple[str, float]]) -> str:
    if not told:
        return ''
    return f'{head}: {", ".join(f"{name} {odds(p)}" for name, p in told[:_LISTED])}'


def together(diagnosis: Diagnosis) -> str:
    """Return why the verdict as a whole is less sure than its causes; nothing where it is not."""
    if diagnosis.status not in NAMING or diagnosis.families:
        return ''
    each = [belief_of(diagnosis, cause) for cause in diagnosis.causes if cause.name]
    sure = [p for p in each if p is not None]
    if not sure or max(sure) < diagnosis.confidence + _DIFFERS:
        return ''
    told = ', '.join(odds(p) for p in sure[:_TOLD])
    if len(sure) == 1:
        return f'. The cause alone, others or none beside it: {told}'
    return f'. All at once is less likely than each alone: {told}'
