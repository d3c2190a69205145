# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A diagnosis in plain sentences."""

import re
from collections.abc import Callable, Iterable, Sequence

from weld_twin_core.diagnosis.evidence import LIKELIER
from weld_twin_core.diagnosis.hypotheses.library import EXCLUDED
from weld_twin_core.diagnosis.result import Cause, Diagnosis, Found, Site
from weld_twin_core.effects import REGISTRY

_PARAMETERS = {
    'da': 'length off by',
    'dd': 'offset off by',
    'dalpha': 'twist off by',
    'dbeta': 'tilt off by',
    'width': 'play',
    'xyz': 'moved by',
    'rotvec': 'turned by',
    'offset': 'off by',
    'com': 'centre of gravity at',
    'xyz_rate': 'creeps by',
    'scale': 'scale off by',
}
"""Parameters as a fitter says them; the others are words already."""
STATUS = {
    'identified': 'Identified',
    'ambiguous': 'Ambiguous',
    'unknown': 'Unknown cause',
    'none': 'No gap',
    'unsound': 'Unsound data',
}
PARTLY = 'Partly identified'
"""Where causes are reported, and it is likelier than not that one more acts or one of them does not."""
REGIMES = {
    'static': 'constant or by angle',
    'reversal': 'at reversals',
    'speed': 'with speed',
    'acceleration': 'with acceleration',
    'load': 'with load',
    'temperature': 'with temperature',
    'time': 'with time',
}
PLACES = {
    'base': 'the base',
    'tool': 'the tool',
    'instrument': 'the instrument',
    'clock': 'the clocks',
    'load': 'the load',
}
DEPENDENCES = {
    'constant': 'nothing: it is constant',
    'angle': 'the angle',
    'direction': 'the direction of motion',
    'speed': 'the speed',
    'acceleration': 'the acceleration',
    'load': 'the load',
    'temperature': 'the temperature',
    'time': 'the time',
    'place': 'the place in the workspace',
}
CURVES = ('joint_curve', 'frame_curve')
"""What stands where nothing has a name."""
_NAME = re.compile(r'\b[a-z]+(?:_[a-z]+)+\b')
"""Names as files have them, of effects among others, which a sentence may bring along."""
HALF = 0.5
"""Probability from which one name is enough."""
_OPEN = 3
"""Alternatives named together."""
_NAMED = 3
"""Names in a sentence; more are counted."""


def cause(effect: str, joint: str | None) -> str:
    """Return an effect at its place as people say it."""
    return f'{called(effect)} of {joint}' if joint else called(effect)


def called(effect: str) -> str:
    """Return an effect as people call it."""
    kind = REGISTRY.get(effect)
    return (kind.traits.title if kind else '') or effect.replace('_', ' ')


def effect_name(result: Found) -> str:
    """Return a found effect as people say it."""
    return cause(result.effect.name, result.effect.site)


def site_name(site: Site) -> str:
    """Return a site as people say it."""
    return cause(site.effect, site.joint)


def in_words(reason: str, sites: Iterable[Site]) -> str:
    """Return a sentence about sites with their names as people say them."""
    for site in sorted(sites, key=lambda s: -len(str(s))):
        reason = reason.replace(str(site), site_name(site))
    reason = _NAME.sub(lambda m: called(m[0]) if m[0] in REGISTRY else m[0], reason)
    return f'{capital(reason).rstrip(".")}.'


def unnamed(cause: Cause) -> bool:
    """Tell whether no effect of the library is named for a cause."""
    return all(site.effect in CURVES for site, _ in cause.name)


def place_name(at: str) -> str:
    """Return a place as people say it."""
    return PLACES.get(at, at)


def parameter_word(name: str) -> str:
    """Return a parameter as a fitter says it."""
    return _PARAMETERS.get(name, name.replace('_', ' '))


def capital(text: str) -> str:
    return f'{text[:1].upper()}{text[1:]}'


def listed(names: Sequence[str], word: str = 'and') -> str:
    """Return 'a, b and c'."""
    if len(names) < 2:
        return ''.join(names)
    return f'{", ".join(names[:-1])} {word} {names[-1]}'


def likely(
    alternatives: Sequence[tuple[str, float]], word: Callable[[str], str] = place_name
) -> str:
    """Return the most probable; two or three where the first alone is not likely enough."""
    return listed(list(dict.fromkeys(word(at) for at, _ in leading(alternatives))), 'or')


def leading(alternatives: Sequence[tuple[str, float]]) -> list[tuple[str, float]]:
    """Return the most probable, as many as are together likelier than not."""
    likeliest: list[tuple[str, float]] = []
    for item in alternatives[:_OPEN]:
        if sum(p for _, p in likeliest) > HALF:
            break
        likeliest.append(item)
    return likeliest


def cause_words(cause: Cause) -> str:
    """Return place and dependence as a part of a sentence."""
    where, on = _place_and_dependence(cause)
    if on == ['constant']:
        return f'{where}, and is constant there'
    return f'{where}, depending on {_dependences(on)}' if on else where


def someplace(cause: Cause) -> str:
    """Return a cause without a name as a heading: where it sits and what it depends on."""
    where, on = _place_and_dependence(cause)
    if on == ['constant']:
        return f'something constant at {where}'
    return f'something at {where}' + (f' that depends on {_dependences(on)}' if on else '')


