# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which effect: what was found, what else was considered, what cannot be told apart."""

from __future__ import annotations

from collections.abc import Sequence

from weld_twin_core.diagnosis.result import Candidate, Diagnosis
from weld_twin_core.effects import REGISTRY
from weld_twin_nodes.wording.quantities import MISSING, change, millimetres, parameter_rows
from weld_twin_nodes.wording.words import (
    carries_curves,
    cause,
    found_name,
    in_words,
    listed,
    open_sets,
    parameter_word,
    same_words,
    site_name,
)

from .family_table import families_table
from .html import Child, Html, bars, joined, section, table, tag
from .untried import reason_and_joints, untried, weighed

_CANDIDATES = 6
"""Hypotheses shown for a cause."""
_SLOTS = 6
"""Places of which rivals are listed."""
_INSTEAD = (
    'No effect is named. These come nearest; figures and pictures are with the curves on the cards '
    'above.'
)
_STAND_IN = (
    'No effect is named. These imitate the unknown cause together; figures and pictures that say '
    'after are with them.'
)
_GROUP = 'A group for every cause: what was found, and what else it could be. '
_RIVALS = (
    'They are weighed against each other only, as if one of them had to be it; how sure it is '
    'stands on the card.'
)
_BARS = 'All bars have one scale: what would be left of the gap; a full bar is all of it.'
_ALIKE = 1.5
"""Ratio of probabilities below which two candidates are told as alike."""
_HARDLY = 1000.0
"""Ratio of probabilities that is told at most."""
_ABOVE = 1.5
"""Ratio to the noise floor above which what remains is not at its level."""
_NONE = (
    'Nothing: in these recordings no other effect looks like one of those named. How sure each is '
    'stands on its card.',
    'Nothing of what could be tried. How sure each is stands on its card.',
)
"""What is said where nothing looks alike: where all effects were tried, and where some could not be."""
_STILL = 'hardly moves'
_ENOUGH = (
    'Each effect needs a motion of its own kind to show, so joints that move enough for one can '
    'stand here for another.'
)


def causes_section(diagnosis: Diagnosis) -> Html:
    """Return parameters, candidates and equivalence sets."""
    return section(
        'Which effect',
        _found(diagnosis),
        _candidates(diagnosis),
        _sets(diagnosis),
        _absent(diagnosis),
        id_='causes',
    )


def _found(diagnosis: Diagnosis) -> Html | None:
    if not diagnosis.effects:
        return None if diagnosis.model.found else tag('p', 'No effect was found.')
    if diagnosis.families:
        return families_table(diagnosis)
    heads = ['Effect', 'Parameter', 'Value ± standard error']
    rows: list[list[Child]] = []
    for found in diagnosis.effects:
        for k, (name, value) in enumerate(
            parameter_rows(found.effect, found.std, diagnosis.model.robot)
        ):
            rows.append([found_name(found) if k == 0 else '', parameter_word(name), value])
    return joined([tag('h3', 'Effects found'), table(heads, rows, 'effects')])


def _candidates(diagnosis: Diagnosis) -> Html | None:
    """Return the hypotheses for every cause, the most probable first."""
    candidates = weighed(diagnosis)
    if not candidates:
        return None
    groups = slots(candidates)
    parts: list[Html] = []
    for slot in groups[:_SLOTS]:
        best = slot[0].probability
        rows = [_candidate(diagnosis, c, best) for c in slot[:_CANDIDATES]]
        parts.append(bars(rows, 'wide'))
    more = len(candidates) - sum(len(s[:_CANDIDATES]) for s in groups[:_SLOTS])
    note = tag('p', f'{more} more in diagnosis.json.', class_='note') if more > 0 else None
    if not diagnosis.effects:
        title = 'What fits best, though no cause is named'
        lead = _INSTEAD if carries_curves(diagnosis) else _STAND_IN
    else:
        title = 'Candidates against each other'
        lead = f'{_GROUP if len(groups) > 1 else ""}{_RIVALS}'
    told = tag('p', f'{lead} {_BARS}', class_='note')
    return joined([tag('h3', title), told, *parts, note])


def _candidate(diagnosis: Diagnosis, c: Candidate, best: float) -> tuple[str, float, str]:
    """Return label, length and text of a bar; what only stands in is not compared."""
    left = f'leaves {millimetres(c.rms_after_m)} ({change(c.shrink)})'
    told = f'{rivalry(c, best)} · {left}' if diagnosis.effects else left
    return site_name(c.site), 1.0 - c.shrink, told


