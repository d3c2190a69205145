# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What each level of an answer was worth: examples to learn belief from.

An answer is right as the blind check judges it; besides, each member of a set too wide for a name
must predict the sealed recording as the cause at work does, unless the kinematics make them one error.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from weld_twin_core.diagnosis.calibration.features import WIDEST
from weld_twin_core.diagnosis.result import NAMING
from weld_twin_core.effects.registry import REGISTRY

from ..blind.scoring import NOT_IN_LIBRARY, Judged, answers_of, judge
from .truth import FEW, HALF, LARGE, alike_by_structure, levels_of, numbers, whole
from .truth import right as right_everywhere

AS_WELL = 0.05
"""Share of the noise by which a member of a set may leave more than the cause at work does."""
AS_GOOD = 1.05
"""RMS left over what the true causes leave, up to which an answer predicts as the truth does."""


class Example(NamedTuple):
    """One statement, the features it was made on, and whether it was right."""

    case: str
    """Name of the case; statements on one case are kept together."""
    kind: str
    """As `weld_twin_core.diagnosis.calibration.features.KINDS` has it."""
    features: Mapping[str, float]
    right: bool
    reported: float
    """The probability reported for it."""
    sure: bool = False
    """Whether it was reported as sure."""
    weight: float = 1.0
    """How much it counts."""


