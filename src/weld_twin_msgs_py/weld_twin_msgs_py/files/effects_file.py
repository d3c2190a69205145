# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects files: a YAML list of effects."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from weld_twin_core.arm.robot import Robot
from weld_twin_core.effects import Effect, effects_from_list
from weld_twin_core.errors import ModelError

from .whole_files import write_text
from .yaml_file import read_yaml, yaml_text


def read_effects(path: Path | str, robot: Robot) -> tuple[Effect, ...]:
    """
    Read an effects file and check every effect against the robot.

    Raises
    ------
    ModelError
        The file cannot be read, is malformed, or names an effect the robot cannot have; the
        message names file and entry.

    """
    entries = read_yaml(path, 'effects file')
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
