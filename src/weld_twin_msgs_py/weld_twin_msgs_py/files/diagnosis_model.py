# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The model of a diagnosis file: fitted frames, effects given, effects found."""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.arm.known_arms import fingerprint
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array, readonly
from weld_twin_core.diagnosis.algebra.problem import Alone, Change, Model
from weld_twin_core.diagnosis.soundness.mending import Given, replayed
from weld_twin_core.effects import effects_from_list
from weld_twin_core.effects.dated import in_use, of_the_robot
from weld_twin_core.effects.registry import REGISTRY
from weld_twin_core.errors import DataError, ModelError
from weld_twin_core.recording import Counted, Recording
from weld_twin_core.twin.twin import Twin

from .yaml_file import whole

SCHEMAS = tuple(f'weld_twin/diagnosis/{version}' for version in (1, 2))
"""Versions that are read."""
_SITE = {'effect!': str, 'joint': str}
SHAPE: dict[str, Any] = {
    'gap': {'rms_m': float, 'noise_floor_m': float},
    'verdict': {
        'status': str,
        'effects': [{**_SITE, 'parameters!': dict, 'std': dict}],
        'confidence': float,
        'sure': bool,
        'indistinguishable': [[_SITE]],
        'same_on_any_motion': [[_SITE]],
        'causes': [{'effect': int}],
    },
    'shrink': {'rms_before_m': float, 'rms_after_m': float},
    'unexplained': {'rms_m': float},
    'unsound': [{'sentence': str, 'remedy': str, 'applied': bool, 'mend': dict}],
    'model': {
        'robot': str,
        'kinematics': str,
        'epochs_ns': [int],
        'spans_ns': [[int]],
        'known': [{'effect!': str}],
        'found': [{'effect!': str}],
        'alone': dict,
        'counted': dict,
    },
    'changed': [{**_SITE, 'recording!': int}],
    'posterior': dict,
    'inputs': [{'use!': str, 'path!': str, 'sha256!': str}],
}
"""
Types of what is read of a diagnosis, whoever reads it: a list has any number of what it holds, a
mapping has its keys with a mark; all other keys may be missing, or null.
"""
_CALLED = {float: 'a number', int: 'a whole number', str: 'a text', bool: 'true or false'}
SIZE_LIMIT = 64_000_000
"""Bytes; a diagnosis of thousands of stations is some hundred kilobytes."""


