# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The entry ``posterior`` of a diagnosis file: how sure its model is of a pose."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array, readonly
from weld_twin_core.effects import effects_from_list
from weld_twin_core.errors import DataError, ModelError
from weld_twin_core.twin.directions import Directions, Discrepancy
from weld_twin_core.twin.domain import Domain, Spots
from weld_twin_core.twin.posterior import Posterior

from .diagnosis_model import read_diagnosis
from .whole_files import plain

SEAL = 'sha256'
"""Key for the digest of all else in the entry; older files have none."""


def sealed(entry: Mapping[str, Any]) -> dict[str, Any]:
    """Return an entry with the digest by which it is known that nobody changed it."""
    rest = {key: value for key, value in entry.items() if key != SEAL}
    text = json.dumps(plain(rest), sort_keys=True)
    return {**rest, SEAL: hashlib.sha256(text.encode()).hexdigest()}


def read_posterior(robot: Robot, path: Path | str) -> Posterior | None:
    """Return the posterior of a diagnosis file; None where it was written without one."""
    entry = read_diagnosis(path).get('posterior')
    if entry is None:
        return None
    try:
        posterior = _posterior(robot, entry)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ModelError(f"the posterior of diagnosis '{path}' lacks {error}") from None
    except (ModelError, DataError) as error:
        raise ModelError(f"diagnosis '{path}': {error}") from None
    if SEAL in entry and sealed(entry) != entry:
        raise ModelError(
            f"the posterior of diagnosis '{path}' was changed after it was written, and nothing says "
            'any more how sure a pose is; take the file as diagnose wrote it'
        )
    return posterior


def _posterior(robot: Robot, entry: Mapping[str, Any]) -> Posterior:
    what = Directions(
        tuple(entry['frames']),
        int(entry['setups']),
        effects_from_list(entry['effects'], robot),
        tuple(readonly(knots, (None,), 'posterior.knots') for knots in entry['knots']),
        _gives(robot, entry.get('gives', 0)),
    )
    rest = entry['discrepancy']
    discrepancy = Discrepancy(
        _size(rest['position_m'], 'position_m'),
        _size(rest['orientation_rad'], 'orientation_rad'),
        readonly(rest['gears'], (robot.n,), 'posterior.discrepancy.gears'),
        readonly(rest['curves'], (robot.n,), 'posterior.discrepancy.curves'),
        max(_size(rest['reach'], 'reach'), 1e-9),
        readonly(rest.get('turns', np.zeros(robot.n)), (robot.n,), 'posterior.discrepancy.turns'),
        readonly(rest.get('peaks_m', ()), (None,), 'posterior.discrepancy.peaks_m'),
        _size(rest.get('jumps', 0.0), 'jumps'),
        _size(rest.get('swings', 0.0), 'swings'),
    )
    return Posterior(
        what,
        np.array([float(item['mean']) for item in entry['coordinates']]),
        _covariance(entry['covariance'], what.count),
        discrepancy,
        _domain(robot, entry['recorded']),
        tuple(str(item) for item in entry['left_open']),
        _size(entry['sigma_recorded_m'], 'sigma_recorded_m'),
        _size(entry['sigma_anywhere_m'], 'sigma_anywhere_m'),
        middle=min(_size(entry.get('middle', 0.0), 'middle'), 1.0),
    )


def _gives(robot: Robot, count: Any) -> int:
    """Return for how many joints a give is a coordinate: all or none."""
    if count not in (0, robot.n):
        raise DataError(f'posterior.gives must be 0 or {robot.n}, got {count!r}')
    return int(count)


def _covariance(rows: Any, count: int) -> Array:
    """Return the whole of a lower triangle."""
    if len(rows) != count or any(len(row) != k + 1 for k, row in enumerate(rows)):
        raise DataError(f'posterior.covariance must be a lower triangle of {count} rows')
    out = np.zeros((count, count))
    for k, row in enumerate(rows):
        out[k, : k + 1] = row
        out[: k + 1, k] = row
    return out


def _domain(robot: Robot, entry: Mapping[str, Any]) -> Domain:
    joints = entry['joints']
    names = tuple(str(joint['name']) for joint in joints)
    if names != tuple(robot.joint_names):
        raise ModelError(
            f'it was made for joints {", ".join(names)}; robot {robot.name!r} has '
            + ', '.join(robot.joint_names)
        )
    return Domain(
        names,
        tuple(
            tuple((float(low), float(high)) for low, high in joint['measured']) for joint in joints
        ),
        tuple(_size(joint['margin'], 'margin') for joint in joints),
        tuple(bool(joint['turns']) for joint in joints),
        None if entry['speeds'] is None else tuple(float(v) for v in entry['speeds']),
        _pair(entry['load']),
        _pair(entry['temperature']),
        _spots(robot, entry.get('spots')),
    )


def _spots(robot: Robot, entry: Mapping[str, Any] | None) -> Spots | None:
    if entry is None:
        return None
    at = np.array(entry['at'], dtype=float)
    bare = robot.with_frames(base=np.eye(4))
    return Spots(bare, readonly(at, (len(at), 3), 'spots.at'), _size(entry['reach'], 'reach'))


def _pair(value: Any) -> tuple[float, float] | None:
    if value is None:
        return None
    low, high = value
    return float(low), float(high)


def _size(value: Any, name: str) -> float:
    size = float(value)
    if not 0.0 <= size < np.inf:
        raise DataError(f'posterior: {name} must be a size, got {value!r}')
    return size
