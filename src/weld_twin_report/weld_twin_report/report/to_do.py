# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What to do, in its order, and what could not be tried: on the page and on the terminal."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from weld_twin_core.diagnosis.advice import actions
from weld_twin_core.diagnosis.algebra.motions import REASON
from weld_twin_core.diagnosis.hypotheses.library import EXCLUDED
from weld_twin_core.diagnosis.result import Candidate, Diagnosis, Site
from weld_twin_core.effects import REGISTRY
from weld_twin_core.effects.registry import ELSE, way
from weld_twin_core.metrics.conformity import PASS, Rule
from weld_twin_nodes.wording.mending import look_at, remaining_without, warning
from weld_twin_nodes.wording.quantities import millimetres
from weld_twin_nodes.wording.verdict import in_order
from weld_twin_nodes.wording.words import (
    capital,
    cause,
    cause_by_site,
    effect_name,
    kinds_doubted,
    listed,
    not_to_be_tried,
    open_sets,
    open_sites,
    same_words,
    share_by_site,
    site_name,
    site_of,
    unnamed,
    untried_in_short,
)

from .controllers import gearing
from .html import Child, tag

_LARGEST = 3
"""Actions listed; the others are counted."""
TOGETHER = (
    'Take them in together, by corrected programs (weld-twin correct), or by the corrected '
    'robot.yaml or robot.urdf, whose head says what it leaves by itself: one by one they are not '
    'certain, their sum is.'
)
_NONE_ALONE = (
    'Enter none of them by itself in the controller: each is likelier wrong than right, and what '
    'stands in for another error mends nothing elsewhere.'
)


def worth_doing(diagnosis: Diagnosis, rule: Rule | None = None) -> list[str]:
    """
    Return what to do first: mend what is certain and large, tell apart what is open; or look.

    What is certain and smaller comes first only if the tolerance of ``rule`` is met by it alone.
    """
    again = _again(diagnosis) if diagnosis.status == 'unknown' else []
    # The first step names them all.
    short = f' ({untried_in_short(diagnosis)}, as asked)' if again else ''
    steps = _with_these(diagnosis, rule)
    return [*again, *(step.replace(short, '') if short else step for step in steps)]


def _with_these(diagnosis: Diagnosis, rule: Rule | None) -> list[str]:
    """Return what to do with what was found."""
    if diagnosis.status == 'unknown' and not diagnosis.actions:
        return _looking(diagnosis)
    if kinds_doubted(diagnosis):
        return [TOGETHER, _NONE_ALONE]
    if diagnosis.families and len(diagnosis.actions) > _LARGEST:
        more = len(diagnosis.actions) - _LARGEST
        smaller = f'{more} smaller ones are in diagnosis.json.'
        return [TOGETHER, *diagnosis.actions[:_LARGEST], smaller]
    if len(diagnosis.actions) != len(diagnosis.effects) or diagnosis.families:
        return list(diagnosis.actions)
    if diagnosis.status != 'ambiguous':
        return _mending(diagnosis)
    share = share_by_site(diagnosis)
    sites = [site_of(result) for result in diagnosis.effects]
    order = sorted(range(len(sites)), key=lambda k: -share.get(sites[k], 0.0))
    mending = _mending(diagnosis)
    first = _settled(diagnosis, rule)
    others = [mending[k] for k in order if sites[k] not in first]
    now = [f'{mending[k]} {first[sites[k]]}'.rstrip() for k in order if sites[k] in first]
    return [*now, *_telling(diagnosis), *others]


def _settled(diagnosis: Diagnosis, rule: Rule | None) -> dict[Site, str]:
    """
    Return which effects are certain and worth mending before it is known what the others are.

    They are larger than all that is open, or enough by themselves: then with what they leave.
    """
    share, unsure = share_by_site(diagnosis), open_sites(diagnosis)
    most = max((share.get(site, 0.0) for site in unsure), default=0.0)
    causes = cause_by_site(diagnosis)
    out = {}
    for site in map(site_of, diagnosis.effects):
        if site in unsure:
            continue
        remaining = remaining_without(diagnosis, causes[site]) if site in causes else None
        if share.get(site, 0.0) > most:
            out[site] = ''
        elif (
            remaining is not None
            and rule is not None
            and rule.judged(remaining.largest_after) == PASS
        ):
            out[site] = f'That alone leaves {millimetres(remaining.largest_after)} at most.'
    return out


def _telling(diagnosis: Diagnosis) -> list[str]:
    """Return what tells the open ones apart."""
    out = []
    for group in open_sets(diagnosis):
        words = f'Find out whether it is {listed([site_name(site) for site in group], "or")}'
        by = way(sorted({site.effect for site in group}))
        if by != ELSE:
            out.append(f'{words}: {by}.')
        elif diagnosis.contacts is not None or made_for(diagnosis.next_experiment, group):
            out.append(
                f'{words}: measure what {_proposed(diagnosis)} proposes{_takes(diagnosis)}.'
            )
        else:
            out.append(
                f'{words}: record other postures and motions than these, and diagnose all together.'
            )
    return out


def made_for(wanted: Mapping[str, Any] | None, group: Sequence[Site]) -> bool:
    """Tell whether a proposed measurement is to part two of a set that cannot be told apart."""
    sides = (wanted or {}).get('between') or ()
    asked = {(site['effect'], site['joint']) for side in sides for site in side}
    return sum((site.effect, site.joint) in asked for site in group) > 1