def read_diagnosis(path: Path | str) -> dict[str, Any]:
    """Return the content of a diagnosis file."""
    try:
        with Path(path).open('rb') as file:
            raw = file.read(SIZE_LIMIT + 1)
        if len(raw) > SIZE_LIMIT:
            raise ModelError(f"'{path}' is larger than any diagnosis")
        data = json.loads(raw, parse_int=lambda text: whole(int(text)))
    except IsADirectoryError:
        raise ModelError(f"'{path}' is a folder; give the diagnosis.json in it") from None
    except OSError as error:
        raise ModelError(f"diagnosis '{path}' cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise ModelError(f"diagnosis '{path}' is not JSON: {error}") from None
    schema = data.get('schema') if isinstance(data, dict) else None
    if not isinstance(data, dict) or schema not in SCHEMAS:
        raise ModelError(
            f"'{path}' is no diagnosis of this version: its schema is {schema!r}, known are "
            f'{" and ".join(SCHEMAS)}; give the diagnosis.json that weld-twin diagnose wrote'
        )
    if wrong := _misshapen(data, SHAPE):
        raise ModelError(
            f"diagnosis '{path}' was changed: {wrong}; take the file as weld-twin diagnose wrote it"
        )
    return data


def _misshapen(item: Any, shape: Any, name: str = '') -> str:
    """Return what is not of the type that it needs, and where; empty where all is."""
    kind = shape if isinstance(shape, type) else type(shape)
    fits = isinstance(item, (float, int) if kind is float else kind)
    if not fits or (isinstance(item, bool) and kind is not bool):
        needs = _CALLED.get(kind, 'a list' if kind is list else 'a mapping')
        return f'{name} needs {needs}, and has {_short(item)}'
    if isinstance(shape, list):
        each = ((item[k], shape[0], f'{name}[{k}]') for k in range(len(item)))
    elif isinstance(shape, dict):
        named = ((key.rstrip('!'), key[-1] == '!', inner) for key, inner in shape.items())
        each = (
            (item.get(key), inner, f'{name}.{key}'.lstrip('.'))
            for key, must, inner in named
            if must or item.get(key) is not None
        )
    else:
        return ''
    return next(filter(None, (_misshapen(*one) for one in each)), '')


def _short(item: Any) -> str:
    """Return a value as JSON has it, of a long one its beginning."""
    text = json.dumps(item)
    return text if len(text) <= 40 else f'{text[:37]}...'


def read_model(robot: Robot, path: Path | str) -> Model:
    """Return the model of a diagnosis file, on the robot it was made for."""
    content = read_diagnosis(path)
    model = content.get('model')
    if model is None:
        raise ModelError(_without_model(path, content))
    applied = _applied(content)
    mends = tuple(mend for item in applied if (mend := item.get('mend')))
    robot = replayed(mends, Given((), robot)).robot
    _refuse_other_robot(robot, path, model)
    try:
        tool = _frame(model['tool'], 'model.tool')
        bases = tuple(_frame(base, 'model.bases') for base in model['bases'])
        known, result = (
            effects_from_list(_at_rest(model, key), robot) for key in ('known', 'found')
        )
        alone = _alone(model.get('alone'), robot)
        counted = counted_of(model, robot)
        changes = _changes(content.get('changed') or (), robot, bases)
        named = _named(content.get('verdict'), model.get('found', []))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ModelError(f"the model of diagnosis '{path}' lacks {error}") from None
    except (ModelError, DataError) as error:
        raise ModelError(f"diagnosis '{path}': {error}") from None
    if not bases:
        raise ModelError(f"the model of diagnosis '{path}' has no base frame")
    with_tool = robot.with_frames(tool=tool)
    mended = tuple(str(item.get('sentence')) for item in applied)
    return Model(
        with_tool,
        bases,
        known,
        result,
        mended,
        changes,
        mends=mends,
        alone=alone,
        named=named,
        counted=counted,
    )


def counted_of(model: Mapping[str, Any], robot: Robot) -> Counted | None:
    """Return how the controller counts the joints of a model; None where as the robot, or unknown."""
    entry = model.get('counted')
    if entry is None or model.get('kinematics') != fingerprint(robot):
        return None  # the model of another robot is refused by whoever uses it
    return Counted.from_mapping(entry, robot.n)


def _changes(
    entries: Iterable[Mapping[str, Any]], robot: Robot, bases: tuple[Array, ...]
) -> tuple[Change, ...]:
    """Return what later recordings have that the first has not; bases of their own hold their own."""
    own_bases = not all(np.array_equal(base, bases[0]) for base in bases)
    out = list[Change]()
    for entry in entries:
        kind, value = REGISTRY[entry['effect']], entry['value']
        if own_bases and kind.traits.fitted_with == 'base':
            continue
        sizes = value if isinstance(value, dict) else {kind.parameters[0].name: value}
        site = {key: entry[key] for key in ('effect', 'joint') if entry.get(key) is not None}
        out.append(Change(entry['recording'], *effects_from_list([{**site, **sizes}], robot)))
    return tuple(out)


def _named(verdict: Any, found: list[Any]) -> tuple[tuple[str, str | None], ...] | None:
    """
    Return name and joint of what a verdict names; None where a file holds a model alone.

    What is named is a part of what the model has. A verdict that somebody changed would be read in one
    place and not in another: programs are corrected by the model.
    """
    if not isinstance(verdict, dict):
        return None
    effects = verdict['effects']
    numbers = [cause.get('effect') for cause in verdict.get('causes') or ()]
    if any(flat(entry) not in found for entry in effects) or any(
        number is not None and number >= len(effects) for number in numbers
    ):
        raise ModelError(
            'verdict.effects was changed by hand and is not what the model has, by which programs and '
            'poses are corrected; take the file as diagnose wrote it, or give effects of your own in an '
            'effects file'
        )
    return tuple((entry['effect'], entry['joint']) for entry in effects)


def flat(entry: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entry of an effects file for one of a verdict."""
    known = {key: value for key, value in entry.items() if key not in ('parameters', 'std')}
    if known.get('joint') is None:
        known.pop('joint', None)
    return {**known, **entry['parameters']}


def _alone(entry: Any, robot: Robot) -> Alone | None:
    """Return what the robot file of a model does by itself; older files say nothing of it."""
    if not isinstance(entry, dict):
        return None
    sizes = {key: float(entry[key]) for key in Alone._fields if key != 'changes'}
    return Alone(effects_from_list(entry['changes'], robot), **sizes)


def _at_rest(model: dict[str, Any], key: str) -> list[dict[str, Any]]:
    """Return the entries of a model's effects; springs that do not say how they rest are older."""
    entries: list[dict[str, Any]] = model.get(key, [])
    if 'statics' in model or not isinstance(entries, list):
        return entries
    return [
        {'statics': 'first_order', **entry}
        if isinstance(entry, dict) and entry.get('effect') == 'joint_compliance'
        else entry
        for entry in entries
    ]


def _without_model(path: Path | str, content: dict[str, Any]) -> str:
    wrong = content.get('unsound')
    if wrong:
        sentence = str(wrong[0].get('sentence', '')).rstrip('.')
        return f"diagnosis '{path}' holds no model, for its data were unsound: {sentence}"
    return f"diagnosis '{path}' holds no model; make it anew with diagnose"


def _refuse_other_robot(robot: Robot, path: Path | str, model: dict[str, Any]) -> None:
    """Refuse the model of another robot; old files say nothing of theirs."""
    name, kinematics = model.get('robot'), model.get('kinematics')
    if kinematics is None or kinematics == fingerprint(robot):
        return
    other = (
        f'of another arm than the {robot.name!r} given: their kinematics differ'
        if name == robot.name
        else f'of the robot {name!r}, not of {robot.name!r}'
    )
    raise ModelError(f"diagnosis '{path}' is {other}; give the robot it was made for")


def _applied(content: dict[str, Any]) -> list[dict[str, Any]]:
    """Return what was wrong with the data of a diagnosis and was undone, in its order."""
    return [item for item in content.get('unsound') or () if item.get('applied')]


def mended_source(
    model: Model, nominal: Robot, recording: Recording, setup: int = 0
) -> tuple[Recording, str]:
    """
    Return a recording mended as a diagnosis mended its own, and a sentence about it, or ''.

    Where something was measured, the measurements tell whether it needs that: a source that was
    put right meanwhile is left as it is.
    """
    if not model.mends:
        return recording, ''
    out = replayed(model.mends, Given((recording,), nominal), setup).recordings[0]
    if out is recording:
        return recording, ''
    twin = model.twin(setup)
    if recording.measured is not None and _gap(twin, recording) < _gap(twin, out):
        return recording, f'{recording.name} needs no mending any more, and was left as it is'
    return out, f'{recording.name} was mended as the diagnosis did: {" ".join(model.mended)}'


def _gap(twin: Twin, recording: Recording) -> float:
    """Return the median distance between measured and twin [m], beyond any where none pairs."""
    seen = recording.measured
    assert seen is not None
    t = recording.joints.t
    inside = (seen.t >= t[0]) & (seen.t <= t[-1])
    if not inside.any():
        return float('inf')
    part = seen.take(inside)
    away = part.position - twin.poses(recording, part.t).position
    return float(np.median(np.linalg.norm(away, axis=1)))


def load_model(robot: Robot, path: Path | str, setup: int = 0) -> Twin:
    """Return the twin of a diagnosis file: the frames of a set-up, effects given and found."""
    model = read_model(robot, path)
    if not 0 <= setup < len(model.bases):
        raise ModelError(
            f"diagnosis '{path}' has {len(model.bases)} set-up(s), there is no number {setup + 1}"
        )
    return model.twin(setup)


def timed(
    path: Path | str, model: Model, setup: int, recording: Recording, *, same: bool
) -> tuple[Twin, list[str]]:
    """
    Return the twin of one set-up of a diagnosis file for a recording at its time, and what to say.

    same: the recording is the one diagnosed of that set-up; see `in_use`.
    """
    stored = read_diagnosis(path)['model']
    twin = model.twin(setup)
    try:
        epoch, span = int(stored['epochs_ns'][setup]), stored['spans_ns'][setup]
        ends = int(span[0]), int(span[1])
        effects, said = in_use(twin.effects, epoch, ends, recording, same=same)
    except (KeyError, IndexError, TypeError, ValueError):
        effects, said = of_the_robot(twin.effects), []
    return Twin(twin.robot, effects), said


def one_base(model: Model) -> bool:
    """Return whether all recordings share one base frame."""
    return all(np.array_equal(base, model.bases[0]) for base in model.bases)


def _frame(value: Any, name: str) -> Array:
    frame = readonly(value, (4, 4), name)
    turned = frame[:3, :3] @ frame[:3, :3].T
    if abs(turned - np.eye(3)).max() > 1e-6 or abs(frame[3] - [0, 0, 0, 1]).max() > 1e-9:
        raise DataError(f'{name} is no rigid transform')
    return frame
