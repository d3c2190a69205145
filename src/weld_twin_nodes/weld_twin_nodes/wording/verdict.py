# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The verdict in two sentences: the cause, and what knowing it brings."""

from collections import Counter
from collections.abc import Mapping, Sequence

from weld_twin_core.diagnosis.result import Diagnosis, Found, Site
from weld_twin_core.diagnosis.verdict.decision import NO_GAP, UNEVEN

from .mending import advised, remaining_with, switches
from .quantities import STAYS, both_angles, millimetres, odds, percent, turns_only
from .words import (
    HALF,
    called,
    carries_curves,
    cause,
    cause_words,
    effect_name,
    in_words,
    kinds_doubted,
    likely,
    listed,
    named_causes,
    not_to_be_tried,
    open_sets,
    open_sites,
    share_by_site,
    site_name,
    site_of,
    someplace,
    untried_in_short,
)


def in_order(diagnosis: Diagnosis) -> list[int]:
    """
    Return the causes, counted from 0, those first that take most off the squared gap.

    Shares of places without a name say what their own motion tells, which a second place may tell
    as well; what a curve takes off is what a reader can have.
    """
    contributions = diagnosis.contributions
    count = len(diagnosis.causes)
    if contributions is None:
        return list(range(count))
    taken = [0.0] * count
    for run, (remaining, parts) in enumerate(
        zip(contributions.left, contributions.parts, strict=True)
    ):
        good = diagnosis.traces.trusted[run] if diagnosis.traces.trusted else slice(None)
        whole = (remaining + parts.sum(axis=0))[good]
        for k in range(count):
            part = parts[k][good]
            taken[k] += float((part * (2.0 * whole - part)).sum())
    return sorted(range(count), key=lambda k: -taken[k])


_NAMED = 3
"""Names in a sentence; more are counted."""


def verdict(diagnosis: Diagnosis) -> tuple[str, str]:
    """Return the verdict in two sentences: the cause, and what knowing it brings."""
    return {
        'identified': _identified,
        'ambiguous': _ambiguous,
        'unknown': _unknown,
        'none': _none,
        'unsound': _unsound,
    }[diagnosis.status](diagnosis)


def _identified(diagnosis: Diagnosis) -> tuple[str, str]:
    size = _size(diagnosis)
    names = [effect_name(result) for result in diagnosis.effects]
    sure = odds(diagnosis.confidence)
    if diagnosis.families:
        kinds = [
            f'{cause(f.effect, None)} ({millimetres(f.rms_m)})'
            for f in diagnosis.families
            if f.named
        ]
        if diagnosis.confidence < HALF:
            first = f'The {size} is explained best by many small errors together, mostly '
            first += f'{listed(kinds[:_NAMED])}; each is as sure as its card says.'
        else:
            first = f'The {size} comes from many small errors together ({sure} sure), mostly '
            first += f'{listed(kinds[:_NAMED])}.'
        return first, _gain(diagnosis)
    if len(names) <= _NAMED:
        if diagnosis.confidence < HALF:
            # One figure for all of it would hide that some of it may be sure.
            first = f'The {size} is explained best by {listed(names)}'
            return f'{first}; each is as sure as its card says.', _gain(diagnosis)
        return f'The {size} comes from {listed(names)} ({sure} sure).', _gain(diagnosis)
    words = f'({sure} sure)' if diagnosis.confidence >= HALF else '(each as sure as its card says)'
    share = share_by_site(diagnosis)
    largest = max(diagnosis.effects, key=lambda each: share.get(site_of(each), 0.0))
    first = (
        f'The {size} comes from {len(names)} errors together, mostly '
        f'{_families(diagnosis, share)}; the largest is {effect_name(largest)} {words}.'
    )
    return first, _gain(diagnosis)


def _families(diagnosis: Diagnosis, share: Mapping[Site, float]) -> str:
    """Return the two kinds that do most of the gap, with how many there are of each."""
    each = [(result.effect.name, share.get(site_of(result), 0.0)) for result in diagnosis.effects]
    counts = Counter(name for name, _ in each)
    most = sorted(counts, key=lambda kind: -sum(part for name, part in each if name == kind))
    return listed([f'{called(kind)} ({counts[kind]})' for kind in most[:2]])


