# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The sim-to-real gap: where it lies, which effect causes it, how far it shrinks.

A name loads its module when it is used first: a node that reads what a diagnosis found, and makes
none, does not load everything that finds one.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # what tools see; at run time `__getattr__` finds the same by `_HOMES`
    from .beliefs import Beliefs as Beliefs
    from .pipeline import diagnose as diagnose
    from .result import Candidate as Candidate
    from .result import Check as Check
    from .result import Diagnosis as Diagnosis
    from .result import Found as Found
    from .result import Gap as Gap
    from .result import Shrink as Shrink
    from .result import Site as Site
    from .result import Traces as Traces
    from .result import Unexplained as Unexplained
    from .result import Unsound as Unsound
    from .result import Where as Where

__all__ = [
    'Beliefs',
    'Candidate',
    'Check',
    'Diagnosis',
    'Found',
    'Gap',
    'Shrink',
    'Site',
    'Traces',
    'Unexplained',
    'Unsound',
    'Where',
    'diagnose',
]

_HOMES = {'Beliefs': 'beliefs', 'diagnose': 'pipeline'}
"""Modules of names that are not of `result`."""


def __getattr__(name: str) -> Any:
    """Return a public name, loading its module first."""
    if name not in __all__:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    result = getattr(import_module(f'.{_HOMES.get(name, "result")}', __name__), name)
    globals()[name] = result
    return result
