# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""An experiment recorded in a running cell: the generator moves, the recorder writes."""

import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from weld_twin_core.errors import DataError, TwinError

from .process import NodeProcess

GRACE = 60.0
"""Seconds beyond the motion itself that meeting the listeners and ending may take."""


def recorded_experiment(
    experiment: Path, robot: str, seconds: float, out: Path, **moving: Any
) -> Path:
    """
    Run a file of kind 'joints', which takes some time [s], in the cell that is up; return the bag.

    Recorder and generator are processes of their own, on the domain of this one. What measures, and
    whatever follows the joint states, is part of the cell. ``moving``: further parameters of the
    generator.
    """
    if out.exists():
        raise DataError(f"'{out}' exists already; it may be the recording of this experiment")
    with tempfile.TemporaryDirectory() as folder:
        recorder = _started('recorder', {'out': str(out)}, Path(folder))
        path: dict[str, Any] = {'robot': robot, 'path': str(experiment), 'exit_when_done': True}
        generator = _started('trajectory_generator', {**path, **moving}, Path(folder))
        try:
            _ended(generator, seconds + GRACE)
        except BaseException:
            recorder.stop()
            raise
        recorder.interrupt()
        if recorder.end(GRACE) != 0:
            raise TwinError(f'the recorder failed: {recorder.log.strip()}')
    return out


def _started(node: str, parameters: Mapping[str, Any], folder: Path) -> NodeProcess:
    place = folder / node
    place.mkdir()
    return NodeProcess(node, parameters, place)


def _ended(generator: NodeProcess, seconds: float) -> None:
    try:
        code = generator.end(seconds)
    except subprocess.TimeoutExpired as error:
        generator.stop()
        raise TwinError(f'the motion did not end in {seconds:.0f} s: {generator.log}') from error
    except BaseException:
        generator.stop()
        raise
    if code != 0:
        raise TwinError(f'the generator failed: {generator.log.strip()}')
