# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which signs each level is learned from, and which way each may count.

1: more of it is good news, so its weight may not be negative; -1: bad news; 0: either. A level
starts from what was believed of it before, the first of its signs.
"""

from __future__ import annotations

from weld_twin_core.diagnosis.trust.model import OF_KIND, ON, PRESENT
from weld_twin_core.effects.registry import REGISTRY

_FAMILIES = [name for name, kind in REGISTRY.items() if kind.cause]
_KINDS = sorted({ON + REGISTRY[name].depends_on for name in _FAMILIES})
_IN_ANSWER = {start + name: 0 for start in PRESENT[:2] for name in (*_FAMILIES, *_KINDS)}
"""Which families an answer names, in a set or alone, and what they depend on: either way, as some
stand in for others."""
_IN_CAUSE = {start + name: 0 for start in PRESENT[2:] for name in (*_FAMILIES, *_KINDS)}
"""The same of one cause."""
_ANSWER_FORMS = {f'{sign}_{PRESENT[0]}{kind}': -1 for sign in OF_KIND for kind in _KINDS}
_CAUSE_FORMS = {f'{sign}_{PRESENT[2]}{kind}': -1 for sign in OF_KIND for kind in _KINDS}
"""Whether formulas hold, of each kind of family named."""
_MOTION = {'moving': 1, 'wide': 1, 'rows': 1, 'static': 0, 'orientation': 1, 'aligned': -1}
_TRAVELLED = {'travel': 1, 'turns': 0, 'samples': 0}
_LEFT = {
    'left': -1,
    'rise': -1,
    'share': -1,
    'structure_gain': -1,
    'structure_sure': -1,
    'after': -1,
    'elsewhere': -1,
}
_FORMULA = {
    'own_back': 1,
    'own_margin': 1,
    'own_apart': 1,
    'own_elsewhere': 1,
    'own_formula': 1,
    'own_left': -1,
    'own_left_sure': -1,
    'own_wander': -1,
    'own_wander_place': -1,
    'left_at_joint': -1,
    'left_at_joint_sure': -1,
    'left_peaks': 0,
    'left_alike': 0,
}
"""Whether formulas hold: of the worst effect of an answer, or of the one a statement is about."""
_NAMED = {
    'mass': 1,
    'leader': 1,
    'margin': 1,
    'apart': 1,
    'near': -1,
    'nats': 1,
    'weakest': 1,
    'strongest': 0,
    'separate': -1,
    'breadth': 0,
    'alike': -1,
    'cancel': -1,
    'coordinates': -1,
    'constants': 0,
    'angles': 0,
    'joints_shared': -1,
    'glimpsed': -1,
    'top_share': 0,
    'curve_gain': -1,
    'curve_sure': -1,
    'curve_left': -1,
    'curve_place': 0,
    'curves': 0,
    'form_gain': 0,
    'form_sure': 0,
    'gap': 0,
    'slots': 0,
    'notes': -1,
    'constant_at_rest': -1,
    'constant_in_narrow': -1,
    **_FORMULA,
    **_LEFT,
    **_MOTION,
    **_TRAVELLED,
}
_CAUSE = {
    'cause_share': 1,
    'cause_size': 1,
    'cause_spread': -1,
    'cause_rank': -1,
    'cause_count': -1,
    'one_joint': 0,
    'curve_gain': 0,
    'curve_left': -1,
    'breadth': 0,
    'constants': 0,
    **_LEFT,
    **_MOTION,
}
_STANDS = {
    'own_mass': 1,
    'own_margin': 1,
    'own_nats': 1,
    'own_back': 1,
    'own_left': -1,
    'own_wander': -1,
    'own_wander_place': -1,
    'cancel': -1,
    'refused': -1,
    'alike': -1,
    'separate': 0,
    'gap': 0,
    **{f'cause_is_{kind}': 0 for kind in _KINDS},
}
"""Whether an effect stands that was found beside what has no name."""
TERMS: dict[str, dict[str, int]] = {
    'answer named': {'belief': 1, **_NAMED, **_IN_ANSWER, **_ANSWER_FORMS},
    'answer unknown': {
        'belief': 1,
        'gap': 0,
        'left': 1,
        'after': 1,
        'elsewhere': 0,
        'structure_gain': 1,
        'structure_sure': 1,
        'curves': 0,
        'curve_gain': 1,
        'curve_sure': 1,
        'separate': 0,
        'refused': 0,
        'cancel': 1,
        'top_share': 1,
        'weakest': 1,
        'strongest': 0,
        'margin': 0,
        'nats': 0,
        'slots': 0,
        'own_left': 0,
        'own_wander': 0,
        'left_at_joint': 1,
        'left_at_joint_sure': 1,
        **_MOTION,
        **_TRAVELLED,
    },
    'answer partly': {
        'belief': 1,
        'left': 0,
        'after': 0,
        'structure_gain': 0,
        'structure_sure': 0,
        'mass': 1,
        'separate': -1,
        'cancel': -1,
        'refused': -1,
        'own_back': 1,
        'weakest': 1,
        'gap': 0,
        'curve_gain': -1,
        'static': 0,
        'aligned': -1,
    },
    'answer none': {
        'belief': 1,
        'gap': -1,
        'after': -1,
        'rise': -1,
        'structure_gain': -1,
        'structure_sure': -1,
        'independent': 1,
        'left_at_joint': -1,
        'left_at_joint_sure': -1,
        **_MOTION,
    },
    'place named': {
        'place': 1,
        'place_second': -1,
        'curve_at_place': 1,
        'margin': 1,
        'apart': 1,
        **_CAUSE,
        **_FORMULA,
        **_IN_ANSWER,
        **_IN_CAUSE,
    },
    'place unknown': {
        'place': 1,
        'place_second': -1,
        'curve_place': 1,
        'curve_sure': 1,
        **_CAUSE,
    },
    'dependence named': {
        'dependence': 1,
        'dependence_second': -1,
        'curve_on_dependence': 1,
        'margin': 1,
        'apart': 1,
        **_CAUSE,
        **_FORMULA,
        **_IN_ANSWER,
        **_IN_CAUSE,
    },
    'dependence unknown': {
        'dependence': 1,
        'dependence_second': -1,
        'curve_sure': 1,
        **_CAUSE,
    },
    'place partly': {'place': 1, 'place_second': -1, **_CAUSE, **_STANDS},
    'dependence partly': {'dependence': 1, 'dependence_second': -1, **_CAUSE, **_STANDS},
    'name partly': {'name': 1, **_CAUSE, **_STANDS},
    'name named': {
        'name': 1,
        'belief': 1,
        **_CAUSE,
        **_NAMED,
        **_IN_ANSWER,
        **_IN_CAUSE,
        **_CAUSE_FORMS,
    },
}
"""Signs of each level and group of status, with the way they may count."""
RANGES = {
    'curve_gain': (-1.0, 1.0),
    'curve_sure': (-3.0, 10.0),
    'structure_sure': (-3.0, 10.0),
    'own_left': (-0.05, 0.3),
    'own_left_sure': (-3.0, 10.0),
    'left_at_joint': (-0.05, 0.3),
    'left_at_joint_sure': (-3.0, 10.0),
    'own_wander': (-1.0, 3.0),
    'own_wander_place': (-1.0, 3.0),
    'own_formula': (-0.5, 2.0),
}
"""Signs that are cut before anything is learned: far outside only a bad fit is told."""
RANGES |= {
    name: RANGES[sign]
    for sign in OF_KIND
    for name in (*_ANSWER_FORMS, *_CAUSE_FORMS)
    if name.startswith(sign)
}
BENT = (
    'belief',
    'name',
    'margin',
    'apart',
    'nats',
    'weakest',
    'strongest',
    'gap',
    'left',
    'after',
    'structure_gain',
    'curve_gain',
    'rows',
    'travel',
    'turns',
    'samples',
    'cause_size',
    'cause_share',
    'own_elsewhere',
    'own_wander',
    'own_left_sure',
)
"""Signs whose log odds may bend at a third and at two thirds of the examples: a margin of two nats
says much more than none, one of two hundred no more than one of a hundred."""
BENT_LEVELS = ('named',)
"""Groups with examples enough for that: of others, curves told of cases never seen were worse."""
