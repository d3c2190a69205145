# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What each node says, hears, answers and asks: the one table of it, and the SROS2 policy made of it.

A test holds it to what the running nodes open. Names without a slash lie in the node's namespace.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.messages import topics as t
from weld_twin_msgs_py.messages.topics import Topic

_EVERYBODY_SAYS = ('/diagnostics', '/parameter_events', '/rosout')
_EVERYBODY_HEARS = ('/clock', '/diagnostics')
_EVERYBODY_ANSWERS = tuple(
    f'~/{name}'
    for name in (
        'describe_parameters',
        'get_parameter_types',
        'get_parameters',
        'get_type_description',
        'list_parameters',
        'set_parameters',
        'set_parameters_atomically',
    )
)
COMMON = frozenset({*_EVERYBODY_SAYS, *_EVERYBODY_HEARS, *_EVERYBODY_ANSWERS})
_MANAGED_ANSWER = tuple(
    f'~/{name}'
    for name in (
        'change_state',
        'get_available_states',
        'get_available_transitions',
        'get_state',
        'get_transition_graph',
    )
)
_MANAGED_SAY = ('~/transition_event',)


class Spoken(NamedTuple):
    """Topics, services and actions of a node, sorted, each name once."""

    publishes: tuple[str, ...]
    hears: tuple[str, ...]
    answers: tuple[str, ...]
    asks: tuple[str, ...] = ()
    does: tuple[str, ...] = ()  # actions that it offers
    sends: tuple[str, ...] = ()  # actions of others that it sends goals to


def _names(rows: Iterable[Topic | str]) -> set[str]:
    return {row if isinstance(row, str) else row.relative for row in rows}


def _node(
    says: Iterable[Topic | str],
    hears: Iterable[Topic | str],
    answers: Iterable[str] = (),
    asks: Iterable[str] = (),
    actions: tuple[Iterable[str], Iterable[str]] = ((), ()),
) -> Spoken:
    return Spoken(
        tuple(sorted({*_EVERYBODY_SAYS, *_names(says)})),
        tuple(sorted({*_EVERYBODY_HEARS, *_names(hears)})),
        tuple(sorted({*_EVERYBODY_ANSWERS, *answers})),
        tuple(sorted(asks)),
        *(tuple(sorted(each)) for each in actions),
    )


_MODEL = (t.JOINT_STATES, t.TOOL_WRENCH, t.TEMPERATURE, t.ROBOT_DESCRIPTION, *t.FRAMES)
_MEASURED = (t.MEASURED_POSE, t.MEASURED_POINT, t.ROBOT_DESCRIPTION, *t.FRAMES)
SPOKEN = {
    'trajectory_generator': _node(
        (t.JOINT_STATES, t.PLANNED_TRAJECTORY, t.PLANNED_PATH),
        (
            *(t.DEVIATION, t.JOINT_TRAJECTORY, t.PATH, t.ROBOT_DESCRIPTION),
            *t.FRAMES,
        ),
    ),
    'error_injector': _node((t.ACTUAL_JOINT_STATES, t.MEASURED_POSE), _MODEL, ('~/reload',)),
    'forward_kinematics_twin': _node(
        (t.TWIN_POSE, t.TWIN_COVARIANCE, t.TWIN_BASE), _MODEL, ('~/reload',)
    ),
    'deviation_analyzer': _node(
        (t.DEVIATION, t.DEVIATION_METRICS), (*_MEASURED, t.TWIN_BASE, t.TWIN_POSE)
    ),
    'live_diagnosis': _node(
        (t.DIAGNOSIS, *_MANAGED_SAY),
        (*_MODEL, *_MEASURED, t.MEASURED_SIGMA, t.IMAGE_POINTS),
        _MANAGED_ANSWER,
    ),
    'deviation_markers': _node((t.MARKERS,), (*_MEASURED, t.TWIN_BASE, t.DEVIATION)),
    'contact_marker': _node((t.CONTACT,), (t.JOINT_STATES,), ('~/mark',)),
    'compensator': _node(
        (t.POSE_OUT, t.CORRECTION, t.AUDIT, *_MANAGED_SAY),
        (*_MODEL, t.DEVIATION, t.POSE_IN),
        ('~/reload', *_MANAGED_ANSWER),
        actions=(
            ('~/follow_joint_trajectory',),
            ('joint_trajectory_controller/follow_joint_trajectory',),
        ),
    ),
    'recorder': _node(
        _MANAGED_SAY,
        (*t.TOPICS, *t.AROUND, *t.FRAMES, '/parameter_events'),
        ('~/counts', *_MANAGED_ANSWER),
        ('error_injector/get_parameters', 'forward_kinematics_twin/get_parameters'),
    ),
}
"""Everything that a node opens with any of its parameters."""


HEAD = """\
<?xml version="1.0" encoding="UTF-8"?>
<!-- What each node of weld_twin may say, hear, answer and ask; nothing else. -->
<policy version="0.2.0">
  <enclaves>
"""
TAIL = """\
  </enclaves>
</policy>
"""
PARTS = (
    ('topics', 'publish', 'topic'),
    ('topics', 'subscribe', 'topic'),
    ('services', 'reply', 'service'),
    ('services', 'request', 'service'),
    ('actions', 'execute', 'action'),
    ('actions', 'call', 'action'),
)
"""What a node may do, in the order of the fields of `Spoken`."""


def policy(
    namespace: str = '', remaps: Mapping[str, str] | None = None, nodes: Sequence[str] = ()
) -> str:
    """
    Return the policy as `ros2 security create_permission` reads it, for some nodes or all.

    remaps: names as the nodes have them, with or without the namespace, to the names they get.
    """
    chosen = tuple(nodes) or tuple(SPOKEN)
    unknown = [name for name in chosen if name not in SPOKEN]
    if unknown:
        raise DataError(f'no node is called {unknown[0]!r}; there are {", ".join(SPOKEN)}')
    space = '/' + namespace.strip('/')
    wanted = {_full(name, space): to for name, to in (remaps or {}).items()}
    known = {_full(name, space) for each in chosen for part in SPOKEN[each] for name in part}
    for name in wanted:
        if name not in known:
            raise DataError(f'{name} is remapped, but none of the nodes has that name')
    profiles = [_profile(name, space, wanted) for name in chosen]
    return HEAD + ''.join(profiles) + TAIL


def enclave(node: str, namespace: str = '') -> str:
    """Return the enclave of a node, as the launch files give it."""
    return f'/{namespace.strip("/") or "weld_twin"}/{node}'


def _full(name: str, space: str) -> str:
    if name.startswith(('/', '~')):
        return name
    return f'{space.rstrip("/")}/{name}'


def _profile(node: str, space: str, remaps: Mapping[str, str]) -> str:
    lines = [
        f'    <enclave path={quoteattr(enclave(node, space))}>',
        '      <profiles>',
        f'        <profile ns={quoteattr(space)} node={quoteattr(node)}>',
    ]
    for (kind, permission, item), names in zip(PARTS, SPOKEN[node], strict=True):
        if names:
            lines.append(f'          <{kind} {permission}="ALLOW">')
            lines += [
                f'            <{item}>{name}</{item}>' for name in _renamed(names, space, remaps)
            ]
            lines.append(f'          </{kind}>')
    lines += ['        </profile>', '      </profiles>', '    </enclave>']
    return '\n'.join(lines) + '\n'


def _renamed(names: Iterable[str], space: str, remaps: Mapping[str, str]) -> list[str]:
    out = {
        _full(remaps[_full(name, space)], space) if _full(name, space) in remaps else name
        for name in names
    }
    return sorted(out)
