# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Every poor recording and every sealed case diagnosed, and its regions tried on other poses."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core import __version__
from weld_twin_core.arm import catalog
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import Diagnosis, diagnose
from weld_twin_core.errors import DataError, TwinError
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.bags import read_recording
from weld_twin_msgs_py.files.whole_files import write_text
from weld_twin_msgs_py.robots import load_robot
from weld_twin_nodes.offline.output_directory import write_owned

from ..blind import layout
from ..blind.diagnosing import diagnosis_of
from ..real_robots.data import tables
from ..real_robots.unseen_stations import ALIGN
from ..transfer.splits import TUNED_ON, Split, splits
from .held import held
from .table import page

RESULTS, TABLE, PARTS = 'coverage.json', 'coverage.md', 'parts'
SCHEMA = 'weld_twin/coverage/1'
HOME = {'ur5': 0, 'ur10': 1}
"""Rows before this one are left out: the UR10's first is its home pose, far from the rest."""
UR5_NOISE = 2e-5
"""A GTS3800 is good to 15 um + 6 um/m, a metre or two away [m]."""
Tell = Callable[[str], None]


def study(
    ur5: Path, ur10: Path, out: Path, cases: Path | None = None, tell: Tell = lambda text: None
) -> dict[str, Any]:
    """
    Try the regions of all splits, and of sealed cases where there are any, and write the results.

    Each recording's result is kept as soon as it is there; a run that was stopped goes on.

    Parameters
    ----------
    ur5, ur10 : Path
        Directories with the published tables.
    out : Path
        Keeps a file per recording.
    cases : Path, optional
        Directory with ``cases`` and ``truths`` as ``weld-twin lab blind make`` writes them.
    tell : callable
        Told what is being done.

    Raises
    ------
    DataError
        Data are missing or cannot be read, or ``out`` holds something else.

    """
    _refuse_foreign(out)
    (out / PARTS).mkdir(parents=True, exist_ok=True)
    entries = []
    for robot, directory in (('ur5', ur5), ('ur10', ur10)):
        for split in splits(robot, tables(robot, directory)[0].recording, HOME[robot]):
            entries.append(_kept(out, split.name, partial(_of_split, split), tell))
    if cases is not None:
        for name in _names(cases / 'cases'):
            pair = (cases / 'cases' / name, cases / 'truths' / name)
            entries.append(_kept(out, name, lambda p=pair: of_case(*p), tell))  # type: ignore[misc]
    result = {'schema': SCHEMA, 'version': __version__, 'entries': entries}
    write_owned(out / TABLE, page(entries))
    text = json.dumps(result, indent=1, allow_nan=False) + '\n'
    write_owned(out / RESULTS, text)
    return result


def _kept(out: Path, name: str, work: Callable[[], dict[str, Any]], tell: Tell) -> dict[str, Any]:
    """Return the result of one recording, from its file where there is one."""
    path = out / PARTS / f'{name}.json'
    if path.is_file():
        kept: dict[str, Any] = json.loads(path.read_text(encoding='utf-8'))
        return kept
    tell(name)
    entry = work()
    write_text(path, json.dumps(entry, indent=1, allow_nan=False) + '\n', overwrite=True)
    return entry


def _refuse_foreign(out: Path) -> None:
    """Refuse a directory that holds something else."""
    if not out.exists():
        return
    ours = out.is_dir() and all(p.name in (RESULTS, TABLE, PARTS) for p in out.iterdir())
    if not ours:
        raise DataError(f"'{out}' holds something else already; choose another place")


def _of_split(split: Split) -> dict[str, Any]:
    """Return what the regions of one poor recording hold, inside and outside of it."""
    group = 'tuned on' if split.robot == 'ur5' and split.kind in TUNED_ON else 'unseen'
    entry: dict[str, Any] = {'name': split.name, 'source': split.robot, 'group': group}
    found = _tried(lambda: diagnose([split.train], catalog.load(split.robot), align=ALIGN), entry)
    if found is None:
        return entry
    for region, other in (('inside', split.inside), ('outside', split.outside)):
        if other is not None and other.measured is not None and other.measured.t.size:
            entry[region] = held(found, split.train, other, _noise(other))
    return entry


def of_case(case: Path, truth: Path) -> dict[str, Any]:
    """Return what the regions of one sealed case hold on its test recording."""
    told = layout.read(truth / layout.TRUTH)
    entry: dict[str, Any] = {'name': case.name, 'source': 'plant', 'group': 'unseen'}
    entry |= {'kind': told['kind'], 'motion': told['motion']}
    found = _tried(lambda: diagnosis_of(case, with_holdout=False), entry)
    if found is None:
        return entry
    robot = load_robot(str(case / layout.ROBOT))
    train, test = (read_recording(p, robot) for p in (case / layout.TRAIN, truth / layout.TEST))
    assert test.measured is not None
    good = np.ones(test.measured.t.size, dtype=bool)
    good[np.asarray(told['outliers'], dtype=int)] = False
    noise = np.full(test.measured.t.size, float(told['sigma_m']))
    entry['outside' if told['test'] == 'new motion' else 'inside'] = held(
        found, train, test, noise, good
    )
    return entry


def _tried(work: Callable[[], Diagnosis], entry: dict[str, Any]) -> Diagnosis | None:
    """Return a diagnosis with a posterior; None, and why in the entry, where there is none."""
    try:
        found = work()
    except TwinError as error:
        entry['refused'] = str(error)
        return None
    entry['status'] = found.status
    return found if found.posterior is not None else None


def _noise(other: Recording) -> Array:
    assert other.measured is not None
    if other.measured.sigma is not None:
        return other.measured.sigma
    return np.full(other.measured.t.size, UR5_NOISE)


def _names(cases: Path) -> Iterator[str]:
    listed = layout.read(cases / layout.CASES)
    return (str(entry['name']) for entry in listed['cases'])