def _ambiguous(diagnosis: Diagnosis) -> tuple[str, str]:
    size = _size(diagnosis)
    if kinds_doubted(diagnosis):
        first = (
            f'The {size} is explained best by many small errors together; these data do not tell'
        )
        kinds = named_causes(diagnosis)
        likeliest = max(kinds, key=lambda one: one.probability, default=None)
        if likeliest is None:
            return f'{first} which.', _gain(diagnosis)
        names = listed([*dict.fromkeys(called(site.effect) for site, _ in likeliest.name)], 'or')
        odds_of = percent(likeliest.probability)
        return f'{first} which, likeliest {names} ({odds_of}).', _gain(diagnosis)
    choices = '; and from '.join(_either(group) for group in open_sets(diagnosis)[:2])
    unsure = open_sites(diagnosis)
    sure = [result for result in diagnosis.effects if site_of(result) not in unsure]
    settled = listed([f'{effect_name(result)}{_twins(diagnosis, result)}' for result in sure])
    if not choices:
        return f'The {size} comes from {settled}.', _gain(diagnosis)
    after = _gain(diagnosis, 'Either way')
    if not sure:
        return f'The {size} comes from {choices}: these data do not tell which.', after
    # The largest first, as the cards have it; what has no card of its own stays in front.
    share = share_by_site(diagnosis)
    largest = max(share.get(site_of(result), 1.0) for result in sure)
    if largest < max((share.get(site, 0.0) for site in unsure), default=0.0):
        first = f'from {choices} (these data do not tell which), in part from {settled}.'
    else:
        first = f'from {settled}, in part from {choices}: these data do not tell which.'
    return f'The {size} comes in part {first}', after


def _twins(diagnosis: Diagnosis, result: Found) -> str:
    """Return beside a name what is the same error on any motion, in brackets."""
    own = site_of(result)
    others = [site for same in diagnosis.same if own in same for site in same if site != own]
    if not others:
        return ''
    return f' (on any motion the same as {listed([site_name(site) for site in others])})'


def _either(group: Sequence[Site]) -> str:
    names = [site_name(site) for site in group]
    if len(names) > _NAMED:
        names = [*names[:_NAMED], f'{len(names) - _NAMED} more']
    return listed(names, 'or')


def _unknown(diagnosis: Diagnosis) -> tuple[str, str]:
    if diagnosis.causes and not (diagnosis.effects or diagnosis.families):
        return _placed(diagnosis)
    size, remaining = millimetres(diagnosis.gap.rms_m), millimetres(diagnosis.unexplained.rms_m)
    if diagnosis.effects:
        names = listed([effect_name(result) for result in diagnosis.effects[:_NAMED]])
        first = f'Part of the gap of {size} comes from {names}'
        if diagnosis.reasons and not diagnosis.unexplained.above_noise:
            # The model takes all of it up, but by names that are rather wrong than right.
            first += '; what else is at work has no name.'
            return first, in_words(diagnosis.reasons[0], ())
        first += (
            f', but {remaining} remains that no effect in the library explains; measuring noise alone '
            f'is {millimetres(diagnosis.gap.noise_floor_m)}.'
        )
    else:
        first = f'No effect in the library{_without(diagnosis)} explains the gap of {size}.'
    structure = diagnosis.unexplained.structure
    if not structure:
        if diagnosis.reasons and not diagnosis.unexplained.above_noise:
            return first, in_words(diagnosis.reasons[0], ())
        return first, 'What remains is above the noise, but shows no simple dependence.'
    return first, f'What remains depends on {listed(structure[:_NAMED])}.'


def _placed(diagnosis: Diagnosis) -> tuple[str, str]:
    """Return where an unknown cause sits, and what its curve or what fits best brings."""
    first, *others = (diagnosis.causes[k] for k in in_order(diagnosis))
    words = f'comes mostly from {cause_words(first)};'
    if first.share < HALF and others:
        # What another place holds is more: "mostly" would say the opposite of the bars below.
        words = f'comes in part from {cause_words(first)}, in part from {cause_words(others[0])};'
    why = 'no known effect explains it'
    if diagnosis.confidence < HALF:
        why = 'what causes it is open'
    if not_to_be_tried(diagnosis):
        why = f'what causes it is open: {untried_in_short(diagnosis)}, as asked'
    return (
        f'The gap of {millimetres(diagnosis.gap.rms_m)} {words} {why}.',
        f'{_instead(diagnosis)} on data not used for fitting; {_noise(diagnosis)}.',
    )


