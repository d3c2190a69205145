# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Seams from the mapping a path file holds: ``{'kind': 'line', 'start': [...], 'end': [...]}``.

The other keys are the attributes of the seam's class; a key ``weave`` with ``amplitude``,
``wavelength`` and ``form`` lays a weave over any kind. A key ``torch`` is left to the caller.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any

from ...arrays import refuse_unknown
from ...errors import DataError, PathError
from .arc import Arc, Circle
from .polyline import Line, Polyline
from .seam_path import Path
from .spline import Spline
from .weave import Weave

SEAMS: dict[str, type[Any]] = {
    'line': Line,
    'arc': Arc,
    'circle': Circle,
    'polyline': Polyline,
    'spline': Spline,
    'points': Spline,
}
"""The seams by their ``kind``."""


_BESIDE = ('kind', 'weave', 'torch', 'external')
"""Keys of a path file that are no arguments of its seam."""


def from_mapping(data: Mapping[str, Any]) -> Path:
    """
    Return the seam a mapping describes.

    Parameters
    ----------
    data : mapping
        ``kind`` and the arguments of that kind of seam, and ``weave`` where it weaves.

    Raises
    ------
    PathError
        The kind is unknown, or a key is missing, unknown or has a wrong value.

    """
    if not isinstance(data, Mapping):
        raise PathError(f'a path must be a mapping of keys, got {type(data).__name__}')
    kind = data.get('kind')
    if not isinstance(kind, str) or kind not in SEAMS:
        raise PathError(f"path 'kind' must be one of {', '.join(SEAMS)}, got {kind!r}")
    rest = {str(k): v for k, v in data.items() if k not in _BESIDE}
    seam: Path = _build(SEAMS[kind], rest, f'path of kind {kind!r}')
    weave = data.get('weave')
    if weave is None:
        return seam
    if not isinstance(weave, Mapping):
        raise PathError(f"'weave' must be a mapping of keys, got {type(weave).__name__}")
    woven: Path = _build(Weave, {'seam': seam, **weave}, "'weave'")
    return woven


def _build(cls: type[Any], values: dict[str, Any], what: str) -> Any:
    known = {field.name: field for field in fields(cls)}
    refuse_unknown(values, known, what, PathError)
    missing = [
        name
        for name, field in known.items()
        if field.default is MISSING and field.default_factory is MISSING and name not in values
    ]
    if missing:
        raise PathError(f'{what} needs the key {missing[0]!r}')
    try:
        return cls(**values)
    except (DataError, TypeError, ValueError, OverflowError) as error:
        raise PathError(f'{what}: {error}') from None
