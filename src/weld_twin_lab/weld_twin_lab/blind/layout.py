# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where cases, truths and verdicts lie on disk, and how their lists are read."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.whole_files import write_text

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
    try:
        data = json.loads(path.read_text(encoding='utf-8'))
    except OSError as error:
        raise DataError(f"'{path}' cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise DataError(f"'{path}' is not JSON: {error}") from None
    wanted = SCHEMAS[path.name]
    schema = data.get('schema') if isinstance(data, dict) else None
    if schema != wanted:
        raise DataError(f"'{path}' has the schema {schema!r}, expected {wanted}")
    return dict(data)


def text(name: str, content: dict[str, Any]) -> str:
    """Return the text of one of the JSON files above."""
    return json.dumps({'schema': SCHEMAS[name], **content}, indent=1) + '\n'


def write(path: Path, content: dict[str, Any], *, overwrite: bool = False) -> None:
    """Write one of the JSON files above."""
    write_text(path, text(path.name, content), overwrite=overwrite)
