# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which features each kind of statement is learned from, and which way each may count.

A feature that is good news may not lower belief because of chance in a few hundred cases, so most
weights may have one sign only: 1 is good news, -1 bad news, 0 either.
"""

from __future__ import annotations

from weld_twin_core.diagnosis.calibration.features import TOLD_AS

RISK, CAUSE_RISK = 0.003, 0.01
"""Probability that an answer is sure and wrong, and that a cause told as sure is wrong."""
NAMES = {
    'names': 1,
    'least name': 1,
    'told': 0,
    'least size': 0,
    'widest set': 0,
}
"""What the names told add up to."""
NAMED = {
    **{name: way for name, way in NAMES.items() if name != 'least size'},
    'gap': 0,
    'structure': -1,
    'rows': 0,
    'stations': 0,
    'lacking': -1,
    'cancelling': -1,
    'left': -1,
    'left unexplained': -1,
    'instrument and base': -1,
}
"""What speaks for an answer that names causes; against it speaks that one of them has no name."""
MANY = {
    'growth': 1,
    'least growth': 1,
    'size over left': 1,
    'rows': 0,
    'structure': -1,
    'kinds': 1,
    'lacking': -1,
}
"""What speaks for a kind of many small errors."""
REST = {'weight': 1, 'second': -1, 'share': 1, 'steady': 1, 'groups': 0}
TERMS: dict[str, dict[str, int]] = {
    'name': {
        'gap': 1,
        'instrument and base': -1,
        'left unexplained': -1,
        'structure': -1,
        'rows': 0,
        'joints moving': 1,
        'stations': 0,
        'lacking': -1,
        'behind': -1,
        'cancelling': -1,
        'weight': 1,
        'evidence': 1,
        'size': 1,
        'faint beside others': -1,
        'others of its curve': -1,
        'part of a wave': -1,
        'wander over size': -1,
        'missed': 1,
        'least missed': 1,
        'left at its joint': -1,
        'constant': 0,
        'angle': 0,
    },
    'place': {
        'weight of the place': 1,
        'size': 1,
        'gap': 0,
        'wander': 0,
    },
    'dependence': {
        'weight of the dependence': 1,
        'rows': 0,
        'constant': 0,
        'angle': 0,
        'wander': 0,
    },
    # A set with more names is likelier to hold the right one.
    'name of many': {**MANY, 'members': 1},
    'place of many': MANY,
    'dependence of many': MANY,
    'place of the rest': {**REST, 'gap': 0, 'rows': 0, 'stations': 0},
    'dependence of the rest': {**REST, 'gap': 0, 'rows': 0, 'stations': 0},
    'complete': {
        'left': -1,
        'left unexplained': -1,
        'structure': -1,
        'gap': 0,
        'hardly a gap': 0,
        **{f'told as {one}': 0 for one in TOLD_AS},
        **NAMES,
    },
    'nameless': {name: -way for name, way in NAMED.items()},
    'answer, named': {**NAMED, 'a wide set': -1, 'one faint beside others': -1},
    'answer, unknown': {
        'gap': 0,
        'left unexplained': 0,
        'hardly a gap': 0,
        'groups': 0,
        'no group': 0,
        'steady': 1,
        'rows': 0,
        'stations': 0,
        'structure': 1,
        'lacking': 1,
        **NAMES,
    },
    'answer, none': {'structure': -1, 'rows': 0, 'left': -1},
    'answer, many': {'structure': -1, 'lacking': -1, 'gap': 0, 'least name': 1, 'told': 0},
}
"""By kind of statement, as `weld_twin_core.diagnosis.calibration.features.KINDS` lists them."""
OF_FAMILIES = frozenset({'name', 'nameless'})
"""Kinds of statements that each family named alone is a feature of: some imitate others often."""
