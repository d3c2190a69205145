# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What changed in a cell over time, and the words for it."""

from collections.abc import Mapping, Sequence
from datetime import datetime, timezone
from math import isfinite
from typing import Any, NamedTuple, TypedDict

import numpy as np

from weld_twin_core.arm.rotation import rotation_vector
from weld_twin_core.arrays import Array
from weld_twin_core.effects import REGISTRY
from weld_twin_core.history import ALL, Change, Observation, changes, outlook, reaches
from weld_twin_core.twin.directions import CURVE, GIVE
from weld_twin_nodes.wording.quantities import display_unit, millimetres, odds, uncertain
from weld_twin_nodes.wording.words import cause

from .entry import Entry

DAY = 86_400.0
"""Seconds."""


def observations(entries: Sequence[Entry]) -> list[Observation]:
    """Return entries, in the order of time, as observations, the tool counted from that of the first."""
    first = entries[0].tool if entries else np.eye(4)
    return [
        Observation(
            entry.at.timestamp() / DAY,
            entry.names,
            _moved(entry, first),
            entry.covariance,
            entry.prior_std,
            frozenset(name for name in entry.names if _steady(name)),
        )
        for entry in entries
    ]


def _steady(name: str) -> bool:
    """Return whether a coordinate is how a gear was made: a curve over its angle, waves, or its give."""
    effect = REGISTRY.get(name.split(' ')[0])
    made = effect is not None and (effect.traits.waves is not None or not effect.traits.cause)
    return made or name.startswith((CURVE, GIVE))


class Beforehand(TypedDict):
    """What is believed of coordinates before a change is looked for, as `changes` takes it."""

    named: set[str]
    likely: set[str]
    slow: set[str]


def beforehand(entries: Sequence[Entry]) -> Beforehand:
    result = ((each['effect'], each.get('joint')) for entry in entries for each in entry.effects)
    effects = REGISTRY.values()
    return {
        'named': {f'{effect} {joint} 0' if joint else f'{effect} 0' for effect, joint in result},
        'likely': _of(entries, {'tool', *(e.name for e in effects if e.traits.changes_in_use)}),
        'slow': _of(entries, {e.name for e in effects if e.traits.changes_slowly}),
    }


def _of(entries: Sequence[Entry], effects: set[str]) -> set[str]:
    """Return the coordinates of effects; those of the tool stand by axis."""
    names = {name for entry in entries for name in entry.names}
    return {name for name in names if name.replace('.', ' ').split(' ')[0] in effects}


def changed(entries: Sequence[Entry], seen: Sequence[Observation]) -> tuple[Change, ...]:
    """Return what changed on a cell, the surest first."""
    return changes(seen, **beforehand(entries))


def _moved(entry: Entry, first: Array) -> Array:
    """Return the values; of the tool, where it is from where the first one was."""
    shift = entry.tool[:3, 3] - first[:3, 3]
    turn = rotation_vector(first[:3, :3].T @ entry.tool[:3, :3])
    moved = dict(
        zip(
            ('tool.x', 'tool.y', 'tool.z', 'tool.turn_x', 'tool.turn_y', 'tool.turn_z'),
            (*shift, *turn),
            strict=True,
        )
    )
    more = np.array([moved.get(name, 0.0) for name in entry.names])
    return np.asarray(entry.value + more)


_TOOL = 'tool.'
WEEK = 7.0
"""Days."""
ALIKE = 3
"""Alternatives in a sentence; more are counted."""
HEADS = ('recorded', 'verdict', 'sure', 'gap', 'left', 'causes')


def row(entry: Entry, most: int | None = None) -> tuple[str, ...]:
    """Return a row of such a table, with so many causes at most."""
    return (
        str(entry.at.date()),
        entry.status,
        '' if entry.confidence is None else odds(entry.confidence),
        millimetres(entry.gap_m),
        millimetres(entry.unexplained_m),
        causes_of(entry.effects, most),
    )


def causes_of(effects: Sequence[Mapping[str, Any]], most: int | None = None) -> str:
    """Return what was named, the strongest first; of many only some are named, the rest counted."""
    names = [cause(str(each['effect']), each.get('joint')) for each in effects]
    shown = names[:most]
    more = f' and {len(names) - len(shown)} more' if len(names) > len(shown) else ''
    return ', '.join(shown) + more


_PARTS = {'xyz': 'along', 'rotvec': 'about'}
"""Of parameters that are vectors of a frame, what goes before the axis."""


class Coordinate(NamedTuple):
    """What a coordinate is, in words, and factor and unit in which people read it."""

    effect: str
    joint: str | None
    words: str
    factor: float
    unit: str
    part: str = ''
    """Which number of its effect it is, such as 'along x'."""