def _mending(diagnosis: Diagnosis) -> list[str]:
    """Return what mends each effect, and whether it must be this one, or alone makes anything worse."""
    unsure = open_sites(diagnosis)
    causes = cause_by_site(diagnosis)
    out = []
    for named, action in zip(diagnosis.effects, diagnosis.actions, strict=True):
        if site_of(named) in unsure:
            action = f'Should it be {effect_name(named)}: {action[:1].lower()}{action[1:]}'
        twins = ' '.join(same_words(diagnosis, site_of(named)))
        action = ' '.join(filter(None, [action, gearing(named.effect), twins]))
        worse = warning(diagnosis, causes[site_of(named)]) if site_of(named) in causes else ''
        out.append(f'{action} {worse}'.rstrip())
    return out


def _looking(diagnosis: Diagnosis) -> list[str]:
    """Return where to look, and what to measure, while no cause has a name."""
    words = [_at(diagnosis, k) for k in in_order(diagnosis)[:_LARGEST]]
    words = [text for text in words if text]
    if diagnosis.next_experiment is not None:
        words.append(
            f'Measure what {_proposed(diagnosis)} proposes{_takes(diagnosis)}, and diagnose all '
            'together.'
        )
    return words


def _again(diagnosis: Diagnosis) -> list[str]:
    """Return to diagnose with what was left out; nothing where all was tried."""
    names = not_to_be_tried(diagnosis)
    if not names:
        return []
    one = len(names) == 1
    return [
        f'Diagnose again with {listed(names)}: {"it was" if one else "they were"} left out as asked '
        '(option --exclude-effect of weld-twin diagnose), and '
        f'{"it" if one else "one of them"} may be the cause.'
    ]


def _at(diagnosis: Diagnosis, k: int) -> str:
    """Return where to look for a cause, or what mends it where it has a name of its own."""
    cause = diagnosis.causes[k]
    if unnamed(cause):
        return ' '.join(look_at(diagnosis, k))
    all_effects = diagnosis.model.found
    effects = [all_effects[m] for m in cause.members if m < len(all_effects)]
    model = diagnosis.model
    return ' '.join(actions(effects, model.robot, model.turned))


def minutes(wanted: Mapping[str, Any] | None) -> str:
    """Return how long a proposed measurement takes; nothing where that is not known."""
    cost = (wanted or {}).get('cost')
    return f'about {max(cost, 1.0):.0f} min' if cost else ''


def _takes(diagnosis: Diagnosis) -> str:
    words = minutes(diagnosis.next_experiment)
    return f' ({words})' if words else ''


def _proposed(diagnosis: Diagnosis) -> str:
    touches = (diagnosis.next_experiment or {}).get('kind') == 'touches'
    return 'next_touches.csv' if touches else 'next_experiment.yaml'


_DEGREES = re.compile(r'(?<=\d) deg\b')
_NOT = re.compile(
    r'((?:Do not correct programs|Not this alone)\b[^.]*(?:\.\d[^.]*)*\.'
    r'|Its curve [^.]*: do not correct programs by it\.)'
)
"""What a reader is told not to do."""


def warned(text: str) -> list[Child]:
    """Return an action as markup: what not to do stands out, and degrees have their sign."""
    parts = _NOT.split(_DEGREES.sub('°', text))
    return [tag('strong', text) if k % 2 else text for k, text in enumerate(parts) if text]


_KINDS = 4
"""Kinds of effects listed; more are counted."""


def reason_and_joints(why: str, diagnosis: Diagnosis) -> tuple[str, list[str]]:
    """Return why an effect is absent, and the joints that the reason ends with."""
    reason, _, last = why.rpartition(' (')
    joints = last.rstrip(')').split(', ')
    if set(joints) <= set(diagnosis.model.robot.joint_names):
        return reason, joints
    return why, []


def untried(diagnosis: Diagnosis) -> str:
    """Return what could not be tried, and what would have to move for it; nothing where all was."""
    still: dict[str, list[str]] = {}
    for effect, why in sorted(diagnosis.absent.items()):
        reason, joints = reason_and_joints(why, diagnosis)
        # Of a coupling it is the joint beside that hardly moves; other effects name that one.
        beside = 'source' in getattr(REGISTRY.get(effect), 'options', ())
        for joint in joints if reason == REASON and not beside else ():
            still.setdefault(joint, []).append(cause(effect, None))
    asked = listed(not_to_be_tried(diagnosis))
    words = []
    if still:
        joints = [name for name in diagnosis.model.robot.joint_names if name in still]
        kinds = list(dict.fromkeys(kind for joint in joints for kind in still[joint]))
        more = [f'{len(kinds) - _KINDS} more'] if len(kinds) > _KINDS else []
        what = listed([*kinds[:_KINDS], *more])
        one = len(joints) == 1
        words.append(
            f'{listed(joints)} hardly {"moves" if one else "move"}, so {what} could not be tried '
            f'there: only a recording in which {"it moves" if one else "they move"} can.'
        )
    if asked:
        verb = 'was' if len(not_to_be_tried(diagnosis)) == 1 else 'were'
        words.append(f'{capital(asked)} {verb} not tried, as asked.')
    return ' '.join(words)


def weighed(diagnosis: Diagnosis) -> tuple[Candidate, ...]:
    """Return the candidates without those of effects that were asked to be left out."""
    absent = diagnosis.absent
    return tuple(c for c in diagnosis.candidates if absent.get(c.site.effect) != EXCLUDED)
