# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A model file as a running node corrects with it: what it holds, and whether it is the file's still."""

from __future__ import annotations

import hashlib
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import ModelError
from weld_twin_core.twin.program_model import ProgramModel

from ..streams.supervision import Promise
from .correcting import program_model
from .told_twin import diagnosis_of, refuse_mended

DIGITS = 12
"""Of the hash of a file, as it is told: enough for all models of a plant."""


@dataclass(frozen=True, eq=False)
class LoadedModel:
    """A model and the file it came from."""

    path: Path
    digest: str  # of the content of the file
    read: ProgramModel
    promised: Promise | None  # how far measurements are from the twin that has the model
    modified: float  # when the file was written [s since 1970]

    def outdated(self, most_age: float = 0.0) -> str:
        """
        Return why the model is not fresh; empty where it is.

        ``most_age`` [s]: age of the file above which it is not; 0 for any.
        """
        try:
            now = self.path.stat().st_mtime
            changed = now != self.modified and _digest(self.path) != self.digest
        except OSError as error:
            return f"the model '{self.path}' cannot be read any more: {error.strerror}"
        if changed:
            return (
                f"the model '{self.path}' was exchanged; call ~/reload to go on with the new one"
            )
        age = time.time() - self.modified
        if most_age and age > most_age:
            return (
                f'the model is {age / 3600.0:.1f} hours old, at most {most_age / 3600.0:g} are '
                'allowed (max_model_age); measure and diagnose anew'
            )
        return ''

    def around(self, wrench: Array | None, frame: str, warm: float | None) -> ProgramModel:
        """Return what acts on the arm under a load [N, N m] and at a temperature [degC]."""
        return replace(self.read, wrench=wrench, wrench_frame=frame, temperature=warm, _twins={})


def loaded(robot: Robot, path: str) -> LoadedModel:
    """
    Return the model of a file.

    Raises ModelError: there is none, it is of another robot, its data were unsound, or it counts
    joints otherwise than they are read.
    """
    if not path:
        raise ModelError("the compensator needs the parameter 'model': a diagnosis.json")
    file = Path(path)
    try:
        modified, digest = file.stat().st_mtime, _digest(file)
    except OSError as error:
        raise ModelError(f"the model '{path}' cannot be read: {error.strerror}") from None
    content = diagnosis_of(file)
    refuse_mended(content, file)
    read = program_model(robot, file)
    return LoadedModel(file, digest, read, _promised(content, read), modified)


def _promised(content: dict[str, Any], read: ProgramModel) -> Promise | None:
    """Return what a model leaves on unseen data; None where its file does not say so."""
    remaining = _number(content, 'shrink', 'rms_after_m')
    if not remaining:
        return None
    unsure = 0.0 if read.posterior is None else read.posterior.recorded_m
    return Promise.of(remaining, unsure, max(int(_number(content, 'gap', 'samples')), 1))


def _number(content: dict[str, Any], part: str, key: str) -> float:
    """Return a number of a diagnosis; 0 where it has none."""
    values = content.get(part)
    value = values.get(key) if isinstance(values, dict) else None
    return float(value) if isinstance(value, int | float) else 0.0


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:DIGITS]
