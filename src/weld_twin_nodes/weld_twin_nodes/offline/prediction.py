# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The twin with identified effects over a whole recording, and how sure it is."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import ModelError
from weld_twin_core.recording import Recording
from weld_twin_core.twin.domain import as_seen
from weld_twin_core.twin.posterior import Posterior, largest_sigma, pose_covariances
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.assembly.whole_recording import refuse_apart
from weld_twin_msgs_py.bags import write_recording
from weld_twin_msgs_py.files.diagnosis_model import (
    load_model,
    mended_source,
    one_base,
    read_model,
    timed,
)
from weld_twin_msgs_py.files.input_files import hashed
from weld_twin_msgs_py.files.posterior_entry import read_posterior

from .told_twin import build_twin, diagnosis_of

BESIDE = 'prediction.json'
"""Beside the bag: the stretches outside what was recorded."""


MOST = 3
"""Stretches told on the terminal; the others are in the file."""


class Stretch(NamedTuple):
    """A stretch of a motion outside what was recorded [s from its first stamp], and why."""

    t_start: float
    t_end: float
    why: str


class Predictor(NamedTuple):
    """A twin and how sure it is."""

    twin: Twin
    posterior: Posterior | None = None
    """None for an effects file, or a diagnosis written without one."""
    setup: int = 0  # which base frame of the posterior, counted from 0
    source: Recording | None = None
    """The recording that it is for, mended as the diagnosis mended its own; None where nothing had
    to be."""
    told: str = ''  # what is to be said of that

    def covariances(self, recording: Recording) -> Array | None:
        """Return the covariance of the true pose at every joint state, shape (N, 6, 6)."""
        if self.posterior is None:
            return None
        return pose_covariances(
            self.posterior, self.twin, recording, recording.joints.t, self.setup
        )

    def outside(self, recording: Recording) -> list[Stretch]:
        """Return the stretches of a motion that lie outside what was recorded."""
        if self.posterior is None:
            return []
        t = recording.joints.t
        result = self.posterior.domain.outside(*as_seen(recording, t))
        t = t - t[0]
        return [Stretch(float(t[a]), float(t[b]), why) for a, b, why in result]


class Written(NamedTuple):
    """What a prediction came to."""

    rms_m: float | None  # RMS of measured minus twin, where something was measured
    outside: Sequence[Stretch]
    sigma_m: float | None  # median of the standard deviation of position in its worst direction


def predictor(
    robot: Robot,
    path: Path | str,  # diagnosis.json or an effects file
    # Where the diagnosis fitted a base frame per recording, its hash tells which is meant.
    bag: Path | str,
    # What the bag holds; its stamps tell whether the set-up's own motion applies.
    recording: Recording,
    setup: int | None = None,  # which recording's base frame, counted from 1; overrides the bag
) -> Predictor:
    """
    Return the twin of a model file for a bag, and how sure it is.

    Raises ModelError: the file is of no use, or it is open which base frame is meant.
    """
    content = diagnosis_of(path)
    if 'model' not in content:
        return Predictor(build_twin(robot, path))
    model = read_model(robot, path)
    own = hashed('recording', bag).sha256
    known = [item['sha256'] for item in content.get('inputs', []) if item['use'] == 'recording']
    place = known.index(own) if own in known else None
    if setup is not None:
        load_model(robot, path, setup - 1)
        chosen = setup - 1
    elif place is not None and len(model.bases) > 1:
        chosen = place
    elif one_base(model):
        chosen = 0
    else:
        raise ModelError(
            f"diagnosis '{path}' has a base frame for each of its {len(model.bases)} recordings "
            f"and '{bag}' is none of them; choose one with --setup 1 to {len(model.bases)}"
        )
    # Clocks are apart by another time in every run. Where something was measured, that tells.
    clocks = place if place is not None else -1 if recording.measured is None else chosen
    source, reported = mended_source(model, robot, recording, clocks)
    twin = timed(path, model, chosen, source)
    return Predictor(twin, read_posterior(robot, path), chosen, source, reported)


def on_one_clock(recording: Recording) -> Recording:
    """
    Return a recording whose measurements have some time in common with the joint states.

    Raises DataError: they have none.
    """
    if recording.measured is not None and not recording.joints.static:
        refuse_apart(recording.joints, recording.measured)
    return recording


def write_prediction(
    path: Path | str,
    model: Predictor,
    recording: Recording,
    *,
    storage: str = 'mcap',
    provenance: Mapping[str, Any] | None = None,
) -> Written:
    """
    Write the recording with the twin's pose at every joint state, its covariance, deviations.

    The stretches outside what was recorded go into `BESIDE`, in the bag's directory.

    Raises DataError: the path exists or cannot be written.
    """
    twin = model.twin
    poses = twin.poses(recording, recording.joints.t)
    covariances, outside = model.covariances(recording), model.outside(recording)
    deviation = _deviation(twin, recording)
    made = {'twin_effects': [effect.to_mapping() for effect in twin.effects]}
    write_recording(
        path,
        recording,
        twin.robot,
        twin=(poses.position, poses.rotation),
        covariance=covariances,
        deviation=deviation,
        storage=storage,
        provenance={**made, **(provenance or {})},
        beside=beside_bag(model, outside),
    )
    return Written(
        None if deviation is None else float(np.sqrt((deviation**2).sum(axis=1).mean())),
        outside,
        None if covariances is None else float(np.median(largest_sigma(covariances))),
    )


def _deviation(twin: Twin, recording: Recording) -> Array | None:
    """Return measured minus twin in the base frame, shape (M, 3) [m]; None if none measured."""
    measured = recording.measured
    if measured is None or not measured.t.size:
        return None
    gap = measured.position - twin.poses(recording, measured.t).position
    return np.asarray(gap @ twin.robot.T_world_origin[:3, :3])


def beside_bag(model: Predictor, outside: Sequence[Stretch]) -> dict[str, str]:
    """Return what lies in the bag's directory: the stretches outside what was recorded."""
    if model.posterior is None:
        return {}
    content = {'outside': [stretch._asdict() for stretch in outside]}
    return {BESIDE: json.dumps(content, indent=1) + '\n'}


def sureness_sentences(model: Predictor, got: Written) -> list[str]:
    """Return in words how sure a prediction is, and where it knows nothing."""
    if model.posterior is None or got.sigma_m is None:
        return [
            'how sure the poses are is not known: the model has no posterior, only a '
            'diagnosis.json written by this version has'
        ]
    out = [
        f'the tool is where the twin says within {got.sigma_m * 1e3:.3g} mm '
        '(one standard deviation in the worst direction, median)'
    ]
    if got.outside:
        last = '' if len(got.outside) <= MOST else f'; {len(got.outside) - MOST} more in {BESIDE}'
        parts = [f'{s.t_start:.2f} to {s.t_end:.2f} s: {s.why}' for s in got.outside[:MOST]]
        out.append('outside what was recorded, ' + '; '.join(parts) + last)
    return out
