# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What each mechanism of the diagnosis is worth: the same cells with it taken out.

A mechanism is a function of one room. While it is out, something that does nothing stands in for
it. What no cell and no test misses may go for good; its switch then goes, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import Any, NamedTuple

from weld_twin_core.errors import DataError

from .trial import tried

ROOMS = 'weld_twin_core.diagnosis'


class Mechanism(NamedTuple):
    """The module that calls a mechanism, its name there, and what stands in for it."""

    module: str
    name: str
    stand_in: Callable[..., Any]


def first(given: Any, *_: Any) -> Any:
    """Return what is given, as it is."""
    return given


def second(_: Any, given: Any, *__: Any) -> Any:
    """Return the second of what is given."""
    return given


def third(_: Any, __: Any, given: Any, *___: Any) -> Any:
    """Return the third of what is given."""
    return given


def no(*_: Any) -> None:
    """Return nothing at all."""


def nothing(*_: Any) -> list[Any]:
    """Return an empty list."""
    return []


MECHANISMS = {
    'library_again': Mechanism('hypotheses.search', 'ROUNDS', lambda: 1),
    'many': Mechanism('pipeline', 'fitted_together', first),
    'many_bends': Mechanism('many.small_errors', '_bends', nothing),
    'many_lines': Mechanism('many.small_errors', 'with_lines', second),
    'many_setup': Mechanism('many.small_errors', 'with_setup', second),
    'many_frames': Mechanism('many.small_errors', '_apart_from_frames', third),
    'held_out_likes': Mechanism('unseen.held_out_shrink', '_exchanged', first),
    'formulas_scatter': Mechanism('levels.scatter', 'scatter', nothing),
    'whole_arm': Mechanism('unseen.groups', '_of_all', nothing),
    'none_against_curves': Mechanism('pipeline', 'no_noise', first),
    'open_frames': Mechanism('pipeline', '_held', first),
}
"""Every mechanism that can be taken out, by the name that the command takes."""


@contextmanager
def without(names: Sequence[str]) -> Iterator[None]:
    """
    Take mechanisms out for a while.

    names: of `MECHANISMS`.

    Raises DataError: there is no mechanism of a name.
    """
    unknown = [name for name in names if name not in MECHANISMS]
    if unknown:
        raise DataError(f'there is no mechanism {unknown[0]!r}; they are ' + ', '.join(MECHANISMS))
    before = []
    try:
        for name in names:
            own = MECHANISMS[name]
            module = import_module(f'{ROOMS}.{own.module}')
            usual = getattr(module, own.name)
            before.append((module, own.name, usual))
            setattr(module, own.name, own.stand_in if callable(usual) else own.stand_in())
        yield
    finally:
        for module, name, usual in reversed(before):
            setattr(module, name, usual)


def tried_without(seed: int, number: int, mix: str, names: Sequence[str]) -> dict[str, Any]:
    """
    Return the row of one case, as `tried` does, with some mechanisms taken out.

    seed, number, mix: as `tried` takes them.
    names: of `MECHANISMS`.
    """
    with without(names):
        return tried(seed, number, mix)
