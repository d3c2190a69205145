# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which column is what, from the names in the header."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from weld_twin_core.arm.robot import Robot
from weld_twin_core.errors import DataError

from .words import (
    ANGLES,
    CLOCK,
    DATE,
    DIFFERENCE,
    EFFORT,
    EXTERNAL,
    FANUC,
    JOINT,
    KUKA,
    LETTERS,
    MEASURED,
    NAMES_A_JOINT,
    NEUTRAL,
    QUATERNION,
    SIGMA,
    TARGET,
    TEMPERATURE,
    TURNS,
    TableOptions,
    flag_of,
    parted,
    shortened,
    tokens,
)

_ANGLES = (('angle', 'xyz'), ('rpy', 'xyz'), ('abc', 'xyz'), ('wpr', 'xyz'))
"""Kinds of three angles, and the axes that make them whole."""


@dataclass(frozen=True)
class Named:
    """A header cell taken apart: what is left of the name, axis, kind of number, unit."""

    name: str
    stem: tuple[str, ...]
    axis: str = ''
    kind: str = ''
    unit: str | None = None


CONTACTS = {'contact', 'contacts', 'label', 'kontakt', 'beruehrung', 'berührung', 'punkt'}
"""Names of a column that says what was touched."""


@dataclass
class Columns:
    """The columns by use; an empty tuple is a use nothing serves. ``units`` go by column."""

    joints: tuple[str, ...] = ()
    position: tuple[str, ...] = ()
    target: tuple[str, ...] = ()
    difference: tuple[str, ...] = ()
    rotation: tuple[str, ...] = ()
    effort: tuple[str, ...] = ()
    sigma: tuple[str, ...] = ()
    temperature: str | None = None
    time: str | None = None
    date: str | None = None
    units: dict[str, str | None] = field(default_factory=dict)

    def unit(self, name: str | None) -> str | None:
        """Return the unit the header gives a column, None when it gives none."""
        return None if name is None else self.units.get(name)

    def unused(self) -> list[str]:
        """Return the columns that serve nothing."""
        used = {self.temperature, self.time, self.date}.union(
            *(self.joints, self.position, self.target, self.difference),
            *(self.rotation, self.effort, self.sigma),
        )
        return [name for name in self.units if name not in used]


def find_columns(header: Sequence[str], robot: Robot, options: TableOptions) -> Columns:
    """Return the columns by use."""
    parts = [_taken_apart(name) for name in header]
    out = Columns(units={part.name: part.unit for part in parts})
    out.joints = options.joint_columns or _joints(parts, robot)
    if len(out.joints) != robot.n:
        raise DataError(
            f'robot {robot.name!r} has {robot.n} joints, but {len(out.joints)} joint columns are '
            'named in --joint-columns'
        )
    remaining = [part for part in parts if part.name not in out.joints]
    out.effort = _efforts(remaining, robot)
    remaining = [part for part in remaining if part.name not in out.effort]
    names = [part.name for part in remaining]
    out.temperature = options.temperature_column or _first(names, TEMPERATURE)
    given = options.time_column
    out.date, out.time = (None, given) if given else time_columns(names)
    measured = MEASURED | set(tokens(options.marker or ''))
    _positions(remaining, options, out, measured)
    if not options.positions_only:
        out.rotation = options.rotation_columns or _rotation(remaining, measured)
    out.sigma = options.sigma_columns or _one_group(
        remaining, 'length', SIGMA, 'sigma_columns', False
    )
    return out


def joint_columns(header: Sequence[str], robot: Robot, options: TableOptions) -> tuple[str, ...]:
    """Return the joint columns alone, in the robot's order."""
    return options.joint_columns or _joints([_taken_apart(name) for name in header], robot)