def kept(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a row of `trial.tried` was worth, and every statement of it as an example."""
    if row['error'] or not row['statements']:
        return {key: row.get(key) for key in ('name', 'error', 'unsound')}
    truth, verdict = row['truth'], row['verdict']
    known = {**truth, 'causes': (), 'alike': [*truth['alike'], *_absorbed(row)]}
    judgement = judge(known, {'verdict': {'effects': (), **verdict}})
    right = _right(row, judgement)
    sealed, causes = row['sealed'], verdict['causes']
    as_good = sealed['after'] < AS_GOOD * sealed['floor'] and judgement.status in NAMING
    words = levels_of(truth)
    return {
        'name': row['name'],
        'error': None,
        'engine': row['engine'],
        'kind': judgement.kind,
        'robot': judgement.robot,
        'motion': f'{judgement.motion} {row["poor"]}'.strip(),
        'truth': judgement.truth,
        'said': judgement.said,
        'sizes': list(truth['ratios']),
        'status': judgement.status,
        'confidence': verdict['confidence'],
        'sure': bool(verdict['sure']),
        'right': right,
        'honest': right or (as_good and bool(truth['sites'])),
        'named': judgement.named,
        'place': _first(causes, 'place', frozenset().union(*(own.places for own in words))),
        'dependence': _first(
            causes, 'dependence', frozenset().union(*(own.dependences for own in words))
        ),
        'family': _family(row),
        'family_shared': _family(row, shared=True),
        'seconds': row['seconds'],
        'examples': [list(one) for one in _examples(row, right)],
    }


def _right(row: Mapping[str, Any], judgement: Judged) -> bool:
    """
    Return whether an answer is right as a whole, sets held to what they predict.

    Of two or three causes those that do not show may be missing, as of four to six.
    """
    if 'there' in row:
        return right_everywhere(row)
    right = judgement.right
    if 'shown' in row['truth'] and not (right and judgement.kind in FEW):
        right = whole(row['truth'], row['verdict']).right
    return right and sets_hold(row)


def _first(causes: Sequence[Mapping[str, Any]], level: str, words: frozenset[str]) -> bool:
    """Return whether the first place, or dependence, of the largest cause is right."""
    word = 'at' if level == 'place' else 'on'
    located = [cause for cause in causes if cause[level]]
    first = max(located, key=lambda cause: float(cause['share']), default=None)
    return first is not None and first[level][0][word] in words


def _family(row: Mapping[str, Any], *, shared: bool = False) -> float:
    """Return the most that a cause believes of the first family at work; shared, not of a whole set."""
    if not row['truth']['sites']:
        return 0.0
    (family, _), *_ = row['truth']['sites']
    beliefs = [0.0]
    for cause in row['verdict']['causes']:
        members = [n['probability'] for n in cause['name'] if n['effect'] == family]
        if members:
            beliefs.append(sum(members) if shared else cause['probability'])
    return max(beliefs)


def _at_work(truth: Mapping[str, Any]) -> set[tuple[str, str | None]]:
    """Return every site that may rightly be named."""
    if 'at_work' in truth:
        return {(str(effect), joint) for effect, joint in truth['at_work']}
    return {site for answer in answers_of(truth) for site in answer}


def _absorbed(row: Mapping[str, Any]) -> list[list[tuple[str, str | None]]]:
    """Return the causes at work without those that another of them contains on any motion."""
    sites = answers_of(row['truth'])[0]
    kept = [
        site
        for site in sites
        if not any(
            other != site
            and site in alike_by_structure(row['truth']['robot'], other)
            and numbers(other) > numbers(site)
            for other in sites
        )
    ]
    return [kept] if len(kept) < len(sites) else []


def sets_hold(row: Mapping[str, Any]) -> bool:
    """Return whether each member of a set too wide for a name predicts as well as the right one."""
    at_work = _at_work(row['truth'])
    floor = row['sealed']['floor']
    for group in row['sealed'].get('members', ()):
        remaining = {(item['effect'], item['joint']): item['left'] for item in group}
        right = [site for site in remaining if site in at_work]
        if len(remaining) <= WIDEST or not right:
            continue
        same = set().union(*(alike_by_structure(row['truth']['robot'], site) for site in right))
        most = min(remaining[site] for site in right) + AS_WELL * floor
        if any(value > most for site, value in remaining.items() if site not in same):
            return False
    return True


def examples_of(rows: Sequence[Mapping[str, Any]]) -> list[Example]:
    """Return every statement made on some cases, as `kept` gives them."""
    return [
        Example._make((str(row['name']), *one, float(row.get('weight', 1.0))))
        for row in rows
        for one in row.get('examples', ())
    ]


def _examples(
    row: Mapping[str, Any], whole_right: bool
) -> Iterator[tuple[str, Mapping[str, float], bool, float, bool]]:
    """Yield kind, features, whether it was right, the probability reported and whether as sure."""
    causes, at_work = row['verdict']['causes'], _at_work(row['truth'])
    if 'there' in row:
        yield from _of_many(row, whole_right)
        return
    truths = levels_of(row['truth'])
    named_right = whole_right and row['verdict']['status'] in NAMING
    nameless = row['truth']['kind'] in NOT_IN_LIBRARY and not named_right
    for said in row['statements']:
        kind, reported = said['kind'], said['probability']
        if said['cause'] is None:
            right = {'complete': complete(row), 'nameless': nameless}.get(kind, whole_right)
            sure = kind.startswith('answer') and bool(row['verdict']['sure'])
            yield kind, said['features'], right, reported, sure
            continue
        cause, level = causes[said['cause']], kind.split()[0]
        named = any((n['effect'], n['joint']) in at_work for n in cause['name'])
        if level == 'name':
            right = named
        elif not cause[level] or (named and kind in ('place', 'dependence')):
            # Those of a right name are right; what is learned of them holds where it is wrong.
            continue
        else:
            first = cause[level][0]['at' if level == 'place' else 'on']
            right = any(first in own[level == 'dependence'] for own in truths)
        sure = bool(cause['sure']) and (level == 'name' or kind == 'place of the rest')
        yield kind, said['features'], right, reported, sure


def _of_many(
    row: Mapping[str, Any], whole_right: bool
) -> Iterator[tuple[str, Mapping[str, float], bool, float, bool]]:
    """
    Yield the same of an arm that is off everywhere, of names and of kinds of many small errors.

    Every name is at work there: one is right if half of what it is said to do is there.
    """
    verdict, truth = row['verdict'], row['truth']
    there = [own for own in row['there'] if own is not None]
    foreign = bool(truth['excluded']) or any(e not in REGISTRY for e, _ in truth['sites'])
    for said in row['statements']:
        kind, level = said['kind'], said['kind'].split()[0]
        right, sure = whole_right, bool(verdict['sure'])
        if kind == 'nameless':
            right, sure = foreign and not any(own['name'] >= HALF for own in there), False
        elif kind != 'name' and not kind.endswith('many'):
            continue
        elif said['cause'] is not None:
            cause, part = verdict['causes'][said['cause']], row['there'][said['cause']]
            if part is None or not cause[level]:
                continue
            # Place and dependence of a right name are right.
            right = max(part['name'], part[level]) >= HALF
            sure = bool(cause['sure']) and level == 'name'
        yield kind, said['features'], right, said['probability'], sure


def complete(row: Mapping[str, Any]) -> bool:
    """
    Return whether no cause above the noise and a tenth of the squared gap is missing.

    row: as `trial.tried` gives it. What the plant calls otherwise than the library, such as lags that
    are equal in all joints, is there under the library's name.
    """
    truth, named = row['truth'], set[tuple[str, str | None]]()
    for cause in row['verdict']['causes']:
        if not cause['rest']:
            named |= {(n['effect'], n['joint']) for n in cause['name']}
    if any(answer and named.issuperset(answer) for answer in answers_of(truth)):
        return True
    gap = next(one['features']['gap'] for one in row['statements'] if one['kind'] == 'complete')
    least = max(1.0, LARGE * 10.0 ** (2.0 * gap))
    return not any(
        ratio**2 > least and not alike_by_structure(truth['robot'], (e, j)) & named
        for (e, j), ratio in zip(truth['sites'], truth['ratios'], strict=True)
    )
