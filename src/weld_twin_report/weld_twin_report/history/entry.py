# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One diagnosis as it stands in the history, and as plain data that can be sent and kept."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, fields
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError, ModelError
from weld_twin_msgs_py.files.diagnosis_model import read_diagnosis
from weld_twin_msgs_py.messages.from_messages import NANOSECONDS

FIRST_YEAR = 2000
"""Stamps before it are counted from the start of a machine, not from a date."""
ROUNDING = 1e-6
"""By how much a covariance may miss being one, in units of its own standard deviations: digits of a
file. What a wrong sign or a damaged number makes is far beyond it."""
ARRAYS = ('value', 'prior_std', 'covariance', 'tool')
PASSING = 'base '
"""Coordinates that are of one set-up only: where the instrument stood."""


@dataclass(frozen=True, eq=False)
class Entry:
    at: datetime  # when it was recorded, UTC
    robot: str
    kinematics: str  # name and fingerprint of the robot's model
    recording: str  # SHA-256 of what was diagnosed
    status: str
    confidence: float | None
    gap_m: float | None
    floor_m: float | None
    unexplained_m: float | None
    effects: list[Any]  # what was named, as in ``verdict.effects``
    names: tuple[str, ...]
    """Coordinates that say something of the arm; none where the data were unsound."""
    value: Array
    prior_std: Array  # shape (P,)
    covariance: Array  # shape (P, P)
    tool: Array  # shape (4, 4), the fitted tool frame

    def plain(self) -> dict[str, Any]:
        """Return it as what JSON can hold."""
        out = {each.name: getattr(self, each.name) for each in fields(self)}
        return {
            **{k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in out.items()},
            'at': self.at.isoformat(),
            'names': list(self.names),
        }

    @classmethod
    def of_plain(cls, data: Mapping[str, Any]) -> Entry:
        """Return what `plain` made plain."""
        arrays = {name: np.array(data[name], float) for name in ARRAYS}
        at = datetime.fromisoformat(data['at'])
        return cls(**{**data, **arrays, 'at': at, 'names': tuple(data['names'])})


def instant(text: str) -> datetime:
    """Return the instant that a text names, UTC where it does not say."""
    try:
        # Python 3.10 does not read the Z that others write for UTC.
        at = datetime.fromisoformat(f'{text[:-1]}+00:00' if text[-1:] in 'Zz' else text)
        at = (at if at.tzinfo else at.replace(tzinfo=timezone.utc)).astimezone(timezone.utc)
        if at.year < FIRST_YEAR:
            raise ValueError
        return at
    except (ValueError, OverflowError):
        raise DataError(
            f"'{text}' is no date of a recording ({FIRST_YEAR} or later); write 2026-03-31 or "
            '2026-03-31T14:05'
        ) from None


def entry_of(path: Path | str, at: datetime | None = None) -> Entry:
    """Return the entry of a diagnosis.json or its directory, recorded as its stamps tell, or ``at``."""
    file = Path(path)
    file = file / 'diagnosis.json' if file.is_dir() else file
    data = read_diagnosis(file)
    try:
        return _entry(data, file, at)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise ModelError(f"diagnosis '{file}' lacks {error}; make it again") from None


def _entry(data: Mapping[str, Any], file: Path, at: datetime | None) -> Entry:
    model, verdict, gap = data.get('model'), data['verdict'], data.get('gap') or {}
    recordings = [each['sha256'] for each in data['inputs'] if each['use'] == 'recording']
    if not recordings:
        raise DataError(f"diagnosis '{file}' does not say which recording it is of; make it again")
    if model is None:
        raise DataError(
            f"the data of '{file}' were unsound, so it says nothing of the arm; mend them first"
        )
    names, value, prior, covariance = _coordinates(data.get('posterior'), file)
    if impossible := _impossible(value, prior, covariance):
        raise DataError(
            f"the posterior of '{file}' cannot be right: {impossible}; diagnose the recording again"
        )
    return Entry(
        at or date_of_stamp(model['epochs_ns'][0], file),
        str(model['robot']),
        str(model['kinematics']),
        '+'.join(recordings),
        str(verdict['status']),
        verdict['confidence'],
        gap.get('rms_m'),
        gap.get('noise_floor_m'),
        (data.get('unexplained') or {}).get('rms_m'),
        list(verdict['effects']),
        names,
        value,
        prior,
        covariance,
        np.asarray(model['tool'], dtype=float),
    )


def _impossible(value: Array, prior: Array, covariance: Array) -> str:
    """Return why numbers are no values with standard deviations and correlations; empty if they are."""
    if not all(np.isfinite(each).all() for each in (value, prior, covariance)):
        return 'it has numbers that are not finite'
    variance = np.diag(covariance)
    if not ((prior > 0.0).all() and (variance >= 0.0).all()):
        return 'it has variances below zero, or nothing was believed before the data'
    sigma = np.sqrt(np.where(variance > 0.0, variance, 1.0))
    lowest = np.linalg.eigvalsh(covariance / np.outer(sigma, sigma))[:1]
    if (lowest < -ROUNDING * len(value)).any():
        return 'its covariance is none, for it gives some sum of values a variance below zero'
    return ''


def date_of_stamp(epoch_ns: int, file: Path) -> datetime:
    at = datetime.fromtimestamp(epoch_ns // NANOSECONDS, timezone.utc)
    if at.year < FIRST_YEAR:
        raise DataError(
            f"the stamps of '{file}' are no dates ({at.date()}); say when it was recorded: --at DATE"
        )
    return at


def _coordinates(
    posterior: Mapping[str, Any] | None, file: Path
) -> tuple[tuple[str, ...], Array, Array, Array]:
    """Return names, values, widths before the data and covariance of what is the arm's own."""
    coordinates = [] if posterior is None else posterior['coordinates']
    if not coordinates or 'prior_std' not in coordinates[0]:
        raise DataError(
            f"diagnosis '{file}' does not say what was believed before the data: an older version "
            'wrote it; diagnose the recording again'
        )
    assert posterior is not None
    count = Counter(each['name'] for each in coordinates)
    # What has no name of its own cannot be followed from one diagnosis to the next.
    keep = [
        k
        for k, each in enumerate(coordinates)
        if not each['name'].startswith(PASSING) and count[each['name']] == 1
    ]
    # What is weighed over many priors cannot be freed of one; files of before 0.1 had one alone.
    plain = posterior.get(
        'single_prior',
        {'value': [each['value'] for each in coordinates], 'covariance': posterior['covariance']},
    )
    whole = np.zeros((len(coordinates), len(coordinates)))
    for k, row in enumerate(plain['covariance']):
        whole[k, : k + 1] = row
        whole[: k + 1, k] = row
    return (
        tuple(coordinates[k]['name'] for k in keep),
        np.array([float(plain['value'][k]) for k in keep]),
        np.array([float(coordinates[k]['prior_std']) for k in keep]),
        whole[np.ix_(keep, keep)],
    )