def _taken_apart(name: str) -> Named:
    words, unit = parted(name)
    for k, word in enumerate(words):
        kind, axis = _axis(word, words)
        if kind:
            said = {'quaternion': QUATERNION, 'angle': TURNS}.get(kind, set())
            stem = [w for w in words[:k] + words[k + 1 :] if w not in said]
            stem += ['d'] if re.fullmatch(r'd[xyz]', word) else []
            return Named(name, tuple(stem), axis, kind, unit)
    return Named(name, tuple(words), unit=unit)


def _axis(word: str, words: Sequence[str]) -> tuple[str, str]:
    """Return what kind of number a word makes of a column, and about which axis."""
    others = set(words) - {word}
    if word in ('x', 'y', 'z', 'w') and others & QUATERNION and not others & {'j', 'joint'}:
        return 'quaternion', word
    if word in ('x', 'y', 'z'):
        return ('angle' if others & TURNS else 'length'), word
    if re.fullmatch(r'd[xyz]', word):  # a list of what is off, as instruments write it
        return 'length', word[1]
    if re.fullmatch(r'q[xyzw]', word):
        return 'quaternion', word[1]
    if re.fullmatch(r'r[xyz]', word):
        return 'angle', word[1]
    if word in ANGLES:
        return 'rpy', ANGLES[word]
    if not others - MEASURED - NEUTRAL:
        for kind, letters in (('abc', KUKA), ('wpr', FANUC)):
            if word in letters:
                return kind, letters[word]
    return '', ''


def _joints(parts: Sequence[Named], robot: Robot) -> tuple[str, ...]:
    """Return columns with the joints' own names; others are numbered, slides perhaps as E1."""
    own = _by_own_names(parts, robot)
    missing = [joint for joint in robot.joint_names if joint not in own]
    remaining = [part for part in parts if part.name not in own.values()]
    slides = [joint for joint in missing if robot.prismatic[robot.index(joint)]]
    beside = _beside_the_arm(remaining)
    if slides and len(beside) == len(slides):
        own |= dict(zip(slides, beside, strict=True))
        missing = [joint for joint in missing if joint not in own]
        remaining = [part for part in remaining if part.name not in beside]
    if missing:
        own |= dict(zip(missing, _in_order(remaining, len(missing), parts, robot), strict=True))
    return tuple(own[joint] for joint in robot.joint_names)


def _by_own_names(parts: Sequence[Named], robot: Robot) -> dict[str, str]:
    """Return the columns called as joints are, with a unit behind or none, by joint."""
    called = {'_'.join(parted(part.name)[0]): part.name for part in reversed(parts)}
    called |= {'_'.join(tokens(part.name)): part.name for part in reversed(parts)}
    names = {joint: called.get('_'.join(tokens(joint))) for joint in robot.joint_names}
    result = {joint: name for joint, name in names.items() if name is not None}
    # The x that was measured is no joint because a slide of a gantry is called so, too.
    others = [part for part in parts if part.name not in result.values()]
    axes = {part.axis for part in others if part.kind == 'length'}
    return {
        joint: name for joint, name in result.items() if tokens(joint)[-1] not in {*'xyz'} - axes
    }


def _beside_the_arm(parts: Sequence[Named]) -> list[str]:
    """Return the columns of axes beside the arm in their order, such as E1 and eax_b."""
    result = {}
    for part in parts:
        words = [word for word in part.stem or (part.axis,) if word]
        pieces = _pieces(words)
        if len(pieces) == 2 and pieces[0] in EXTERNAL and re.fullmatch('[a-f1-6]', pieces[1]):
            result[pieces[1]] = part.name
    return [result[key] for key in sorted(result)]


