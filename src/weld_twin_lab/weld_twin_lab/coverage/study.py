# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Every poor recording and every sealed case diagnosed, and its regions tried on other poses."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import Diagnosis, diagnose
from weld_twin_core.errors import TwinError
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.bags import read_recording
from weld_twin_msgs_py.robots import load_robot
from weld_twin_nodes.offline.told_twin import build_twin

from ..blind import layout
from ..blind.diagnosing import diagnosis_of
from ..real_robots.unseen_stations import ALIGN
from ..study import Parts
from ..transfer.flags import flagged
from ..transfer.splits import TUNED_ON, Split, all_splits
from .held import held
from .oracle import oracle_sigma

NAME, PARTS = 'coverage', 'parts'
FEWEST = 15
"""Poses of a sealed case below which their share says nothing."""
UR5_NOISE = 2e-5
"""A GTS3800 is good to 15 um + 6 um/m, a metre or two away [m]."""


def entries_of(ur5: Path, ur10: Path, cases: Path | None, part: Parts) -> list[dict[str, Any]]:
    """
    Return what the regions of all splits hold, and of sealed cases where there are any.

    Parameters
    ----------
    ur5, ur10 : Path
        Directories with the published tables.
    cases : Path or None
        Directory with ``cases`` and ``truths`` as ``weld-twin lab blind make`` writes them.
    part : Parts
        Keeps every recording's result.

    Raises
    ------
    DataError
        Data are missing or cannot be read.

    """
    entries = [part(split.name, partial(_of_split, split)) for split in all_splits(ur5, ur10)]
    if cases is not None:
        for name in _names(cases / 'cases'):
            pair = (cases / 'cases' / name, cases / 'truths' / name)
            entries.append(part(name, partial(of_case, *pair)))
    return entries


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
    assert found.posterior is not None
    beyond = flagged(found.posterior, test, test.measured.t)
    effects = build_twin(robot, case / layout.KNOWN if _knows(case) else '').effects
    for region, mask in (('inside', good & ~beyond), ('outside', good & beyond)):
        if mask.sum() >= FEWEST:
            entry[region] = held(found, train, test, noise, mask)
            at = test.measured.t[mask]
            entry[region]['oracle_sigma_m'] = oracle_sigma(robot, effects, told, (train, test), at)
    return entry


def _knows(case: Path) -> bool:
    """Tell whether a case tells effects beforehand."""
    return bool(layout.read(case / layout.CASE)['known'])


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
