# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What to do, in its order: at the top of the page and on the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from weld_twin_core.diagnosis.advice import actions
from weld_twin_core.diagnosis.advice.inseparable import ELSE, way
from weld_twin_core.diagnosis.result import Diagnosis, Site

from .leading import in_order
from .mending import look_at, warning
from .words import found_name, listed, open_sets, open_sites, site_name, site_of, unnamed

_LARGEST = 3
"""Actions told; the others are counted."""
TOGETHER = (
    'Take them in together, by the corrected robot.yaml or robot.urdf or by corrected programs '
    '(weld-twin correct-program): one by one they are not certain, their sum is.'
)


def worth_doing(diagnosis: Diagnosis) -> list[str]:
    """Return what to do first: mend what is certain and large, tell apart what is open; or look."""
    if diagnosis.status == 'unknown' and not diagnosis.actions:
        return _looking(diagnosis)
    if diagnosis.families and len(diagnosis.actions) > _LARGEST:
        more = len(diagnosis.actions) - _LARGEST
        smaller = f'{more} smaller ones are in diagnosis.json.'
        return [TOGETHER, *diagnosis.actions[:_LARGEST], smaller]
    if len(diagnosis.actions) != len(diagnosis.effects) or diagnosis.families:
        return list(diagnosis.actions)
    if diagnosis.status != 'ambiguous':
        return _mending(diagnosis)
    settled = _settled(diagnosis)
    mending = _mending(diagnosis)
    first = [mending[k] for k in settled]
    others = [action for k, action in enumerate(mending) if k not in settled]
    return [*first, *_telling(diagnosis), *others]


def _settled(diagnosis: Diagnosis) -> list[int]:
    """Return which effects are certain and larger than all that is open, the largest first."""
    share = {k: cause.share for cause in diagnosis.causes for k in cause.members}
    unsure = open_sites(diagnosis)
    sites = [site_of(found) for found in diagnosis.effects]
    open_ones = [share.get(k, 0.0) for k, site in enumerate(sites) if site in unsure]
    most = max(open_ones, default=0.0)
    sure = [k for k, site in enumerate(sites) if site not in unsure and share.get(k, 0.0) > most]
    return sorted(sure, key=lambda k: -share[k])


def _telling(diagnosis: Diagnosis) -> list[str]:
    """Return what tells the open ones apart."""
    out = []
    for group in open_sets(diagnosis):
        told = f'Find out whether it is {listed([site_name(site) for site in group], "or")}'
        by = way(sorted({site.effect for site in group}))
        if by != ELSE:
            out.append(f'{told}: {by}.')
        elif diagnosis.contacts is not None or made_for(diagnosis.next_experiment, group):
            out.append(f'{told}: measure what {_proposed(diagnosis)} proposes.')
        else:
            out.append(
                f'{told}: record other postures and motions than these, and diagnose all together.'
            )
    return out


def made_for(wanted: Mapping[str, Any] | None, group: Sequence[Site]) -> bool:
    """Tell whether a proposed measurement is to part two of a set that cannot be told apart."""
    sides = (wanted or {}).get('between') or ()
    asked = {(site['effect'], site['joint']) for side in sides for site in side}
    return sum((site.effect, site.joint) in asked for site in group) > 1


def _mending(diagnosis: Diagnosis) -> list[str]:
    """
    Return what mends each effect; of those that stand in an open set, under a condition.

    Where mending one alone makes the worst spot worse, that is said beside it.
    """
    unsure = open_sites(diagnosis)
    found = [Site(effect.name, effect.site) for effect in diagnosis.model.found]
    held = {found[m]: k for k, c in enumerate(diagnosis.causes) for m in c.members
            if m < len(found)}  # fmt: skip
    out = []
    for named, action in zip(diagnosis.effects, diagnosis.actions, strict=True):
        if site_of(named) in unsure:
            action = f'Should it be {found_name(named)}: {action[:1].lower()}{action[1:]}'
        worse = warning(diagnosis, held[site_of(named)]) if site_of(named) in held else ''
        out.append(f'{action} {worse}'.rstrip())
    return out


def _looking(diagnosis: Diagnosis) -> list[str]:
    """Return where to look, and what to measure, while no cause has a name."""
    told = [_at(diagnosis, k) for k in in_order(diagnosis)[:_LARGEST]]
    told = [text for text in told if text]
    if diagnosis.next_experiment is not None:
        told.append(f'Measure what {_proposed(diagnosis)} proposes, and diagnose all together.')
    return told


def _at(diagnosis: Diagnosis, k: int) -> str:
    """Return where to look for a cause, or what mends it where it has a name of its own."""
    cause = diagnosis.causes[k]
    if unnamed(cause):
        return ' '.join(look_at(diagnosis, k))
    found = diagnosis.model.found
    held = [found[m] for m in cause.members if m < len(found)]
    return ' '.join(actions(held, diagnosis.model.robot))


def _proposed(diagnosis: Diagnosis) -> str:
    """Return the file that holds the next experiment."""
    touches = (diagnosis.next_experiment or {}).get('kind') == 'touches'
    return 'next_touches.csv' if touches else 'next_experiment.yaml'
