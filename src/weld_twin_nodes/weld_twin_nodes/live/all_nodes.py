# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The nodes there are, by name, and what each takes."""

from collections.abc import Iterable
from difflib import get_close_matches
from importlib import import_module
from inspect import getdoc
from typing import Any

from weld_twin_core.errors import DataError

from .settings import PREFIX, Setting

MODULES = {
    'trajectory_generator': 'weld_twin_nodes.live.trajectory_generator',
    'error_injector': 'weld_twin_nodes.live.error_injector',
    'forward_kinematics_twin': 'weld_twin_nodes.live.forward_kinematics_twin',
    'deviation_analyzer': 'weld_twin_nodes.live.deviation_analyzer',
    'recorder': 'weld_twin_nodes.live.recorder',
    'live_diagnosis': 'weld_twin_nodes.live.live_diagnosis',
    'deviation_markers': 'weld_twin_nodes.live.deviation_markers',
    'contact_marker': 'weld_twin_nodes.live.contact_marker',
    'compensator': 'weld_twin_nodes.live.compensator',
}
ROS_OWN = ('use_sim_time', 'start_type_description_service')
"""Parameters that every node of ROS 2 takes; so are those of `QosOverrides`."""


def node_class(name: str) -> Any:
    """Return the class of a node by its name, which is that of its file."""
    module = import_module(MODULES[name])
    return next(
        item
        for item in vars(module).values()
        if isinstance(item, type)
        and item.__module__ == module.__name__
        and hasattr(item, 'every_setting')
    )


def refuse_unknown(given: Iterable[str], own: Iterable[str]) -> None:
    """Refuse parameters that no node of this package has: a mistyped one would be passed over."""
    known = {*own, *ROS_OWN}
    odd = [name for name in given if name not in known and not name.startswith(PREFIX)]
    if not odd:
        return
    others = {item.name for name in MODULES for item in node_class(name).every_setting()}
    for name in odd:
        if name in others:
            continue
        like = get_close_matches(name, known, n=1)
        hint = (
            f"; did you mean '{like[0]}'?" if like else f'; there are {", ".join(sorted(known))}'
        )
        raise DataError(f"no parameter is called '{name}'{hint}")


def usage(kind: Any, name: str) -> str:
    """Return what a node does and its parameters, as ``--help`` prints them."""
    lines = [
        f'usage: {name} [--help] [--ros-args -p PARAMETER:=VALUE ... -r FROM:=TO ...]',
        '',
        getdoc(kind) or '',
        '',
        'parameters:',
    ]
    for item in kind.every_setting():
        limits = f', {range_of(item)}' if range_of(item) else ''
        lines.append(f'  {item.name} ({value_of(item)}{limits})')
        lines.append(f'      {item.description}')
    return '\n'.join(lines)


def value_of(item: Setting) -> str:
    """Return the default of a parameter in words."""
    if isinstance(item.default, bool):
        return str(item.default).lower()
    if isinstance(item.default, list):
        return '[' + ', '.join(str(value) for value in item.default) + ']'
    if item.numbers:
        return 'not set'
    return repr(item.default) if isinstance(item.default, str) else f'{item.default:g}'


def range_of(item: Setting) -> str:
    """Return the range of a parameter in words, empty where it has none."""
    if item.low is None or item.high is None:
        return ''
    return f'{item.low:g} to {item.high:g}'
