# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Diagnoses of a small arm: the truth is named, and every number is as it was kept.

A change of the engine that is meant to change nothing leaves them as they are. After one that is meant
to change answers they are written anew, and the difference is read:

    tools/in_env env PYTHONPATH=src/weld_twin_core/test python test/diagnosis/test_kept_answers.py

Probabilities are left out, for they are learned anew from time to time, and so are sentences.
"""

import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnosis_cells import recorded, sites
from small_arm import small_arm

from weld_twin_core.diagnosis import diagnose
from weld_twin_core.diagnosis.advice import Limits
from weld_twin_core.diagnosis.predicting import sizes
from weld_twin_core.effects import REGISTRY

pytestmark = pytest.mark.drawn
LIBRARY = 'library'
"""Key of the kept file with the effects that were there: one that is new changes no kept answer."""
FILE = Path(__file__).with_name('kept_answers.json')
KEPT = json.loads(FILE.read_text(encoding='utf-8'))
NEAR, NOTHING = 4e-3, 1e-8
"""Share by which a number may differ, twice what another processor's way to solve equations was seen to
make of one (`OPENBLAS_CORETYPE=Prescott`), and a size below which it is nothing."""
LONG = 8
"""Numbers of a list from which on their count and two norms, of all and of half, stand for them."""
LEARNED = {'probability', 'confidence', 'learned', 'sure', 'complete', 'schema', 'seconds'}
LIFT, ELBOW = 'shoulder_lift_joint', 'elbow_joint'
PLAY = {'effect': 'backlash', 'joint': ELBOW, 'width': 8e-4}
SPRING = {'effect': 'joint_compliance', 'joint': LIFT, 'compliance': 1.2e-5}
ZERO = {'effect': 'joint_offset', 'joint': ELBOW, 'offset': -6e-4}
LATER = {**ZERO, 'offset': 1.2e-3}
RIPPLE = {
    'effect': 'transmission_ripple',
    'joint': LIFT,
    'amplitude': 3e-4,
    'order': 3,
    'phase': 0.7,
}
BOTH = {'align': {'base', 'tool'}}
SPREAD = {'static': 25, 'orientation': False}
LOST = ['backlash', 'gravity_backlash', 'friction', 'hysteresis', 'loaded_play']
CASES: dict[str, tuple[list[list[dict[str, Any]]], int, dict[str, Any], dict[str, Any], set[Any]]]
CASES = {
    'noise': ([[]], 0, {'static': 15, 'richness': 0.0}, {}, set()),
    'spring': ([[SPRING, ZERO]], 0, SPREAD, BOTH, {('joint_compliance', LIFT)}),
    'spring taken out': ([[SPRING]], 0, SPREAD, {'exclude': ['joint_compliance']}, set()),
    'wave, held out': ([[RIPPLE]] * 2, 1, SPREAD, BOTH, {('transmission_ripple', LIFT)}),
    'changed': (
        [[ZERO], [LATER]],
        0,
        {'static': 12},
        {'align': {'base'}, 'may_change': 'joint_offset'},
        {('joint_offset', ELBOW)},
    ),
    'play': ([[PLAY]], 0, {'seconds': 4.0}, {}, {('backlash', ELBOW)}),
    'play taken out': ([[PLAY]], 0, {'seconds': 4.0}, {'exclude': LOST}, set()),
    'many': ([[]], 0, {'static': 30}, {}, set()),
}
"""Truths of the recordings, how many of these are held out, how they are made, what a diagnosis is
asked, and what it must name."""


def many() -> list[dict[str, Any]]:
    """Return an error of every zero and every link."""
    rng = np.random.default_rng(4)
    kinds = (
        ('joint_offset', 'offset', 1e-3),
        ('link_length', 'da', 4e-4),
        ('link_twist', 'dalpha', 1e-3),
    )
    return [
        {'effect': name, 'joint': joint, key: float(rng.normal(scale=size))}
        for name, key, size in kinds
        for joint in small_arm().joint_names
    ]


@cache
def given(name: str) -> dict[str, Any]:
    """Return what a case hands to a diagnosis; made once."""
    truths, held, made, asked, _ = CASES[name]
    truths = [many()] if name == 'many' else truths
    each = [
        recorded(small_arm(), true, k, name=f'{k}', **made) for k, true in enumerate(truths, 1)
    ]
    used = len(each) - held
    return {'recordings': each[:used], 'robot': small_arm(), 'holdout': each[used:], **asked}


def answer(name: str) -> Any:
    """Return the diagnosis of a case, with fewer models drawn than usual: the numbers are kept."""
    library = KEPT.get(LIBRARY, REGISTRY)
    with pytest.MonkeyPatch.context() as changed:
        for new in set(REGISTRY) - set(library):
            changed.delitem(REGISTRY, new)
        changed.setattr(sizes, 'SWEEPS', 24)
        changed.setattr(sizes, 'LEARNING', 6)
        return diagnose(
            experiment=name in ('noise', 'spring', 'play'), limits=Limits(), **given(name)
        )


def told(diagnosis: Any) -> dict[str, float | str]:
    """Return an answer as numbers and single words, by their place in it."""
    whole = diagnosis.as_dict()
    whole['statements'] = [dict(one.features) for one in diagnosis.statements]
    # Of the models allowed, numbers by the thousand: all in one list.
    allowed = _flat(whole.pop('posterior', None), '')
    whole['posterior'] = [value for _, value in allowed if isinstance(value, float)]
    return dict(_flat(whole, ''))


def _flat(value: Any, at: str) -> Iterator[tuple[str, float | str]]:
    if isinstance(value, dict):
        for key, own in value.items():
            if key not in LEARNED:
                yield from _flat(own, f'{at}/{key}')
    elif isinstance(value, list | tuple):
        numbers = _numbers(value)
        if numbers.size >= LONG:
            # A plain sum may cancel, and would then be rounding.
            ends = (numbers, numbers[: numbers.size // 2])
            value = [float(numbers.size), *(float(np.linalg.norm(part)) for part in ends)]
        for k, own in enumerate(value):
            yield from _flat(own, f'{at}/{k}')
    elif isinstance(value, str):
        if value and ' ' not in value:
            yield at, value
    elif value is not None:
        yield at, float(f'{float(value):.4g}')


def _numbers(value: Any) -> Any:
    """Return nested lists of numbers alone as one array; none of anything else."""
    try:
        return np.asarray(value, dtype=float).ravel()
    except (TypeError, ValueError):
        return np.zeros(0)


@pytest.mark.parametrize('name', CASES)
def test_an_answer_names_the_truth_and_is_as_it_was_kept(name):
    found = answer(name)
    assert all(any(site in group for group in sites(found)) for site in CASES[name][-1])
    now, kept = told(found), KEPT[name]
    words = {key for key, value in kept.items() if isinstance(value, str)}
    assert {key: now.get(key) for key in words} == {key: kept[key] for key in words}
    numbers = {key: value for key, value in kept.items() if key not in words}
    assert {key: now.get(key) for key in numbers} == pytest.approx(
        numbers, NEAR, NOTHING, nan_ok=True
    )
    assert now.keys() == kept.keys()


if __name__ == '__main__':
    KEPT[LIBRARY] = sorted(REGISTRY)
    every = {LIBRARY: KEPT[LIBRARY]} | {name: told(answer(name)) for name in CASES}
    FILE.write_text(json.dumps(every, indent=0) + '\n', encoding='utf-8')
