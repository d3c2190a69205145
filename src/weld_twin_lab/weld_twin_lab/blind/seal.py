# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Commitments: hashes published before any diagnosis, which hold cases and truths to what they were.

A truth carries a random salt, so that its hash cannot be had by guessing; the seal is one hash
over the hashes of all cases and truths.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.input_files import hashed
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
    """Return the content of one of the JSON files above; raises DataError where it is none."""
    data, wanted = read_json(path), SCHEMAS[path.name]
    if data.get('schema') != wanted:
        raise DataError(f"'{path}' has the schema {data.get('schema')!r}, expected {wanted}")
    return data


def write(path: Path, content: dict[str, Any], *, overwrite: bool = False) -> None:
    write_json(path, {'schema': SCHEMAS[path.name], **content}, overwrite=overwrite)


PRIVATE_DIRECTORY, PRIVATE_FILE = 0o700, 0o600
"""Permissions by which nobody but the owner can look."""


def digest(path: Path) -> str:
    return hashed('case', path).sha256


def seal_of(entries: Sequence[Mapping[str, Any]]) -> str:
    """Return the one hash over names, cases and truths, in order."""
    lines = (f'{item["name"]} {item["case"]} {item["truth"]}\n' for item in entries)
    return text_digest(''.join(lines))


def text_digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def make_private(path: Path) -> None:
    """Let nobody but the owner read a directory and what is in it."""
    for place, _, files in os.walk(path):
        os.chmod(place, PRIVATE_DIRECTORY)
        for name in files:
            os.chmod(Path(place) / name, PRIVATE_FILE)


def truths_within_reach(cases: Path) -> Path | None:
    """Return a directory of truths inside or beside the cases that can be read, or None."""
    for place in _near(cases.resolve()):
        if (place / TRUTHS).is_file() and os.access(place / TRUTHS, os.R_OK):
            return place
    return None


def _near(cases: Path) -> Iterator[Path]:
    yield cases
    for around in (cases, cases.parent):
        try:
            yield from (place for place in around.iterdir() if place.is_dir())
        except PermissionError:
            continue


def opened(cases: Path, truths: Path, seal: str = '') -> list[dict[str, Any]]:
    """
    Return the truths, in the order of the cases, once every hash has been found as committed.

    seal: as printed when the cases were made; left out, the one stored with the cases holds.
    """
    listed = read(cases / CASES)
    entries = listed['cases']
    if seal_of(entries) != (seal or listed['seal']) or listed['seal'] != seal_of(entries):
        raise DataError(
            f"the seal of '{cases / CASES}' is broken: its list of cases was changed, or "
            'it is not the list whose seal was given'
        )
    return [_one(cases, truths, entry) for entry in entries]


def _one(cases: Path, truths: Path, entry: Mapping[str, Any]) -> dict[str, Any]:
    name = str(entry['name'])
    for place, key in ((cases / name, 'case'), (truths / name, 'truth')):
        if not place.is_dir():
            raise DataError(f"the {key} of {name} is missing: there is no '{place}'")
        if digest(place) != entry[key]:
            raise DataError(f"the {key} of {name} was changed after it was sealed; see '{place}'")
    return read(truths / name / TRUTH)
