# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects as parameters and the command line give them: as a file, as a diagnosis, as text."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from weld_twin_core.effects import Effect, effects_from_list
from weld_twin_core.errors import ModelError
from weld_twin_core.robot import Robot
from weld_twin_msgs_py.effects_file import read_effects
from weld_twin_msgs_py.yaml_file import parse_yaml, read_text


def load_effects(path: Path | str, robot: Robot) -> tuple[Effect, ...]:
    """
    Return the effects of an effects file, or those a diagnosis has found (a ``.json`` file).

    Raises
    ------
    ModelError
        The file cannot be read, or names an effect the robot cannot have.

    """
    if Path(path).suffix.lower() != '.json':
        return read_effects(path, robot)
    text = read_text(path, 'diagnosis')
    try:
        found = json.loads(text)['verdict']['effects']
        return effects_from_list([_flat(entry) for entry in found], robot)
    except json.JSONDecodeError as error:
        raise ModelError(f"diagnosis '{path}' line {error.lineno}: {error.msg}") from None
    except (KeyError, TypeError, AttributeError):
        raise ModelError(f"diagnosis '{path}' has no list 'verdict.effects'") from None
    except ModelError as error:
        raise ModelError(f"diagnosis '{path}': {error}") from None


def parse_effects(text: str, robot: Robot) -> tuple[Effect, ...]:
    """
    Return the effects of a text in the form of an effects file.

    Raises
    ------
    ModelError
        The text is malformed, or names an effect the robot cannot have.

    """
    return effects_from_list(parse_yaml(text, 'effects'), robot)


def _flat(entry: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entry of an effects file for one of a diagnosis."""
    known = {key: entry[key] for key in entry if key not in ('parameters', 'std')}
    if known.get('joint') is None:
        known.pop('joint', None)
    return {**known, **entry['parameters']}
