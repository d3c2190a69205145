# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The SROS2 policy of the nodes, for a namespace and with remaps: each may do what it does."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from xml.sax.saxutils import quoteattr

from weld_twin_core.errors import DataError

from .graph_table import SPOKEN

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
    Return the policy as `ros2 security create_permission` reads it.

    namespace: of all the nodes.
    remaps: names as the nodes have them, with or without the namespace, to the names they get.
    nodes: nodes it is for; none for all.

    Raises DataError: a node or the name that is remapped is unknown.
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
    """Return the enclave of a node; what is remapped has its full name."""
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
