# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
YAML files of numbers: plain data only, small, without surprises.

Against PyYAML's defaults, ``1e-3`` is a number (YAML 1.2), a key given twice is refused instead
of the last one winning, and aliases are refused because a few lines of them can stand for
gigabytes.
"""

import math
import re
from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml

from weld_twin_core.errors import ModelError

try:
    from yaml import CSafeDumper as FastDumper  # ten times as fast, where libyaml is there
except ImportError:
    from yaml import SafeDumper as FastDumper  # type: ignore[assignment]

SIZE_LIMIT = 1_000_000
"""Bytes; robot and effects files are a few kilobytes."""

MACHINE = 2**63
"""Integers from here on do not fit 64 bits, and nothing of a robot is counted so far."""


class _Loader(yaml.SafeLoader):
    """The safe loader with the three changes named above."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.AliasEvent):
            mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]
            raise yaml.MarkedYAMLError(problem='aliases are not accepted', problem_mark=mark)
        return super().compose_node(parent, index)

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Hashable, Any]:
        seen = set()
        for key, _ in node.value:
            if not isinstance(key, yaml.ScalarNode):
                continue
            if key.value in seen:
                raise yaml.MarkedYAMLError(
                    problem=f'the key {key.value!r} is given twice', problem_mark=key.start_mark
                )
            seen.add(key.value)
        return super().construct_mapping(node, deep)


_Loader.add_implicit_resolver(
    'tag:yaml.org,2002:float',
    re.compile(r'^[-+]?[0-9]+(?:\.[0-9]*)?[eE][-+]?[0-9]+$'),
    list('-+0123456789'),
)


def whole(value: int) -> int | float:
    """Return a number of a file; one that no machine integer holds as a float, maybe infinite."""
    if abs(value) < MACHINE:
        return value
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def _construct_int(loader: Any, node: yaml.ScalarNode) -> int | float:
    return whole(yaml.SafeLoader.construct_yaml_int(loader, node))


_Loader.add_constructor('tag:yaml.org,2002:int', _construct_int)


def read_text(path: Path | str, kind: str) -> str:
    """Return the text of a small file."""
    try:
        with Path(path).open('rb') as file:
            data = file.read(SIZE_LIMIT + 1)
        if len(data) > SIZE_LIMIT:
            raise ModelError(f"{kind} '{path}' is larger than {SIZE_LIMIT / 1e6:g} MB")
        return data.decode('utf-8-sig')
    except UnicodeDecodeError:
        raise ModelError(f"{kind} '{path}' is not UTF-8 text") from None
    except OSError as error:
        raise ModelError(f"{kind} '{path}' cannot be read: {error.strerror or error}") from None


def read_yaml(path: Path | str, kind: str) -> Any:
    return parse_yaml(read_text(path, kind), f"{kind} '{path}'")


def parse_yaml(text: str, what: str) -> Any:
    """Return the data of YAML text; ``what`` names it in messages."""
    try:
        return yaml.load(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f' line {mark.line + 1}' if mark is not None else ''
        raise ModelError(f'{what}{where}: {error.problem or error.context}') from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        deep = isinstance(error, RecursionError)
        reason = 'nested too deeply' if deep else ' '.join(str(error).split())
        raise ModelError(f'{what}: {reason}') from None


WIDTH = 99
"""Columns of a line at the most, as in the rest of the project."""


class _Dumper(FastDumper):
    """Rows of numbers on one line, everything else as a block."""


def _is_row(value: Any) -> bool:
    items = value.values() if isinstance(value, dict) else value
    return all(not isinstance(item, list | dict) for item in items)


_Dumper.add_representer(
    list,
    lambda dumper, data: dumper.represent_sequence(
        'tag:yaml.org,2002:seq', data, flow_style=_is_row(data)
    ),
)
_Dumper.ignore_aliases = lambda self, data: True  # type: ignore[method-assign]


def yaml_text(data: Any) -> str:
    """Return the YAML text of plain data; floats round trip exactly."""
    return yaml.dump(
        data,
        Dumper=_Dumper,
        sort_keys=False,
        allow_unicode=True,
        width=WIDTH,
        default_flow_style=False,
    )
