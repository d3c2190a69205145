# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis of this project, by the same files as everybody else."""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.diagnosis.algebra.problem import Model
from weld_twin_core.twin.posterior import Posterior, pose_covariances
from weld_twin_msgs_py.files.diagnosis_model import read_model
from weld_twin_nodes.offline.given_twin import build_twin
from weld_twin_report.report.diagnosis_files import diagnosis_text

from ..course import ContestAnswer, ContestCase

TO_SIGMA = 1.4826
"""Standard deviation of normal noise in median absolute deviations; a few outliers do not count."""


def weld_twin(case: ContestCase) -> ContestAnswer:
    """Return the verdict: every name with its probability, and the prediction of the model."""
    twin = build_twin(case.robot, '' if case.known is None else case.known)
    diagnosis = diagnose(
        [case.train],
        twin.robot,
        align=frozenset(case.align),
        known=twin.effects,
        exclude=case.exclude,
    )
    text = diagnosis_text(diagnosis, ())
    with TemporaryDirectory() as folder:
        file = Path(folder) / 'diagnosis.json'
        file.write_text(text, encoding='utf-8')
        model = read_model(twin.robot, file)
    verdict = json.loads(text)['verdict']
    named = [cause for cause in verdict['causes'] if cause['effect'] is not None]
    causes = tuple(
        tuple((str(x['effect']), x['joint'], float(x['probability'])) for x in cause['name'])
        for cause in named
    )
    sure = float(verdict['confidence'] or 0.0)
    status = verdict['status']
    twin = model.twin(0)
    return ContestAnswer(
        twin.poses(case.ask, case.times).position,
        causes,
        unknown=sure if status == 'unknown' else 0.0,
        none=sure if status == 'none' else 0.0,
        sure=(*(bool(cause['sure']) for cause in named), bool(verdict['sure'])),
        sigma=_sigma(case, diagnosis.posterior, model),
    )


def _sigma(case: ContestCase, posterior: Posterior | None, model: Model) -> Array | None:
    """Return how sure the model is of what will be measured: of the pose, and the instrument's noise."""
    measured = case.train.measured
    if posterior is None or measured is None:
        return None
    twin = model.twin(0)
    sure = pose_covariances(posterior, twin, case.ask, case.times)[:, :3, :3]
    remaining = measured.position - twin.poses(case.train, measured.t).position
    noise = TO_SIGMA * np.median(np.abs(remaining - np.median(remaining, axis=0)))
    return np.asarray(np.sqrt(np.diagonal(sure, axis1=1, axis2=2) + noise**2))
