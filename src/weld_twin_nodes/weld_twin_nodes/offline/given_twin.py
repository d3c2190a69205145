# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A twin, and cameras, as parameters and the command line describe them: files and texts."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.cameras import Camera, Target
from weld_twin_core.effects import REGISTRY, Effect, effect_from_mapping, effects_from_list
from weld_twin_core.effects.compliance import LOAD_OF_EFFORT
from weld_twin_core.effects.dated import from_now_on
from weld_twin_core.effects.plausible import beyond
from weld_twin_core.errors import DataError, ModelError
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.files.diagnosis_model import flat, load_model, read_diagnosis
from weld_twin_msgs_py.files.effects_file import read_effects
from weld_twin_msgs_py.files.input_files import hashed
from weld_twin_msgs_py.files.yaml_file import parse_yaml, read_yaml

IMPOSSIBLE = 10.0
"""Times the range of a parameter beyond which a value of a file is a slip of its unit: degrees taken
for radians are 57 times, millimetres taken for metres a thousand times too large."""


def build_twin(
    robot: Robot,
    # An effects file, or a diagnosis (``.json``) with what it found, as that acts after the
    # recordings (`from_now_on`, `since_recorded`); empty for none.
    model: Path | str = '',
    effects: str = '',  # more effects, in the form of an effects file
    *,
    implausible: bool = False,  # take values that no machine comes near, too
    # The caller mends joint positions as the diagnosis did; see `mended_source`.
    mended: bool = False,
) -> Twin:
    """Return a robot with the effects of a file and those of a text."""
    more = effects_from_list(parse_yaml(effects, 'effects'), robot)
    if not implausible:
        _possible(robot, more, 'effects')
    if not str(model):
        return Twin(robot, more)
    content = diagnosis_of(model)
    if not content:
        read = read_effects(model, robot)
        if not implausible:
            _possible(robot, read, f"effects file '{model}'")
        return Twin(robot, read + more)
    if not mended:
        refuse_mended(content, model)
    known = _diagnosed(robot, model, content)
    return Twin(known.robot, from_now_on(known.effects) + more)


def diagnosis_of(path: Path | str) -> dict[str, Any]:
    """Return the content of a diagnosis.json; empty for an effects file."""
    return read_diagnosis(path) if Path(path).suffix.lower() == '.json' else {}


def refuse_mended(content: Mapping[str, Any], path: Path | str) -> None:
    """Refuse a model that takes mended joint positions, where they come as they are."""
    if why := other_readings(content):
        raise ModelError(
            f"the model of '{path}' takes mended joint positions, and here they come as they are: "
            f'{why}'
        )


def by_effort(path: Path | str) -> bool:
    """Return whether springs of a model file take the measured efforts of the joints."""
    content = diagnosis_of(path)
    entries = entries_of(content) if content else read_yaml(path, 'effects file') or []
    return any(
        isinstance(entry, dict) and entry.get('statics') in LOAD_OF_EFFORT for entry in entries
    )


def entries_of(content: Mapping[str, Any]) -> list[Any]:
    """Return what the model of a diagnosis knew and found, as entries of an effects file."""
    model = content.get('model') or {}
    return [*(model.get('known') or ()), *(model.get('found') or ())]


def other_readings(content: Mapping[str, Any]) -> str:
    """Return why a diagnosis counts joints otherwise than they are read; nothing where it does not."""
    for item in content.get('unsound') or ():
        if item.get('applied') and (item.get('mend') or {}).get('do') == 'joints':
            return f'{item.get("sentence")} {item.get("remedy")}, then diagnose again'
    return ''


def changed_robot(content: Mapping[str, Any], path: str) -> list[str]:
    """Return that a robot file is another than at a diagnosis, which looks at its joints alone."""
    was = [each['sha256'] for each in content.get('inputs') or () if each.get('use') == 'robot']
    if not was or not Path(path).is_file() or [hashed('robot', path).sha256] == was:
        return []
    return [
        f"the robot file '{path}' is not as it was when the diagnosis was made; masses, frames and "
        'limits count as they are now'
    ]


