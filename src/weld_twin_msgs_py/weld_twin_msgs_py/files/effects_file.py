# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects files: a YAML list of effects."""

import re
from collections.abc import Iterable
from pathlib import Path

from weld_twin_core.arm.known_arms import fingerprint
from weld_twin_core.arm.robot import Robot
from weld_twin_core.effects import Effect, effects_from_list
from weld_twin_core.errors import ModelError

from .whole_files import write_text
from .yaml_file import parse_yaml, read_text, yaml_text

_HEAD = re.compile(r'^# (Not |)for kinematics ([0-9a-f]{16})\b', re.M | re.I)


def head_of(nominal: Robot, *, corrected: bool) -> str:
    """
    Return the comment by which an effects file says which robot it goes with.

    nominal: the robot that was diagnosed. corrected: it goes with a corrected one instead.
    """
    return f'{"Not for" if corrected else "For"} kinematics {fingerprint(nominal)}'


def read_effects(path: Path | str, robot: Robot) -> tuple[Effect, ...]:
    """
    Read an effects file and check every effect against the robot.

    Raises
    ------
    ModelError
        The file cannot be read, is malformed, names an effect the robot cannot have, or says that
        it goes with another robot; the message names file and entry.

    """
    if Path(path).is_dir():
        raise ModelError(
            f"'{path}' is a folder; give the diagnosis.json or the effects file in it"
        )
    text = read_text(path, 'effects file')
    entries = parse_yaml(text, f"effects file '{path}'")
    for word, kinematics in _HEAD.findall(text):
        if (kinematics == fingerprint(robot)) == (word == 'Not '):
            own = 'the corrected robot.yaml beside it' if word else 'the robot that was diagnosed'
            raise ModelError(
                f"effects file '{path}' does not go with the robot {robot.name!r} that was given: its "
                f'head says that it goes with {own}; give that one'
            )
    try:
        return effects_from_list(entries, robot)
    except ModelError as error:
        raise ModelError(f"effects file '{path}': {error}") from None


def write_effects(path: Path | str, effects: Iterable[Effect], *, overwrite: bool = False) -> None:
    """
    Write an effects file.

    Raises
    ------
    DataError
        The file exists and ``overwrite`` is not set, or the place cannot be written.

    """
    entries = [effect.to_mapping() for effect in effects]
    write_text(path, yaml_text(entries), overwrite=overwrite)
