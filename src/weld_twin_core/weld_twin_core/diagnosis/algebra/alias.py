# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What of an error others can do as well: the share of its columns outside the span of theirs.

On the data it tells a tie, on postures all over the range what no motion can part.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array

SINGULAR = 1e-9
"""Strength of a direction, as a share of the strongest, below which it is rounding."""


def span_of(columns: Array) -> Array:
    """
    Return orthonormal rows that span columns, (P, rows), of any size, which may repeat each other.

    columns: shape (P, rows).
    """
    size = np.linalg.norm(columns, axis=1)
    shown = columns[size > 0.0] / size[size > 0.0, None]
    if not shown.size:
        return np.zeros((0, columns.shape[1]))
    _, strength, span = np.linalg.svd(shown, full_matrices=False)
    return np.asarray(span[strength > SINGULAR * strength[0]])


def outside(columns: Array, span: Array) -> Array:
    """Return columns, (K, rows), without what a span, as `span_of` gives it, holds of them."""
    return np.asarray(columns - (columns @ span.T) @ span)


def share_outside(columns: Array, span: Array) -> Array:
    """Return the share of each column, shape (K,), that a span does not hold; 0 of one that is zero."""
    remaining = np.linalg.norm(outside(columns, span), axis=1)
    return np.asarray(remaining / np.maximum(np.linalg.norm(columns, axis=1), 1e-300))
