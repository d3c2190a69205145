# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A name for the content of values: equal content, equal name, on every machine."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from weld_twin_core.errors import DataError


def digest(*values: Any) -> str:
    """Return 32 hexadecimal digits that stand for plain values, arrays, functions, dataclasses."""
    state = hashlib.sha256()
    for value in values:
        _feed(state, value)
    return state.hexdigest()[:32]


def _feed(state: Any, value: Any) -> None:
    if isinstance(value, np.ndarray | np.generic):
        array = np.ascontiguousarray(value)
        state.update(f'a{array.dtype.str}{array.shape}'.encode())
        state.update(array.tobytes())
    elif value is None or isinstance(value, bool | int | float | str | bytes):
        text = repr(value).encode()
        state.update(f'{type(value).__name__}{len(text)}:'.encode() + text)
    elif isinstance(value, type) or (callable(value) and not is_dataclass(value)):
        _feed(state, f'{value.__module__}.{value.__qualname__}')
    elif is_dataclass(value):
        _feed(state, type(value))
        for field in fields(value):
            _feed(state, field.name)
            _feed(state, getattr(value, field.name))
    elif isinstance(value, Mapping):
        state.update(f'm{len(value)}'.encode())
        for key in sorted(value, key=repr):
            _feed(state, key)
            _feed(state, value[key])
    elif isinstance(value, Sequence | frozenset | set):
        items = sorted(value, key=repr) if isinstance(value, frozenset | set) else value
        state.update(f's{len(value)}'.encode())
        for item in items:
            _feed(state, item)
    else:
        raise DataError(f'a {type(value).__name__} has no content to name a task by')