def coordinate(name: str) -> Coordinate:
    """Return what a coordinate is, such as 'tool.x' or 'joint_offset elbow_joint 0'."""
    effect, *joint, number = name.replace(_TOOL, 'tool_pose ').split(' ')
    if name.startswith(_TOOL):
        axis, turns = number[-1], number.startswith('turn')
        factor, unit = display_unit(number, 'rad' if turns else 'm')
        # A cell keeps no frames of its controller; the tool's own axes turn about themselves.
        part = f'about {axis}' if turns else f'along {axis}'
        words = f'turn of the tool {part}' if turns else f"tool {part} of the model's flange"
        return Coordinate('tool_pose', None, words, factor, unit, part)
    kind = REGISTRY.get(effect)
    parameters = [p for p in kind.parameters if p.differentiable] if kind else []
    factor, unit, part = 1.0, '', f'part {int(number) + 1}'
    if parameters:
        numbers = [p for p in parameters for _ in range(max(p.size, 1))]
        parameter = numbers[min(int(number), len(numbers) - 1)]
        factor, unit = display_unit(parameter.name, parameter.unit)
        if parameter.name in _PARTS:
            part = f'{_PARTS[parameter.name]} {"xyz"[int(number) % 3]}'
        elif len(parameters) == 1 and number == '0':
            part = ''
    where, _, source = ' '.join(joint).partition('<')
    words = whole(name) + (f', {part}' if part else '') + (f' from {source}' if source else '')
    return Coordinate(effect, where or None, words, factor, unit, part)


def whole(name: str) -> str:
    """Return what a coordinate is a number of: its effect at its joint, or the tool."""
    if name.startswith((_TOOL, 'tool ')):
        return "tool against the model's flange"
    effect, *joint, _ = name.split(' ')
    return cause(effect, ' '.join(joint).partition('<')[0] or None)


def date(day: float) -> str:
    return datetime.fromtimestamp(day * DAY, timezone.utc).date().isoformat()


def sentence(change: Change) -> str:
    """Return what changed, when, and by how much."""
    what = coordinate(change.name)
    first, last = (date(day) for day in change.between)
    when = f'between {first} and {last}' if first != last else f'on {last}'
    size = _sizes(change, WEEK if change.kind == 'trend' else 1.0)
    name = whole(change.name) if change.together else what.words
    if change.kind == 'step':
        said = f'{name}: stepped by {size} {when}'
        if change.since is not None:
            slowly = f'slowly since {date(change.since)}'
            said = f'{name}: changed by {size}, at once {when} or {slowly}'
    elif change.kind == 'trend':
        more = ' on top of how it moved before' if change.faster else ''
        said = f'{name}: moves by {size} a week since {date(change.day)}{more}'
    else:
        said = f'{name}: swings by {size} with the seasons'
    others = [whole(n) if n.endswith(ALL) else coordinate(n).words for n in change.alike]
    if others:
        more = f' or {len(others) - ALIKE} more' if len(others) > ALIKE else ''
        said += f'; as well it may be {", ".join(others[:ALIKE])}{more}'
    return f'{said}.'


def _sizes(change: Change, times: float) -> str:
    """Return how far it moved; of an effect of several, each number beyond its own error."""
    sizes = []
    for each in change.together or (change,):
        what = coordinate(each.name)
        part = f' {what.part}' if change.together else ''
        if abs(each.size) > each.std or each.name == change.name:
            size = uncertain(each.size * times, each.std * times, what.factor, what.unit)
            sizes.append(size + part)
    return ', '.join(sizes)


def forecast(
    change: Change,
    seen: Sequence[Observation],
    result: Sequence[Change],
    limits: Mapping[str, float],
) -> dict[str, Any] | None:
    """
    Return when a trend reaches its limit; None where there is no trend or no limit.

    ``limits``: the largest values allowed of effects, in SI units.
    """
    what = coordinate(change.name)
    if change.kind != 'trend' or what.effect not in limits:
        return None
    now = outlook(seen, result, change.name)
    if now is None:
        return None
    days = reaches(limits[what.effect], now)
    weeks = [each / WEEK if isfinite(each) else None for each in days]
    return {
        'limit': limits[what.effect],
        'weeks_5': weeks[0],
        'weeks': weeks[1],
        'weeks_95': weeks[2],
    }


def forecast_sentence(change: Change, outlook: Mapping[str, Any]) -> str:
    """Return when the limit is reached, in words."""
    what = coordinate(change.name)
    limit = f'{outlook["limit"] * what.factor:g} {what.unit}'.rstrip()
    low, high = outlook['weeks_5'], outlook['weeks_95']
    if low is None:
        return f'{what.words} does not come near {limit}.'
    if high == 0.0:
        return f'{what.words} is beyond {limit} already.'
    end = f'to {high:.0f} weeks' if high is not None else 'weeks or more'
    return f'{what.words} reaches {limit} in {low:.0f} {end} (90 %).'


def as_dict(change: Change) -> dict[str, Any]:
    """Return a change as plain data; a trend's size is that of a day."""
    what = coordinate(change.name)
    return {
        'effect': what.effect,
        'joint': what.joint,
        'coordinate': change.name,
        'kind': change.kind,
        'date': date(change.day),
        'between': [date(day) for day in change.between],
        'slowly_since': None if change.since is None else date(change.since),
        'size': change.size,
        'std': change.std,
        'nats': change.log_bayes,
        'alike': list(change.alike),
        'together': [each._asdict() for each in change.together],
        'sentence': sentence(change),
    }


def moved(change: Mapping[str, Any]) -> list[str]:
    """Return the coordinates that a change, as plain data, tells of, the surest first."""
    several = [each for each in change.get('together') or () if abs(each['size']) > each['std']]
    ranked = sorted(several, key=lambda each: -abs(each['size']) / each['std'])
    return [str(each['name']) for each in ranked] or [str(change['coordinate'])]


def since(result: Sequence[Change], day: float | None) -> list[Change]:
    """Return the changes that may have come after a day, and those that go on: trends, seasons."""
    if day is None:
        return list(result)
    return [each for each in result if each.kind != 'step' or each.between[1] > day]
