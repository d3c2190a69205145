# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""JSON Schemas of the files that people write, described from the classes that read them."""

from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any

from weld_twin_core.contacts import KINDS as CONTACTS
from weld_twin_core.effects import REGISTRY, Effect
from weld_twin_core.effects.plausible import table
from weld_twin_core.motion.paths import Torch, Weave
from weld_twin_core.motion.paths.seams import FORMS, HEADINGS, SEAMS

DRAFT = 'http://json-schema.org/draft-07/schema#'
"""The draft that editors know best."""
Schema = dict[str, Any]
NUMBER: Schema = {'type': 'number'}
TEXT: Schema = {'type': 'string'}


def _vector(count: int, what: str = '') -> Schema:
    out: Schema = {'type': 'array', 'items': NUMBER, 'minItems': count, 'maxItems': count}
    return out | ({'description': what} if what else {})


def _object(keys: Mapping[str, Schema], required: tuple[str, ...] = ()) -> Schema:
    out: Schema = {'type': 'object', 'properties': dict(keys), 'additionalProperties': False}
    return out | ({'required': list(required)} if required else {})


def _said(schema: Schema, what: str) -> Schema:
    return {**schema, 'description': what}


def _joint() -> Schema:
    return _object(
        {
            'name': TEXT,
            'type': {'enum': ['revolute', 'prismatic']},
            'a': _said(NUMBER, 'link length [m]'),
            'alpha': _said(NUMBER, 'link twist [rad]'),
            'd': _said(NUMBER, 'link offset [m]'),
            'theta_offset': _said(NUMBER, 'added to the reading [rad]'),
            'beta': _said(NUMBER, "Hayati's angle [rad]"),
            'lower': _said(NUMBER, 'limit [rad or m]'),
            'upper': _said(NUMBER, 'limit [rad or m]'),
            'max_velocity': _said(NUMBER, '[rad/s or m/s]'),
            'max_acceleration': _said(NUMBER, '[rad/s^2 or m/s^2]'),
        },
        ('name',),
    )


def _frame() -> Schema:
    return _object(
        {'xyz': _vector(3, 'position [m]'), 'quat_xyzw': _vector(4, 'orientation, scalar last')}
    )


def _chain() -> dict[str, Schema]:
    """Return the keys that the chain of a robot and that of its workpiece have alike."""
    mass = {'mass': _said(NUMBER, '[kg]'), 'com': _vector(3, 'centre of mass [m]')}
    return {
        'name': TEXT,
        'convention': {'enum': ['standard', 'modified'], 'description': 'kind of DH rows'},
        'base': _said(_frame(), 'the base in the world'),
        'tool': _said(_frame(), 'the tool at the flange'),
        'joints': {'type': 'array', 'items': _joint(), 'minItems': 1},
        'links': {'type': 'array', 'items': _object(mass), 'description': 'one per joint'},
        'payload': _object(mass),
    }


def _robot() -> Schema:
    limits = _object({'sd': NUMBER, 'low': NUMBER, 'high': NUMBER})
    effects = {effect for effect, _ in table()}
    return _object(
        {
            **_chain(),
            'gravity': _vector(
                3, 'in the base frame [m/s^2]: (0, 0, 9.80665) for an arm on a ceiling'
            ),
            'workpiece': _said(
                _object(_chain(), ('joints',)),
                'the positioner that moves the workpiece: its tool is the measuring frame, its '
                'payload the workpiece',
            ),
            'controller': _said(
                _object(
                    dict.fromkeys(('base', 'flange', 'foot'), _frame())
                    | {'base_link': TEXT, 'flange_link': TEXT}
                ),
                "the controller's base, and the link the arm stands in (foot), in the base; the "
                "controller's flange at the end of the last row",
            ),
            'source': _said(TEXT, 'where the numbers come from'),
            'plausible': _object(
                {
                    effect: _object({p: limits for e, p in table() if e == effect})
                    for effect in sorted(effects)
                }
            ),
        },
        ('joints',),
    )


def _effects() -> Schema:
    return {
        'type': 'array',
        'items': {'oneOf': [_effect(REGISTRY[name]) for name in sorted(REGISTRY)]},
    }


