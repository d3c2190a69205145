# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Lengths as they are counted, and lengths, instants and lists in the sentences of the checks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...recording import Recording
from ..limits import MOVED, RUN


def distance(part: Array) -> Array:
    """Return the length of the position part of a residual (c, M), shape (M,) [m]."""
    return np.asarray(np.linalg.norm(part[:3], axis=0))


def swept(motions: Sequence[Array]) -> tuple[NDArray[np.bool_], ...]:
    """
    Return the samples in which a joint moved that rests in most others, for each such joint.

    Where joints are swept one after the other, what is wrong with one of them shows in these alone.

    motions: joints (M, n) of every recording.
    """
    q = np.concatenate(motions)
    moved = np.abs(q - np.median(q, axis=0)) > MOVED
    return tuple(own for own in moved.T if RUN <= np.count_nonzero(own) < len(q) // 2)


def middle_of_each(sizes: Sequence[Array], some: Iterable[NDArray[np.bool_]] = ()) -> float:
    """Return the median of what every recording has of each sample, or that of some if it is more."""
    whole = np.concatenate(sizes)
    return max([float(np.median(whole)), *(float(np.median(whole[own])) for own in some)])


def length(value: float) -> str:
    """Return a length [m] as people read it: no finer than instruments are."""
    if value >= 1.0:
        return f'{value:.3g} m'
    millimetres = round(value * 1e3, 3)
    return f'{millimetres:.3g} mm' if millimetres > 0.0 else 'less than 0.001 mm'


def capital(words: str) -> str:
    """Return words as a sentence begins with them."""
    return f'{words[0].upper()}{words[1:]}'


def falls(before: float, after: float) -> str:
    return f'the gap falls from {length(before)} to {length(after)}'


def listed(names: Sequence[str]) -> str:
    return ' and '.join([', '.join(names[:-1]), names[-1]] if len(names) > 1 else names)


def instant(recording: Recording, time: float) -> str:
    """Return an instant [s] as people find it: the first station then, or the time."""
    if not recording.joints.static or recording.measured is None:
        return f't = {time:.4g} s'
    t = recording.measured.t
    before = int(np.count_nonzero(t < time))
    return f'station {min(before, t.size - 1)} of {t.size}'