def _in_order(
    remaining: Sequence[Named], count: int, parts: Sequence[Named], robot: Robot
) -> tuple[str, ...]:
    """Return so many columns that are numbered, or lettered as Yaskawa does it."""
    letters = {tokens(p.name)[0]: p.name for p in remaining if tokens(p.name)[:1]}
    if count == len(LETTERS) and set(LETTERS) <= set(letters):
        return tuple(letters[letter] for letter in LETTERS)
    numbered = _numbered(remaining)
    whole = [list(range(count)), list(range(1, count + 1))]
    fitting = {words: group for words, group in numbered.items() if sorted(group) in whole}
    # What the encoders read comes before what the controller wanted.
    best = max((_rank(words) for words in fitting), default=0)
    chosen = [group for words, group in fitting.items() if _rank(words) == best]
    if len(chosen) != 1:
        result = 'more than one set of' if chosen else 'no'
        raise DataError(
            f'the table has {result} columns for the {robot.n} joints of robot {robot.name!r} '
            f'({", ".join(robot.joint_names)}){_listing(parts, _numbered(parts))}; '
            '--joint-columns decides'
        )
    return tuple(chosen[0][k] for k in sorted(chosen[0]))


def _efforts(parts: Sequence[Named], robot: Robot) -> tuple[str, ...]:
    """Return the columns of efforts, called as joints or numbered; nothing where one is missing."""
    named: dict[str, str] = {}
    numbered: dict[int, str] = {}
    for part in parts:
        pieces = _pieces(parted(part.name)[0])
        if not set(pieces) & EFFORT:
            continue
        rest = [piece for piece in pieces if piece not in EFFORT]
        named.setdefault('_'.join(rest), part.name)
        numbers = [int(piece) for piece in rest if piece.isdecimal()]
        if len(numbers) == 1 and set(rest) - {str(numbers[0])} <= JOINT | MEASURED:
            numbered.setdefault(numbers[0], part.name)
    keys = ['_'.join(re.findall(r'[^0-9_]+|[0-9]+', joint.lower())) for joint in robot.joint_names]
    if all(key in named for key in keys):
        return tuple(named[key] for key in keys)
    first = 0 if 0 in numbered else 1
    wanted = range(first, first + robot.n)
    return tuple(numbered[k] for k in wanted) if sorted(numbered) == list(wanted) else ()


def _pieces(words: Iterable[str]) -> list[str]:
    """Return words and the numbers in them apart, as j and 1 of j1."""
    return [piece for word in words for piece in re.findall(r'[^0-9]+|[0-9]+', word)]


def _rank(words: tuple[str, ...]) -> int:
    return 2 if set(words) & MEASURED else 0 if set(words) & TARGET else 1


def _numbered(parts: Sequence[Named]) -> dict[tuple[str, ...], dict[int, str]]:
    """Return the columns that are called a joint and a number, by words and number."""
    out: dict[tuple[str, ...], dict[int, str]] = {}
    for part in parts:
        if part.axis:
            continue
        pieces = _pieces(part.stem)
        numbers = [int(piece) for piece in pieces if piece.isdecimal()]
        words = tuple(piece for piece in pieces if not piece.isdecimal())
        known = JOINT | MEASURED | TARGET
        if len(numbers) == 1 and set(words) & NAMES_A_JOINT and set(words) <= known:
            out.setdefault(words, {}).setdefault(numbers[0], part.name)
    return out


def _listing(parts: Sequence[Named], numbered: Mapping[tuple[str, ...], Mapping[int, str]]) -> str:
    """Return what the header has: the joints that were understood, then the other names."""
    joints = [name for group in numbered.values() for _, name in sorted(group.items())]
    others = [part.name for part in parts if part.name not in joints]
    columns = [('joints', joints), ('besides', others)] if joints else [('columns', others)]
    said = ', '.join(f'{word} {shortened(names)}' for word, names in columns if names)
    return f'; found {said}' if said else ''


def _positions(
    parts: Sequence[Named], options: TableOptions, out: Columns, measured: set[str]
) -> None:
    out.position = options.position_columns or ()
    out.target = options.target_columns or ()
    out.difference = options.difference_columns or ()
    if not out.position and not (out.target and out.difference):
        out.position = _one_group(parts, 'length', measured, 'position_columns', True)
    if out.position:
        return
    target = out.target or _one_group(parts, 'length', TARGET, 'target_columns', False)
    difference = out.difference or _one_group(
        parts, 'length', DIFFERENCE, 'difference_columns', False
    )
    if not target or not difference:
        touched = next((p.name for p in parts if p.name.strip().lower() in CONTACTS), None)
        if touched is not None:
            raise DataError(
                f'the table has no measured positions but the column {touched!r}; say what was '
                'touched with --contacts ARTEFACT.yaml'
            )
        raise DataError(
            'the table has no columns with measured positions, nor target and difference; '
            f'--position-columns, or --target-columns and --difference-columns, decide{_lacking(parts)}'
        )
    out.target, out.difference = target, difference


