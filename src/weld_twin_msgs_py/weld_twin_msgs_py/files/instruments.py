# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How sure instruments are of a point, as their data sheets or certificates say it."""

import re
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from weld_twin_core.errors import DataError
from weld_twin_core.recording import Recording

PART = 0.5
"""Standard deviation of a coordinate in units of the largest error permitted: manuals of trackers
have typical results at half of that (ISO 10360-10:2021)."""
_WRITTEN = re.compile(
    r'(?P<least>[0-9.]+)(?:\+(?P<more>[0-9.]+)/m)?(?:@(?P<away>[0-9.]+))?', re.IGNORECASE
)


class Instrument(NamedTuple):
    """Largest permissible error of a coordinate."""

    least: float  # [m]
    per_metre: float  # what comes on top for every metre between instrument and point [m/m]
    source: str
    away: float | None = None
    """How far away the points are [m]; left out, from the origin of the measuring frame."""


_ISO = 'transverse error by ISO 10360-10'
INSTRUMENTS = {
    'at901': Instrument(15e-6, 6e-6, f'Leica AT901, as its maker gives it: {_ISO}'),
    'at930': Instrument(15e-6, 6e-6, f'Leica AT930, as its maker gives it: {_ISO}'),
    'at960': Instrument(15e-6, 6e-6, f'Leica AT960, as its maker gives it: {_ISO}'),
    'at500': Instrument(15e-6, 6e-6, f'Leica AT500, user manual, section 2.8: {_ISO}'),
    'gts3800': Instrument(15e-6, 6e-6, 'GTS3800, as published with the measured UR5'),
}
"""By the name that people type. Certificates of one's own are better: give their numbers."""


def instrument(given: str) -> Instrument:
    """
    Return an instrument by name, or by what its certificate says.

    given: a name of `INSTRUMENTS`, or the largest permissible error such as ``0.015+0.006/m``
    [mm]; ``@3`` behind either says that the points are 3 m away.
    """
    name, _, away = given.partition('@')
    known = INSTRUMENTS.get(name.lower())
    result = _WRITTEN.fullmatch(f'0@{away}' if known and away else given if known is None else '0')
    try:
        numbers = {k: float(v) for k, v in result.groupdict().items() if v} if result else {}
    except ValueError:
        numbers = {}
    if not numbers or (known is None and not 0.0 < numbers['least'] < 10.0):
        raise DataError(
            f"--instrument '{given}' is none that is known ({', '.join(INSTRUMENTS)}); else write its "
            'largest permissible error in mm, such as 0.015+0.006/m'
        )
    if known is None:
        known = Instrument(1e-3 * numbers['least'], 1e-3 * numbers.get('more', 0.0), 'told')
    return known._replace(away=numbers.get('away'))


def measured_by(recording: Recording, what: Instrument, *, own_frame: bool) -> Recording:
    """Return a recording whose measurements are as sure as an instrument's."""
    seen = recording.measured
    if seen is None:
        return recording
    away = what.away
    if away is None and what.per_metre > 0.0 and not own_frame:
        raise DataError(
            f"{recording.name} was measured in a frame that is not the instrument's: say how far away "
            'it stood, such as --instrument at960@3'
        )
    distance = (
        np.linalg.norm(seen.position, axis=1) if away is None else np.full(seen.t.size, away)
    )
    return recording.with_measured(
        replace(seen, sigma=PART * (what.least + what.per_metre * distance))
    )