def _instead(diagnosis: Diagnosis) -> str:
    """Return what those curves bring that programs may be corrected by, or that nothing does."""
    every, taken = switches(diagnosis), advised(diagnosis)
    if taken and len(taken) < len(every):
        where = [likely(diagnosis.causes[every[at].members[0]].place) for at in taken]
        what = f'the curve{"s" if len(where) > 1 else ""} of {listed(where)} alone'
        remaining = remaining_with(diagnosis, taken)
        before, after = millimetres(remaining.rms), millimetres(remaining.rms_after)
        return f'Programs corrected by {what}, {before} shrinks to {after}'
    shrink = diagnosis.shrink
    before, after = millimetres(shrink.rms_before_m), millimetres(shrink.rms_after_m)
    if shrink.ratio >= STAYS:
        return f'Nothing can be corrected yet: even with what fits best, {before} becomes {after}'
    if not carries_curves(diagnosis):
        return f'Programs corrected by what fits best, nameless, {before} shrinks to {after}'
    if every and not taken:
        return f'No curve is worth correcting programs by; all together leave {after} of {before}'
    return f'Programs corrected by what was measured in its place, {before} shrinks to {after}'


def _noise(diagnosis: Diagnosis) -> str:
    return f'measuring noise alone is {millimetres(diagnosis.gap.noise_floor_m)}'


def _without(diagnosis: Diagnosis) -> str:
    """Return which effects were asked not to be tried: one of them may well explain the gap."""
    names = not_to_be_tried(diagnosis)
    return f' (tried without {listed(names)}, as asked)' if names else ''


def _none(diagnosis: Diagnosis) -> tuple[str, str]:
    reason, *_ = (*diagnosis.reasons, NO_GAP)
    gap, noise = map(millimetres, (diagnosis.gap.rms_m, diagnosis.gap.noise_floor_m))
    first = f'{reason[0].upper()}{reason[1:]}. Measured and model differ by {gap}'
    if reason == UNEVEN:
        return (
            f'{first}, of which no more than {noise} passes for noise.',
            'Whether the rest is the robot or the instrument, these data do not tell.',
        )
    return (
        f'{first}, of which {noise} is noise.',
        'As far as these data reach, the model is the robot.',
    )


def _unsound(diagnosis: Diagnosis) -> tuple[str, str]:
    """Return what is wrong with data or set-up, and that nothing else is said."""
    wrong = ' '.join(item.sentence for item in diagnosis.unsound)
    remedies = list(dict.fromkeys(item.remedy for item in diagnosis.unsound))
    return wrong, f'{"; ".join(remedies)}. No cause is looked for in such data.'


def _size(diagnosis: Diagnosis) -> str:
    """Return what the effects found account for: the gap in position, or in orientation."""
    turn = diagnosis.gap.orientation_rms_rad
    if turn is not None and turns_only(diagnosis):
        return f'orientation gap of {both_angles(turn)}'
    return f'gap of {millimetres(diagnosis.gap.rms_m)}'


def _gain(diagnosis: Diagnosis, start: str = '') -> str:
    shrink = diagnosis.shrink
    what = 'it' if len(diagnosis.effects) == 1 else 'them'
    opening = f'{start}, with {what} mended' if start else f'With {what} mended'
    if shrink.orientation_rad is not None and turns_only(diagnosis):
        before, after = map(both_angles, shrink.orientation_rad)
        return (
            f'{opening}, {before} shrinks to {after} on data not used for fitting; the position '
            f'gap, {millimetres(shrink.rms_after_m)}, stays as it is; {_noise(diagnosis)}.'
        )
    return (
        f'{opening}, {millimetres(shrink.rms_before_m)} shrinks to '
        f'{millimetres(shrink.rms_after_m)} on data not used for fitting; {_noise(diagnosis)}.'
        f'{_beside(diagnosis)}'
    )


def _beside(diagnosis: Diagnosis) -> str:
    """Return what is left without a name beside what was found; nothing where nothing is."""
    rest = next((cause for cause in diagnosis.causes if cause.rest), None)
    if rest is None:
        return ''
    return f' Beside that, {percent(rest.share)} of the squared gap has no name yet: {someplace(rest)}.'
