# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis of this project."""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory

from weld_twin_core.diagnosis import diagnose
from weld_twin_msgs_py.files.diagnosis_model import read_model
from weld_twin_nodes.offline.given_twin import build_twin
from weld_twin_report.report.diagnosis_files import diagnosis_text

from ..case import ContestAnswer, ContestCase


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
    )