def since_recorded(content: Mapping[str, Any], effects: Sequence[Effect]) -> list[str]:
    """Return what a diagnosis found and effects that go on from it have not, or have begin anew."""
    entries = entries_of(content)
    present = [effect.to_mapping() for effect in effects]
    absent = [REGISTRY[str(e['effect'])].traits for e in entries if e not in present]
    return [
        f'{title} grew with the time while it was recorded, and nobody knows how large it is now: it is '
        'left out, as at the first stamp of the recording'
        for title in sorted({traits.title for traits in absent if traits.endless})
    ] + [
        f'{title} begins anew at the first stamp of what is predicted or corrected, as of an arm that '
        'is cold there; record one that is warm, and diagnose that, for an arm that is at work'
        for title in sorted(
            {e.traits.title for e in map(effect_from_mapping, entries) if _warms(e)}
        )
    ]


def _warms(effect: Effect) -> bool:
    """Return whether an effect of the robot goes with the time since the first stamp, to an end."""
    it = effect.traits
    return effect.on == 'time' and not (it.of_setup or it.endless or it.dated)


def doubts(robot: Robot, effects: Sequence[Effect]) -> list[str]:
    """Return a sentence for all that no machine has, and for what counts twice."""
    out = [
        _doubt(effect, parameter, value, limit)
        for effect in effects
        for parameter, value, limit in beyond(robot, effect)
    ]
    for effect in effects:
        if np.less(getattr(effect, 'compliance', 0.0), 0.0).any():
            out.append(
                f'the compliance of {_called(effect)} is below zero: it moves against its load, '
                'as only a controller that mends too much has it do; check its sign'
            )
    times = Counter(_all_but_size(effect) for effect in effects)
    out += [f'{what} is there {n} times, and all count' for (what, _), n in times.items() if n > 1]
    return out


def _all_but_size(effect: Effect) -> tuple[str, str]:
    """Return how an effect is called, and all else by which two of them are more than one larger one."""
    sizes = {parameter.name for parameter in effect.parameters if parameter.linear}
    entry = {key: value for key, value in effect.to_mapping().items() if key not in sizes}
    return _called(effect), repr(entry)


def _doubt(effect: Effect, parameter: str, value: float, limit: float) -> str:
    return (
        f'{parameter} of {_called(effect)} is {value:g}; '
        f'no machine is known beyond {limit:g}, so check its unit (rad, m, s, kg)'
    )


def _called(effect: Effect) -> str:
    return f'{effect.name}{f" of {effect.site}" if effect.site else ""}'


def _possible(robot: Robot, effects: Sequence[Effect], source: str) -> None:
    for effect in effects:
        for parameter, value, limit in beyond(robot, effect):
            if abs(value) > IMPOSSIBLE * abs(limit) > 0.0:
                raise ModelError(f'{source}: {_doubt(effect, parameter, value, limit)}')


def _diagnosed(robot: Robot, path: Path | str, data: Mapping[str, Any]) -> Twin:
    """Return the model of a diagnosis, or the effects of its verdict where it holds no model."""
    if 'model' in data:
        return load_model(robot, path)
    try:
        result = [flat(entry) for entry in data['verdict']['effects']]
        return Twin(robot, effects_from_list(result, robot))
    except (KeyError, TypeError, AttributeError):
        raise ModelError(f"diagnosis '{path}' has no list 'verdict.effects'") from None
    except ModelError as error:
        raise ModelError(f"diagnosis '{path}': {error}") from None


def given_cameras(
    cameras: Iterable[str], targets: Iterable[str]
) -> tuple[tuple[Camera, ...], tuple[Target, ...]]:
    """Return the cameras and targets of texts such as ``left=left.yaml``."""
    # Tables load much that a node without cameras has no use for.
    from weld_twin_msgs_py.tables import read_camera, read_target

    lenses = tuple(read_camera(*_named(text, 'camera')) for text in cameras)
    # What a camera on the tool looks at stands still, where nothing else is said.
    other = 'world' if {camera.mount for camera in lenses} == {'tool'} else 'tool'
    return lenses, tuple(read_target(*_named(text, 'target'), other) for text in targets)


def _named(text: str, what: str) -> tuple[str, str]:
    name, mark, path = text.partition('=')
    if not (name and mark and path):
        raise DataError(f"a {what} is given as NAME=FILE, got '{text}'")
    return name, path