def _effect(kind: type[Effect]) -> Schema:
    keys: dict[str, Schema] = {'effect': {'const': kind.name}}
    declared = {parameter.name: parameter for parameter in kind.parameters}
    required = ['effect']
    for item in fields(kind):
        parameter = declared.get(item.name)
        if parameter is None:
            keys[item.name] = _of_type(str(getattr(item.type, '__name__', item.type)))
        else:
            one = dict(NUMBER)
            if parameter.lower > -float('inf'):
                one['minimum'] = parameter.lower
            if parameter.upper < float('inf'):
                one['maximum'] = parameter.upper
            many = {'type': 'array', 'items': one}
            size = {'minItems': parameter.size, 'maxItems': parameter.size}
            keys[item.name] = {
                0: {'anyOf': [one, many]},
                1: one,
            }.get(parameter.size, many | size)
            keys[item.name] = _said(keys[item.name], f'[{parameter.unit}]')
        if item.default is MISSING and item.default_factory is MISSING:
            required.append(item.name)
    return _object(keys, tuple(required)) | {
        'title': kind.name,
        'description': kind.traits.formula,
    }


def _of_type(annotation: str) -> Schema:
    """Return the schema of a field that is no parameter, by its annotation."""
    known: dict[str, Schema] = {
        'str': TEXT,
        'float': NUMBER,
        'Sequence[float]': {'type': 'array', 'items': NUMBER},
        'Sequence[str]': {'type': 'array', 'items': TEXT},
        'Array': _vector(3, '[m]'),
    }
    ways = [known[each] for each in annotation.split(' | ') if each != 'None']
    return ways[0] if len(ways) == 1 else {'anyOf': ways}


def _seam() -> Schema:
    torch = _object({f.name: _of_type(str(f.type)) for f in fields(Torch)})
    torch['properties']['heading'] = {'enum': list(HEADINGS)}
    weave = {f.name: _of_type(str(f.type)) for f in fields(Weave) if f.name != 'seam'}
    weave['form'] = {'enum': list(FORMS)}
    extra = {'torch': torch, 'weave': _object(weave, ('amplitude', 'wavelength'))}
    kinds = []
    for name, kind in SEAMS.items():
        keys = {f.name: _of_type(str(f.type)) for f in fields(kind)}
        if 'points' in keys:
            keys['points'] = {'type': 'array', 'items': _vector(3, '[m]'), 'minItems': 2}
        required = [
            f.name for f in fields(kind) if f.default is MISSING and f.default_factory is MISSING
        ]
        own = {'kind': {'const': name}, **keys, **extra}
        kinds.append(_object(own, ('kind', *required)) | {'title': name})
    rows = {'type': 'array', 'items': {'type': 'array', 'items': NUMBER}}
    joints = _object(
        {
            'kind': {'const': 'joints'},
            'stations': _said({'type': 'boolean'}, 'each is measured at rest'),
            'joint_names': {'type': 'array', 'items': TEXT},
            't': {'type': 'array', 'items': NUMBER, 'description': '[s]'},
            'q': _said(rows, 'a row for each time [rad or m]'),
        },
        ('kind', 't', 'q'),
    )
    return {'oneOf': [*kinds, joints | {'title': 'joints'}]}


def _artefact() -> Schema:
    named = {'enum': list(CONTACTS)}
    above: Schema = {'type': 'number', 'exclusiveMinimum': 0}
    place = {'at': _vector(3, 'where it is known to be [m]'), 'sigma': _said(above, '[m]')}
    contact = _object(
        {'kind': named, 'radius': _said(NUMBER, 'of a sphere [m]')}
        | place
        | {'axis': _vector(3, 'normal or direction where it is known')}
    )
    block = _object(
        {'size': _vector(3, 'along its x, y and z [m]'), 'square': _said(above, '[rad]')}
        | place
        | {'turn': _vector(3, 'rotation vector [rad] where it is known')},
        ('size',),
    )
    tie = _object(
        {
            'between': {'type': 'array', 'items': TEXT, 'minItems': 2, 'maxItems': 2},
            'value': {'type': 'number', 'minimum': 0},
            'sigma': above,
        },
        ('between', 'value'),
    )
    ties = {'type': 'array', 'items': tie}
    each = {'type': 'object', 'additionalProperties': {'anyOf': [named, contact]}}
    return _object(
        {
            'contacts': _said(each, 'what every label of a table of touches is'),
            'blocks': _said(
                {'type': 'object', 'additionalProperties': block},
                'blocks, whose faces are contacts called LABEL +x to LABEL -z',
            ),
            'distances': _said(ties, 'known distances [m] of points, centres, parallel planes'),
            'angles': _said(ties, 'known angles between planes [rad], 0 of parallel ones'),
        }
    )


_MADE = {'robot': _robot, 'effects': _effects, 'seam': _seam, 'artefact': _artefact}
NAMES = tuple(_MADE)
"""What there are schemas of; an artefact file says what the contacts of a CSV touched."""


def schema(name: str) -> Schema:
    """Return the JSON Schema of a kind of file, one of `NAMES`."""
    return {'$schema': DRAFT, 'title': f'weld_twin {name} file', **_MADE[name]()}
