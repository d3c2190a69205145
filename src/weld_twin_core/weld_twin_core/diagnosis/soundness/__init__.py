# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Before any cause: are data and set-up sound?

Each check is one function of a `Case` in one table (`checks`); it finds and names. What it finds
wrong with the set-up carries its own correction, and `gate` decides what comes of it.

A name loads its module when it is used first: a node that undoes what a diagnosis undid, by
`mending`, does not load the checks and the fits that they stand on.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # what tools see; at run time `__getattr__` finds the same by `_HOMES`
    from .checks import CHECKS as CHECKS
    from .gate import Examined as Examined
    from .gate import examine as examine
    from .mending import Given as Given
    from .repeats import refuse_reused as refuse_reused

__all__ = [
    'CHECKS',
    'Examined',
    'Given',
    'examine',
    'refuse_reused',
]

_HOMES = {
    'CHECKS': 'checks',
    'Examined': 'gate',
    'Given': 'mending',
    'examine': 'gate',
    'refuse_reused': 'repeats',
}
"""Modules of the public names."""


def __getattr__(name: str) -> Any:
    """Return a public name, loading its module first."""
    if name not in __all__:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    found = getattr(import_module(f'.{_HOMES[name]}', __name__), name)
    globals()[name] = found
    return found
