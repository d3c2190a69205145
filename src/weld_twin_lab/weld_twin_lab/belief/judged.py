# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What each level of an answer was worth: examples to learn belief from.

An answer is right as the blind check judges it; besides, each member of a set must predict the
sealed recording as the cause at work does, unless the kinematics make them one error.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from weld_twin_core.diagnosis.result import NAMING
from weld_twin_core.diagnosis.trust.trusted import group_of, level_group_of

from ..blind.judging import Judged, answers_of, judge
from .levels_of_truth import alike_by_structure, levels_of, numbers
from .whole import whole

AS_WELL = 0.05
"""Share of the noise by which a member of a set may leave more than the cause at work does."""
AS_GOOD = 1.05
"""RMS left over what the true causes leave, up to which an answer predicts as the truth does."""
CURVES = ('joint_curve', 'frame_curve')


class Example(NamedTuple):
    """
    One statement, the signs it was made on, and whether it was right.

    Attributes
    ----------
    case : str
        Name of the case; statements on one case are kept together.
    level : str
        Level and group of status, as in 'place named'.
    signs : mapping from str to float
    right : bool
    told : float
        What was believed of it before anything was learned.

    """

    case: str
    level: str
    signs: Mapping[str, float]
    right: bool
    told: float


class Case(NamedTuple):
    """
    A case with a verdict.

    Attributes
    ----------
    row : mapping
        As `trial.tried` gives it.
    judged : Judged
    right : bool
        Whether the answer as a whole is right, sets of two and more held to what they predict.
    honest : bool
        Whether it is right, or predicts the sealed recording as well as the truth does.

    """

    row: Mapping[str, Any]
    judged: Judged
    right: bool
    honest: bool


def cases_of(rows: Sequence[Mapping[str, Any]]) -> list[Case]:
    """
    Return the rows that came to a verdict on causes, judged.

    Parameters
    ----------
    rows : sequence of mappings

    """
    return [_case(row) for row in rows if not row['error'] and row['signs']]


def judged_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """
    Return a row with what its answer was worth, so that no later library judges it otherwise.

    Parameters
    ----------
    row : mapping
        As `trial.tried` gives it.

    """
    if row['error'] or not row['signs']:
        return dict(row)
    case = _case(row)
    truth = row['truth']
    words = [[sorted(level.places), sorted(level.dependences)] for level in levels_of(truth)]
    at_work = sorted(_at_work(truth), key=str)
    return {
        **row,
        'right': case.right,
        'honest': case.honest,
        'truth': {**truth, 'levels': words, 'at_work': at_work},
    }


def _at_work(truth: Mapping[str, Any]) -> set[tuple[str, str | None]]:
    """Return every site that may rightly be named."""
    if 'at_work' in truth:
        return {(str(effect), joint) for effect, joint in truth['at_work']}
    return {site for answer in answers_of(truth) for site in answer}


def _case(row: Mapping[str, Any]) -> Case:
    if 'right' in row:
        told = judge(
            {**row['truth'], 'causes': ()}, {'verdict': {'effects': (), **row['verdict']}}
        )
        return Case(row, told, bool(row['right']), bool(row['honest']))
    truth = {**row['truth'], 'causes': (), 'alike': [*row['truth']['alike'], *_absorbed(row)]}
    told = judge(truth, {'verdict': {'effects': (), **row['verdict']}})
    several = 'shown' in row['truth']
    right = whole(row['truth'], row['verdict']).right if several else told.right
    right = right and _sets_hold(row)
    sealed = row['sealed']
    as_good = sealed['after'] < AS_GOOD * sealed['floor'] and told.status in NAMING
    return Case(row, told, right, right or (as_good and bool(row['truth']['sites'])))


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


def _sets_hold(row: Mapping[str, Any]) -> bool:
    """Return whether each member of a set predicts as well as the right one."""
    at_work = _at_work(row['truth'])
    floor = row['sealed']['floor']
    for group in row['sealed'].get('members', ()):
        left = {(item['effect'], item['joint']): item['left'] for item in group}
        right = [site for site in left if site in at_work]
        if len(left) < 2 or not right:
            continue
        same = set().union(*(alike_by_structure(row['truth']['robot'], site) for site in right))
        most = min(left[site] for site in right) + AS_WELL * floor
        if any(value > most for site, value in left.items() if site not in same):
            return False
    return True


def examples_of(cases: Sequence[Case]) -> list[Example]:
    """
    Return every statement made on the cases.

    Parameters
    ----------
    cases : sequence of Case

    """
    return [example for case in cases for example in _examples(case)]


def _examples(case: Case) -> Iterator[Example]:
    row, status = case.row, case.judged.status
    name, group = str(row['name']), group_of(status, row['signs'])
    causes = row['verdict']['causes']
    signs = {**row['signs'], 'top_share': causes[0]['share'] if causes else 0.0}
    yield Example(name, f'answer {group}', signs, case.right, signs['belief'])
    if status == 'none':
        return
    truths = levels_of(row['truth'])
    at_work = _at_work(row['truth'])
    for cause, more in zip(row['verdict']['causes'], row['cause_signs'], strict=True):
        both = {**signs, **more}
        slot = status in NAMING if 'effect' not in cause else cause['effect'] is not None
        group = level_group_of(status, row['signs'], named=slot)
        if cause['place']:
            here = cause['place'][0]['at']
            hit = any(here in truth.places for truth in truths)
            yield Example(name, f'place {group}', both, hit, more['place'])
        if cause['dependence']:
            on = cause['dependence'][0]['on']
            hit = any(on in truth.dependences for truth in truths)
            yield Example(name, f'dependence {group}', both, hit, more['dependence'])
        sites = [(item['effect'], item['joint']) for item in cause['name']]
        if sites and (slot or group == 'families'):
            hit = any(site in at_work for site in sites)
            told = sum(item for key, item in more.items() if key in ('name', 'name_second'))
            yield Example(name, f'name {group}', both, hit, min(told, 1.0))
