# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Where a cause of the plant really sits, what it depends on, and what else may rightly be said.

Causes in the library have their place and dependence from there. Constant errors that the
kinematics of the arm makes one and the same error may be told at any of their places.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

from weld_twin_core.arm import catalog
from weld_twin_core.arm.robot import Robot
from weld_twin_core.diagnosis.algebra.motions import same_error
from weld_twin_core.diagnosis.calibration.features import WIDEST
from weld_twin_core.diagnosis.result import NAMING
from weld_twin_core.effects.effect import Effect
from weld_twin_core.effects.registry import REGISTRY

from ..blind.cause_sizes import Site

HERE = 'its joint'
OUTSIDE_LEVELS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    'bearing_tilt': ((HERE,), ('angle',)),
    'station_step': (('instrument', 'base'), ('time',)),
    'tool_slip': (('tool',), ('time',)),
    'quadratic_scale': (('instrument',), ('place',)),
    'column_bend': (('base',), ('time', 'temperature')),
    'stick_slip': ((HERE,), ('direction', 'speed')),
    'friction_wander': ((HERE,), ('direction', 'time')),
    'loaded_play': ((HERE,), ('load', 'direction')),
    'dress_pack': ((HERE,), ('angle',)),
}
"""Places and dependences of the causes outside the library; the first is the one meant."""
ALSO: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    'drift': (('base', 'instrument'), ('time',)),
    'payload': (('load', 'tool'), ('load',)),
    'clock_rate': (('clock',), ('time', 'speed')),
    'gear_ratio_by_direction': ((HERE,), ('direction', 'angle')),
    'hose_pull': (('load', 'tool'), ('load',)),
}
"""The same for causes in the library whose place has more than one right word."""
LAGGING = 'equal lag'
"""Construction in which every joint lags alike: the clock is late, to whoever measures."""


class Levels(NamedTuple):
    """Right words for the place and for the dependence of one cause."""

    places: frozenset[str]
    dependences: frozenset[str]


def levels_of(truth: Mapping[str, Any]) -> list[Levels]:
    """Return the right words for every cause of a truth of `making.truth_of`, or those kept with it."""
    if 'levels' in truth:
        return [Levels(frozenset(at), frozenset(on)) for at, on in truth['levels']]
    out = [_levels(str(effect), joint, str(truth['robot'])) for effect, joint in truth['sites']]
    if truth['construction'] == LAGGING:
        out = [Levels(own.places | {'clock'}, own.dependences) for own in out]
    return out


def alike_by_structure(robot: str, site: Site) -> frozenset[Site]:
    """Return the constant errors that are always the same error as one, itself included."""
    return frozenset(_alike(robot, site))


def numbers(site: Site) -> int:
    """Return how many numbers a family of the library has."""
    kind = REGISTRY.get(site[0])
    return sum(max(p.size, 1) for p in kind.parameters) if kind is not None else 0


@lru_cache(maxsize=1024)
def _alike(name: str, site: Site) -> tuple[Site, ...]:
    effect, joint = site
    kind = REGISTRY.get(effect)
    if kind is None or not _constant(kind):
        return (site,)
    robot = catalog.load(name)
    own = _built(kind, joint)
    others = [other for other in _constants(robot) if same_error(robot, own, other)]
    return tuple({site, *((other.name, other.site) for other in others)})


@lru_cache(maxsize=1024)
def _levels(effect: str, joint: str | None, robot: str) -> Levels:
    if effect in OUTSIDE_LEVELS or effect in ALSO:
        words, dependences = {**OUTSIDE_LEVELS, **ALSO}[effect]
        own = {str(joint) if word == HERE else word for word in words}
        return Levels(frozenset(own), frozenset(dependences))
    kind = REGISTRY[effect]
    places = {_built(REGISTRY[e], j).at for e, j in _alike(robot, (effect, joint))}
    return Levels(frozenset(places), frozenset({kind.traits.depends_on}))


def _constant(kind: type[Effect]) -> bool:
    return kind.traits.cause and kind.traits.depends_on == 'constant'


def _constants(robot: Robot) -> Iterator[Effect]:
    for kind in REGISTRY.values():
        if _constant(kind):
            joints: Sequence[str | None] = (
                robot.joint_names if kind.of in ('joint', 'link') else (None,)
            )
            yield from (_built(kind, joint) for joint in joints)


def _built(kind: type[Effect], joint: str | None) -> Any:
    return kind(**({'joint': joint} if kind.of in ('joint', 'link') else {}))


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
    """Return an answer of any schema held against its truth, which has what every cause shows."""
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
    causes: Sequence[Mapping[str, Any]] = verdict['causes']
    return verdict['status'] == 'unknown' or any(cause.get('rest') for cause in causes)
