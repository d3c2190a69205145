# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Answers on cells with several causes, each cause and the whole held against the truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from weld_twin_core.diagnosis.calibration.features import WIDEST
from weld_twin_core.diagnosis.result import NAMING
from weld_twin_core.effects.registry import REGISTRY

from ..blind.ambiguous import Site
from .levels_of_truth import alike_by_structure

VISIBLE = 25.0
"""Rise of chi-square without a cause from which on it shows: five standard deviations."""
FEW = frozenset({'double', 'triple'})
"""Kinds of cases with two or three causes."""


class Whole(NamedTuple):
    """What an answer names, against what is at work."""

    asked: tuple[frozenset[Site], ...]
    """Every visible cause that the library holds, as all that is the same error on any motion."""
    named: tuple[bool, ...]
    """Whether each of these is told, alone or in a small set."""
    right: bool
    """All of these are named, nothing else is, and where a visible cause was taken out of the
    library, something is said to be left."""


def whole(truth: Mapping[str, Any], verdict: Mapping[str, Any]) -> Whole:
    """
    Return an answer held against its truth.

    truth: with what every cause shows.
    verdict: as diagnosis.json has it, of any schema.
    """
    at_work = [alike_by_structure(truth['robot'], (e, j)) for e, j in truth['sites']]
    out = [
        e in truth['excluded'] or not any(own in REGISTRY for own, _ in alike)
        for (e, _), alike in zip(truth['sites'], at_work, strict=True)
    ]
    seen = [chi >= VISIBLE for chi in truth['shown']]
    asked = tuple(
        own for own, gone, shows in zip(at_work, out, seen, strict=True) if shows and not gone
    )
    groups = [{(s['effect'], s['joint']) for s in g} for g in verdict['indistinguishable']]
    small = [group for group in groups if len(group) <= WIDEST]
    named = tuple(any(own & group for group in small) for own in asked)
    every = frozenset[Site]().union(*at_work)
    # A set that holds what was taken out tells it, by what no motion tells from it.
    foreign = any(
        gone and shows and not any(own & group for group in groups)
        for own, gone, shows in zip(at_work, out, seen, strict=True)
    )
    nothing = 'none' if not any(seen) else ''
    said = _left(verdict) if foreign else verdict['status'] in (*NAMING, nothing)
    return Whole(asked, named, all(named) and said and all(group & every for group in groups))


def _left(verdict: Mapping[str, Any]) -> bool:
    """Return whether something is said to be left without a name."""
    causes: Sequence[Mapping[str, Any]] = verdict['causes']
    return verdict['status'] == 'unknown' or any(cause.get('rest') for cause in causes)