def rivalry(candidate: Candidate, best: float) -> str:
    """Return how likely a candidate is against the likeliest: how sure that is stands elsewhere."""
    times = best / max(candidate.probability, 1e-12)
    if times == 1.0:
        return 'the likeliest'
    if times < _ALIKE:
        return 'as likely'
    if times > _HARDLY:
        return f'more than {_HARDLY:.0f} times less likely'
    return f'{times:.2g} times less likely' if times < 10.0 else f'{times:.0f} times less likely'


def slots(candidates: Sequence[Candidate]) -> list[list[Candidate]]:
    """Return the hypotheses cause by cause: within one, probabilities do not rise."""
    out: list[list[Candidate]] = []
    for c in candidates:
        if out and c.probability <= out[-1][-1].probability:
            out[-1].append(c)
        else:
            out.append([c])
    return out


def _sets(diagnosis: Diagnosis) -> Html | None:
    if not diagnosis.effects:
        return None
    sets = open_sets(diagnosis)
    title = tag('h3', 'What these data cannot tell apart')
    if not sets and diagnosis.families:
        shared = [tag('li', in_words(reason, ())) for reason in diagnosis.reasons]
        return joined([title, tag('ul', *shared, class_='sentences')])
    if not sets and diagnosis.same:
        told = [tag('li', text) for text in same_words(diagnosis)]
        return joined([title, tag('ul', *told, class_='sentences')])
    if not sets:
        return joined(
            [
                title,
                tag('p', f'{_NONE[bool(untried(diagnosis))]} {untried(diagnosis)}'.rstrip()),
            ]
        )
    items = [
        tag(
            'li',
            f'{listed([site_name(site) for site in group], "or")}: '
            'naming one of them would be a guess.',
        )
        for group in sets
    ]
    every = {site for group in sets for site in group}
    reasons = [tag('li', in_words(reason, every)) for reason in diagnosis.reasons]
    return joined(
        [
            title,
            tag('ul', *items, class_='sentences'),
            tag('p', 'Why:') if reasons else None,
            tag('ul', *reasons, class_='sentences'),
        ]
    )


def _absent(diagnosis: Diagnosis) -> Html | None:
    if not diagnosis.absent:
        return None
    rows = [_left_out(*item, diagnosis) for item in sorted(diagnosis.absent.items())]
    return tag(
        'details',
        tag('summary', f'Not considered, and why ({len(rows)})'),
        table(('Effect', 'Why'), rows),
        tag('p', _ENOUGH, class_='note') if any(_STILL in why for _, why in rows) else None,
    )


def _left_out(effect: str, why: str, diagnosis: Diagnosis) -> tuple[str, str]:
    """Return an effect by its name in words, with the joints that the reason ends with."""
    reason, joints = reason_and_joints(why, diagnosis)
    if joints:
        if 'source' in getattr(REGISTRY.get(effect), 'options', ()):
            reason = reason.replace('the joint hardly', 'the joint beside it hardly')
        return cause(effect, listed(joints)), reason
    return cause(effect, None), why


def leftover(diagnosis: Diagnosis) -> Html:
    """Return what remains after the verdict."""
    rest = diagnosis.unexplained
    floor = diagnosis.gap.noise_floor_m
    if not rest.above_noise and rest.rms_m > _ABOVE * floor:
        return tag(
            'p',
            f'What remains, {millimetres(rest.rms_m)}, depends on nothing that was '
            f'looked at, but the instrument is better than that: {millimetres(floor)}.',
        )
    if carries_curves(diagnosis) and rest.rms_m <= _ABOVE * floor:
        return joined(
            [
                tag('p', 'What no known effect explains, and the curves carry, depends on:'),
                _dependent(rest.structure),
                tag('p', f'With the curves, {millimetres(rest.rms_m)} remain.'),
            ]
        )
    if not rest.above_noise:
        text = f'What remains, {millimetres(rest.rms_m)}, is at the level of the noise.'
        return tag('p', text)
    text = (
        f'{_with(diagnosis)}{millimetres(rest.rms_m)} remain at a noise floor of {millimetres(floor)}, '
        'which is more than noise. It depends on:'
    )
    return joined([tag('p', text), _dependent(rest.structure)])


def _with(diagnosis: Diagnosis) -> str:
    """Return what was taken off, where it has no name."""
    if diagnosis.effects or diagnosis.families or not diagnosis.model.found:
        return ''
    return 'With the curves, ' if carries_curves(diagnosis) else 'With what fits best, '


def _dependent(structure: Sequence[str]) -> Html:
    items = [tag('li', line) for line in structure] or [tag('li', MISSING)]
    return tag('ul', *items, class_='sentences')
