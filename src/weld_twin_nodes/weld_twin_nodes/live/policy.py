# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The SROS2 policy of the nodes, for a namespace, remapped names, or some of them.

What each node says, hears, answers and asks with any of its parameters stands in
``weld_twin.policy.xml``; a test holds it to what the running nodes open. Names without a slash lie in
the node's namespace.
"""

import re
from collections.abc import Mapping, Sequence
from importlib.resources import files
from xml.sax.saxutils import quoteattr

from weld_twin_core.errors import DataError

_TEXT = (files(__package__) / 'weld_twin.policy.xml').read_text(encoding='utf-8')
_PROFILE = re.compile(r' *<enclave .*? node="(\w+)".*?</enclave>\n', re.DOTALL)
_PROFILES = {each[1]: each[0] for each in _PROFILE.finditer(_TEXT)}
"""What each node is allowed, as it stands in the file, by the node's name."""
HEAD, TAIL = _PROFILE.sub('\0', _TEXT).split('\0' * len(_PROFILES))
_NAMES = re.compile(r'(?: *<(topic|service|action)>.*</\1>\n)+')
"""Names of one permission, a line each."""
_NAME = re.compile(r'(?<=>)[^<\s]+(?=</)')


def policy(
    namespace: str = '', remaps: Mapping[str, str] | None = None, nodes: Sequence[str] = ()
) -> str:
    """
    Return the policy as `ros2 security create_permission` reads it, for some nodes or all.

    remaps: names as the nodes have them, with or without the namespace, to the names they get.
    """
    chosen = tuple(nodes) or tuple(_PROFILES)
    unknown = [name for name in chosen if name not in _PROFILES]
    if unknown:
        raise DataError(f'no node is called {unknown[0]!r}; there are {", ".join(_PROFILES)}')
    space = '/' + namespace.strip('/')
    wanted = {_full(name, space): _full(to, space) for name, to in (remaps or {}).items()}
    known = {_full(name, space) for each in chosen for name in _NAME.findall(_PROFILES[each])}
    for name in wanted:
        if name not in known:
            raise DataError(f'{name} is remapped, but none of the nodes has that name')

    def renamed(names: re.Match[str]) -> str:
        new = {wanted.get(_full(name, space), name) for name in _NAME.findall(names[0])}
        line = _NAME.sub('{}', names[0].splitlines(keepends=True)[0])
        return ''.join(line.format(name) for name in sorted(new))

    profiles = [
        _NAMES.sub(renamed, _PROFILES[name])
        .replace(f'path="{enclave(name)}"', f'path={quoteattr(enclave(name, space))}')
        .replace('ns="/"', f'ns={quoteattr(space)}')
        for name in chosen
    ]
    return HEAD + ''.join(profiles) + TAIL


def enclave(node: str, namespace: str = '') -> str:
    """Return the enclave of a node, as the launch files give it."""
    return f'/{namespace.strip("/") or "weld_twin"}/{node}'


def _full(name: str, space: str) -> str:
    return name if name.startswith(('/', '~')) else f'{space.rstrip("/")}/{name}'
