# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Files that are almost right."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from copy import deepcopy
from random import Random
from typing import Any

import yaml

from weld_twin_msgs_py.files.yaml_file import yaml_text

NUMBERS = (
    b'nan',
    b'.nan',
    b'inf',
    b'-.inf',
    b'1e308',
    b'-1e308',
    b'1e-320',
    b'0',
    b'-0.0',
    b'-1',
    b'',
    b'1e999',
    b'9223372036854775808',
    b'1' * 400,
    b'0x10',
    b'1_000',
    b'12:30:45',
    b'1,5',
    b'~',
)
"""What may stand in the place of a number: none, endless, huge, and no number at all."""
VALUES: tuple[Any, ...] = (
    None,
    True,
    False,
    0,
    -1,
    1.5,
    1e308,
    -1e308,
    1e-320,
    float('nan'),
    float('inf'),
    10**30,
    '',
    'x',
    'nan',
    'x' * 3000,
    '\x00',
    '\U0001f600',
    [],
    {},
    [[]],
    [1, 2],
    [None] * 3,
    {'x': 1},
    {'': {}},
    [[1.0] * 4] * 4,
    ['a', 1, None],
)
SIZES = (0, 1, 0x7F, 0xFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 2**40, 2**62, 2**63 - 1, 2**64 - 1)
"""What may stand in the place of a length: ends of the ranges of integers."""
_NUMBER = re.compile(rb'-?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?')
_WORD = re.compile(rb'[A-Za-z_]{3,}')
_DEEP = 3000
"""Brackets put before; three times as deep as Python's own limit of calls."""

Change = Callable[[Random, bytes], bytes]


def mutate(rng: Random, seed: bytes, kind: str) -> bytes:
    """
    Return a seed with a few things wrong.

    kind: 'yaml' and 'json' are also changed as trees, 'binary' never as text.
    """
    if kind in ('yaml', 'json') and rng.random() < 0.5:
        return _tree(rng, seed, kind)
    changes = _BINARY if kind == 'binary' else _TEXT + _BINARY[:3]
    out = seed
    for _ in range(rng.choice((1, 1, 1, 2, 3, 6))):
        out = rng.choice(changes)(rng, out)
    return out


def _tree(rng: Random, seed: bytes, kind: str) -> bytes:
    data = yaml.safe_load(seed) if kind == 'yaml' else json.loads(seed)
    for _ in range(rng.choice((1, 1, 2, 3))):
        places = _places(data)
        if not places or rng.random() < 0.03:
            data = rng.choice(VALUES)
            continue
        holder, key = rng.choice(places)
        other, name = rng.choice(places)
        if rng.random() < 0.15:
            del holder[key]
        else:
            holder[key] = deepcopy(other[name] if rng.random() < 0.2 else rng.choice(VALUES))
    text = yaml_text(data) if kind == 'yaml' else json.dumps(data)
    return text.encode('utf-8', 'surrogatepass')


def _places(data: Any) -> list[tuple[Any, Any]]:
    if not isinstance(data, dict | list):
        return []
    items = data.items() if isinstance(data, dict) else enumerate(data)
    out = []
    for key, value in items:
        out.append((data, key))
        out += _places(value)
    return out


def _span(rng: Random, data: bytes) -> tuple[int, int]:
    start = rng.randrange(len(data) + 1)
    return start, min(len(data), start + rng.choice((1, 4, 16, 100, 1000)))


def _flip(rng: Random, data: bytes) -> bytes:
    if not data:
        return data
    out = bytearray(data)
    for _ in range(rng.choice((1, 1, 4, 32))):
        out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
    return bytes(out)


def _cut(rng: Random, data: bytes) -> bytes:
    start, end = _span(rng, data)
    return data[:start] + (b'' if rng.random() < 0.5 else data[end:])


def _repeat(rng: Random, data: bytes) -> bytes:
    start, end = _span(rng, data)
    return data[:end] + data[start:end] * rng.choice((1, 2, 50)) + data[end:]


def _size(rng: Random, data: bytes) -> bytes:
    width = rng.choice((2, 4, 8))
    start = rng.randrange(max(1, len(data) - width))
    value = rng.choice(SIZES) % (1 << 8 * width)
    field = value.to_bytes(width, rng.choice(('little', 'big')))
    return data[:start] + field + data[start + width :]


def _zero(rng: Random, data: bytes) -> bytes:
    start, end = _span(rng, data)
    return data[:start] + bytes(end - start) + data[end:]


def _replace(rng: Random, data: bytes, pattern: re.Pattern[bytes], by: bytes | None) -> bytes:
    matches = list(pattern.finditer(data))
    if not matches:
        return data
    place = rng.choice(matches)
    new = rng.choice(matches).group() if by is None else by
    return data[: place.start()] + new + data[place.end() :]


def _number(rng: Random, data: bytes) -> bytes:
    return _replace(rng, data, _NUMBER, rng.choice(NUMBERS))


def _word(rng: Random, data: bytes) -> bytes:
    return _replace(rng, data, _WORD, None)


def _line(rng: Random, data: bytes) -> bytes:
    lines = data.split(b'\n')
    k, m = rng.randrange(len(lines)), rng.randrange(len(lines))
    if rng.random() < 0.5:
        lines[k], lines[m] = lines[m], lines[k]
    else:
        lines[k:k] = [lines[m]] * rng.choice((1, 30))
    return b'\n'.join(lines)


def _deep(rng: Random, data: bytes) -> bytes:
    start = rng.randrange(len(data) + 1)
    opening = rng.choice((b'[', b'{', b'- ', b'"', b'<link>', b'!!'))
    return data[:start] + opening * _DEEP + data[start:]


_BINARY: tuple[Change, ...] = (_flip, _cut, _repeat, _size, _zero)
_TEXT: tuple[Change, ...] = (_number, _number, _number, _word, _word, _line, _deep)