def _place_and_dependence(cause: Cause) -> tuple[str, list[str]]:
    where = likely(cause.place) or 'a place not found'
    return where, [name for name, p in cause.dependence if p > HALF][:2]


def _dependences(on: Sequence[str], word: str = 'and') -> str:
    return listed([DEPENDENCES.get(name, name) for name in on], word)


def passed(fine: int, of: int) -> str:
    """Return how many checks of the data found everything in order."""
    if of == 1:
        return 'the one check passed' if fine else 'the one check did not pass'
    return f'all {of} checks passed' if fine == of else f'{fine} of {of} checks passed'


def open_sets(diagnosis: Diagnosis) -> list[tuple[Site, ...]]:
    """
    Return the sets of which these data do not tell which it is.

    The set of the largest cause first, in each the most probable first, wherever named.
    """
    share = share_by_site(diagnosis)
    odds_of = {site: p for each in diagnosis.causes for site, p in each.name}
    beside = {site for _, *others in diagnosis.same for site in others}
    asked = [[s for s in group if s not in beside] for group in diagnosis.indistinguishable]
    groups = [
        tuple(sorted(group, key=lambda site: -odds_of.get(site, 0.0)))
        for group in asked
        if len(group) > 1
    ]
    return sorted(groups, key=lambda group: -max(share.get(site, 0.0) for site in group))


def status_word(diagnosis: Diagnosis) -> str:
    """
    Return the status as people read it.

    What only no motion can decide is no open question. Causes that stand by themselves, of which
    the whole is rather wrong than right, are a part of what there is.
    """
    closed = diagnosis.status == 'ambiguous' and diagnosis.same and not open_sets(diagnosis)
    status = 'identified' if closed else diagnosis.status
    doubtful = diagnosis.confidence is not None and diagnosis.confidence < LIKELIER
    return PARTLY if status == 'identified' and doubtful else STATUS[status]


def same_words(diagnosis: Diagnosis, *sites: Site) -> list[str]:
    """
    Return which errors are one on any motion, as sentences: of those at some sites, or of all.

    The first of each is what a person can set; no measurement decides, and none is advised.
    """
    out = []
    for first, *others in diagnosis.same:
        if not sites or {first, *others} & set(sites):
            names = listed([site_name(site) for site in others])
            out.append(
                f'On any motion {names} would be the same error as {site_name(first)}: no '
                'measurement tells them apart, and mending the one mends the other.'
            )
    return out


def named_causes(diagnosis: Diagnosis) -> list[Cause]:
    return [one for one in diagnosis.causes if one.name and not one.rest]


def kinds_doubted(diagnosis: Diagnosis) -> bool:
    """Return whether each kind of many small errors is likelier wrong than right by itself."""
    told = [one.probability > LIKELIER for one in named_causes(diagnosis)]
    return bool(diagnosis.families) and not any(told)


def open_sites(diagnosis: Diagnosis) -> set[Site]:
    """Return the sites that stand in a set with others."""
    return {site for group in open_sets(diagnosis) for site in group}


def site_of(result: Found) -> Site:
    return Site(result.effect.name, result.effect.site)


def cause_by_site(diagnosis: Diagnosis) -> dict[Site, int]:
    """Return which cause each effect in the twin belongs to."""
    result = diagnosis.model.found
    return {
        Site(result[m].name, result[m].site): k
        for k, each in enumerate(diagnosis.causes)
        for m in each.members
        if m < len(result)
    }


def share_by_site(diagnosis: Diagnosis) -> dict[Site, float]:
    """Return the share of the squared gap of the cause that each effect in the twin belongs to."""
    return {site: diagnosis.causes[k].share for site, k in cause_by_site(diagnosis).items()}


def depending(*on: str) -> str:
    """Return what something without a name does, by what it may depend on."""
    others = [name for name in on if name != 'constant']
    words = ['is constant'] if 'constant' in on else []
    words += [f'depends on {_dependences(others, "or")}'] if others else []
    return ' or '.join(words)


def carries_curves(diagnosis: Diagnosis) -> bool:
    """Return whether the twin carries curves in place of effects with a name."""
    # Beside many small errors a curve is one of them, and stands for no cause.
    alone = not diagnosis.families
    return alone and any(e.name in CURVES for e in diagnosis.model.found)


def untried_in_short(diagnosis: Diagnosis) -> str:
    """Return that some effects were not tried; of many only the first, as the first step has all."""
    names = not_to_be_tried(diagnosis)
    listed_names = (
        names if len(names) <= _NAMED else [*names[: _NAMED - 1], f'{len(names) - 2} more']
    )
    return f'{listed(listed_names)} {"was" if len(names) == 1 else "were"} not tried'


def not_to_be_tried(diagnosis: Diagnosis) -> list[str]:
    """Return the effects, in words, that were asked to be left out."""
    return [called(n) for n, why in diagnosis.absent.items() if why == EXCLUDED]


def mended(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Return what was wrong with the data and undone before anything was looked for."""
    return tuple(item.sentence for item in diagnosis.unsound if item.applied)
