# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A database with many diagnoses, made up: for pages and their speed, not for what they say."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime, timedelta, timezone
from typing import TYPE_CHECKING

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_report.history import Database, Entry

if TYPE_CHECKING:
    from sqlalchemy import Connection

FAMILIES = (
    'joint_offset',
    'link_length',
    'link_offset',
    'link_twist',
    'joint_compliance',
    'backlash',
)
SCALES = (2e-4, 5e-5, 5e-5, 2e-4, 2e-6, 1e-4)
"""Standard errors of the families' values, SI units."""
FIRST = datetime(2025, 1, 6, 8, tzinfo=timezone.utc)
"""When the first diagnosis of every cell is of: a Monday."""
WORN = 4
"""Every so many cells has an elbow that wears, and one whose zero has stepped."""


def fill(database: Database, cells: int, diagnoses: int, seed: int = 1) -> None:
    """
    Fill an empty database.

    cells, diagnoses: so many cells, with so many diagnoses each.
    """

    def work(connection: Connection) -> None:
        for number in range(cells):
            for entry in made(number, diagnoses, seed):
                database.put(connection, f'line {number + 1:03d}', entry)

    database.write(work)


def made(number: int, diagnoses: int, seed: int = 1) -> Iterator[Entry]:
    """Yield the diagnoses of a cell."""
    rng = np.random.default_rng([seed, number])
    joints = catalog.load('ur5').joint_names
    names = tuple(f'{family} {joint} 0' for family in FAMILIES for joint in joints)
    sigma = np.repeat(SCALES, len(joints))
    mixed = rng.normal(size=(3 * len(names), len(names)))
    covariance = np.linalg.inv(mixed.T @ mixed / len(mixed) + 0.1 * np.eye(len(names)))
    covariance *= np.outer(sigma, sigma) / np.mean(np.diag(covariance))
    root = np.linalg.cholesky(covariance)
    play, zero = names.index('backlash elbow_joint 0'), names.index('joint_offset elbow_joint 0')
    for week in range(diagnoses):
        value = root @ rng.normal(size=len(names))
        value[play] += 6e-4 + (2e-5 * week if number % WORN == 0 else 0.0)
        value[zero] += 3e-3 * (number % WORN == 1 and week >= diagnoses // 2)
        width = float(value[play])
        gap = 1e-4 + 0.2 * abs(width) + abs(value[zero]) * 0.1
        effect = {
            'effect': 'backlash',
            'joint': 'elbow_joint',
            'parameters': {'width': width},
            'std': {'width': float(sigma[play])},
        }
        yield Entry(
            FIRST + timedelta(weeks=week),
            'ur5',
            'made up',
            f'{number:08d}{week:08d}',
            'identified',
            float(rng.uniform(0.8, 0.99)),
            float(gap * rng.uniform(0.9, 1.1)),
            2e-5,
            float(2e-5 * rng.uniform(1.0, 1.3)),
            [effect],
            names,
            value,
            10.0 * sigma,
            covariance,
            np.eye(4),
        )
