# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Entries of a history as plain data, so that they can be sent and kept."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from datetime import datetime
from typing import Any

import numpy as np

from .entry import Entry


def plain(entry: Entry) -> dict[str, Any]:
    """Return an entry as what JSON can hold."""
    out = {each.name: getattr(entry, each.name) for each in fields(Entry)}
    return {
        **{k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in out.items()},
        'at': entry.at.isoformat(),
        'names': list(entry.names),
    }


def entry(data: Mapping[str, Any]) -> Entry:
    """Return the entry of plain data."""
    arrays = {k: np.array(data[k], float) for k in ('value', 'prior_std', 'covariance', 'tool')}
    at = datetime.fromisoformat(data['at'])
    return Entry(**{**data, **arrays, 'at': at, 'names': tuple(data['names'])})