def _lacking(parts: Sequence[Named]) -> str:
    """Return which axes of a position are there, which are missing, and what else there is."""
    there = {part.axis: part.name for part in parts if part.kind == 'length'}
    axes: dict[tuple[str, ...], str] = {}
    for part in parts:
        if part.kind == 'length' and not set(part.stem) & (TARGET | DIFFERENCE | SIGMA):
            axes[part.stem] = axes.get(part.stem, '') + part.axis
    tracked = [' '.join(stem) for stem, found in axes.items() if stem and set(found) == {*'xyz'}]
    if tracked:
        return f'; x, y and z are there of {", ".join(tracked)}: --marker takes one of them'
    missing = [axis for axis in 'xyz' if axis not in there]
    others = [part.name for part in parts if part.name not in there.values()]
    said = [f'found {", ".join(there.values())}'] if there else []
    said += [f'missing {", ".join(missing)}'] if missing else []
    said += [f'besides the joints there are {shortened(others)}'] if others else []
    return f' ({"; ".join(said)})' if said else ''


def _rotation(parts: Sequence[Named], measured: set[str]) -> tuple[str, ...]:
    """Return the measured quaternion or angles, nothing when the table has none."""
    for kind, axes in (('quaternion', 'xyzw'), *_ANGLES):
        result = _one_group(parts, kind, measured, 'rotation_columns', True, axes)
        if result:
            return result
    return ()


def _one_group(
    parts: Sequence[Named], kind: str, words: set[str], option: str, bare: bool, axes: str = 'xyz'
) -> tuple[str, ...]:
    """
    Return the one complete group of a kind whose stem says so, or, with ``bare``, that has none.

    Spread words (sigma, difference) never count as measured.
    """
    groups: dict[tuple[str, ...], dict[str, str]] = {}
    twice: dict[tuple[str, ...], list[str]] = {}
    for part in parts:
        if part.kind == kind:
            first = groups.setdefault(part.stem, {}).setdefault(part.axis, part.name)
            if first != part.name:
                twice.setdefault(part.stem, [first]).append(part.name)
    whole = {stem: group for stem, group in groups.items() if set(axes) <= set(group)}
    spread = SIGMA | DIFFERENCE
    named = [stem for stem in whole if set(stem) & words and not (set(stem) - words) & spread]
    if not named and bare:
        plain = [stem for stem in whole if not set(stem) - NEUTRAL]
        named = [()] if () in whole else plain
    if len(named) > 1:
        listed = '; '.join(', '.join(whole[stem][axis] for axis in axes) for stem in named)
        raise DataError(f'several columns could serve ({listed}); {flag_of(option)} decides')
    for stem in named:
        if stem in twice:
            raise DataError(
                f'{" and ".join(twice[stem][:2])} mean the same; {flag_of(option)} decides'
            )
    return tuple(whole[named[0]][axis] for axis in axes) if named else ()


def time_columns(header: Sequence[str]) -> tuple[str | None, str | None]:
    """Return the columns of the date, where it has one of its own, and of the time."""
    date = _first(header, DATE)
    clock = _first([name for name in header if name != date], CLOCK)
    return (date, clock) if date and clock else (None, clock or date)


def unit_of(name: str) -> str | None:
    """Return the unit that a header cell names, None for none."""
    return _taken_apart(name).unit


def _first(header: Sequence[str], pattern: re.Pattern[str]) -> str | None:
    return next((name for name in header if pattern.search(name.lower())), None)
