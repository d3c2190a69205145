# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where cases, truths and verdicts lie on disk, and how their lists are read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.whole_files import read_json, write_json

CASES = 'cases.json'
CASE = 'case.json'
ROBOT = 'robot.yaml'
KNOWN = 'known.yaml'
TRAIN, HOLDOUT, TEST = 'train', 'holdout', 'test'
TRUTHS = 'truths.json'
TRUTH = 'truth.json'
VERDICTS = 'verdicts.json'
DIAGNOSIS = 'diagnosis.json'
SCORE = 'score.json'

SCHEMAS = {
    CASES: 'weld_twin/blind/cases/1',
    CASE: 'weld_twin/blind/case/1',
    TRUTHS: 'weld_twin/blind/truths/1',
    TRUTH: 'weld_twin/blind/truth/1',
    VERDICTS: 'weld_twin/blind/verdicts/1',
    SCORE: 'weld_twin/blind/score/1',
}


def read(path: Path) -> dict[str, Any]:
    """
    Return the content of one of the JSON files above.

    Raises DataError: it cannot be read or is something else.
    """
    data, wanted = read_json(path), SCHEMAS[path.name]
    if data.get('schema') != wanted:
        raise DataError(f"'{path}' has the schema {data.get('schema')!r}, expected {wanted}")
    return data


def write(path: Path, content: dict[str, Any], *, overwrite: bool = False) -> None:
    """Write one of the JSON files above."""
    write_json(path, {'schema': SCHEMAS[path.name], **content}, overwrite=overwrite)
