# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The twin with identified effects over a whole recording."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.errors import ModelError
from weld_twin_core.recording import Recording
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.bags import write_recording
from weld_twin_msgs_py.files.diagnosis_model import (
    load_model,
    one_base,
    read_diagnosis,
    read_model,
    timed,
)
from weld_twin_msgs_py.files.input_files import hashed

from .told_twin import build_twin


def prediction_twin(
    robot: Robot,
    path: Path | str,
    bag: Path | str,
    recording: Recording,
    setup: int | None = None,
) -> Twin:
    """
    Return the twin of a model file for a bag.

    Parameters
    ----------
    robot : Robot
    path : Path or str
        diagnosis.json or an effects file.
    bag : Path or str
        Where the diagnosis fitted a base frame per recording, its hash tells which is meant.
    recording : Recording
        What the bag holds; its stamps tell whether the set-up's own motion applies.
    setup : int, optional
        Which recording's base frame, counted from 1; overrides the bag.

    Raises
    ------
    ModelError
        The file is of no use, or it is open which base frame is meant.

    """
    if Path(path).suffix.lower() != '.json' or 'model' not in read_diagnosis(path):
        return build_twin(robot, path)
    model = read_model(robot, path)
    if setup is not None:
        load_model(robot, path, setup - 1)
        return timed(path, model, setup - 1, recording)
    if len(model.bases) == 1:
        return timed(path, model, 0, recording)
    known = [
        item['sha256']
        for item in read_diagnosis(path).get('inputs', [])
        if item['use'] == 'recording'
    ]
    own = hashed('recording', bag).sha256
    if own not in known:
        if one_base(model):
            return timed(path, model, 0, recording)
        raise ModelError(
            f"diagnosis '{path}' has a base frame for each of its {len(model.bases)} recordings "
            f"and '{bag}' is none of them; choose one with --setup 1 to {len(model.bases)}"
        )
    return timed(path, model, known.index(own), recording)


def write_prediction(
    path: Path | str,
    twin: Twin,
    recording: Recording,
    *,
    storage: str = 'mcap',
    provenance: Mapping[str, Any] | None = None,
) -> float | None:
    """
    Write the recording with the twin's pose at every joint state, and deviations.

    Returns
    -------
    float or None
        RMS of measured minus twin [m], where something was measured.

    Raises
    ------
    DataError
        The path exists or cannot be written.

    """
    poses = twin.poses(recording, recording.joints.t)
    measured = recording.measured
    deviation = None
    if measured is not None and measured.t.size:
        gap = measured.position - twin.poses(recording, measured.t).position
        deviation = gap @ twin.robot.T_world_base[:3, :3]
    made = {'twin_effects': [effect.to_mapping() for effect in twin.effects]}
    write_recording(
        path,
        recording,
        twin.robot,
        twin=(poses.position, poses.rotation),
        deviation=deviation,
        storage=storage,
        provenance={**made, **(provenance or {})},
    )
    return None if deviation is None else float(np.sqrt((deviation**2).sum(axis=1).mean()))
