# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Effects with memory as associative scans over the samples.

A recursion whose step is closed under composition (a clip of a clip is a clip, an affine map of
an affine map is affine) needs log2(N) array passes instead of a loop over N samples, works on
irregular stamps and on many parameter draws at once, and run over one sample with the state
carried is the live form.

References
----------
.. [1] G. E. Blelloch, "Prefix sums and their applications", CMU-CS-90-190, 1990.
.. [2] A. Visintin, "Differential Models of Hysteresis", Springer 1994, ch. III (play).
.. [3] P. R. Dahl, "A solid friction model", Aerospace Corporation TOR-0158(3107-18)-1, 1968.

"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array

_STILL = 1e-9
"""Part of a travel, or of the time to let go, below which bristles are moved straight."""


def play(q: Array, width: Array | float, start: Array) -> Array:
    r"""
    Return the operator of play (dead-zone hysteresis) of positions (..., N), w = ``start`` before.

    .. math:: w_k = \min(q_k + \delta/2, \max(q_k - \delta/2, w_{k-1}))

    The full width of the gap broadcasts with the input.
    """
    if q.ndim == 1 and np.ndim(width) > 1:
        return _play_of_many(q, 0.5 * np.asarray(width), np.asarray(start))
    low, high = np.broadcast_arrays(q - 0.5 * width, q + 0.5 * width)
    low, high = low.copy(), high.copy()
    step = 1
    while step < low.shape[-1]:
        before_low, before_high = low[..., :-step].copy(), high[..., :-step].copy()
        now_low, now_high = low[..., step:].copy(), high[..., step:].copy()
        low[..., step:] = np.clip(before_low, now_low, now_high)
        high[..., step:] = np.clip(before_high, now_low, now_high)
        step *= 2
    output: Array = np.clip(np.asarray(start)[..., None], low, high)
    return output


def _play_of_many(q: Array, half: Array, start: Array) -> Array:
    """Return play of one input, shape (N,), in many gaps: a stretch without a turn at a time."""
    turns = np.flatnonzero(np.diff(np.sign(np.diff(q)))) + 1
    out = np.empty(half.shape[:-1] + q.shape)
    before = np.clip(start[..., None], q[:1] - half, q[:1] + half)
    out[..., :1] = before
    for first, last in zip([0, *turns], [*turns, q.size - 1], strict=True):
        part = q[first + 1 : last + 1]
        if q[last] > q[first]:
            np.maximum(before, part - half, out=out[..., first + 1 : last + 1])
        else:
            np.minimum(before, part + half, out=out[..., first + 1 : last + 1])
        before = out[..., last : last + 1]
    return out


def bristle(step: Array, travel: Array | float, leak: Array | float, start: Array) -> Array:
    r"""
    Return how far bristles between two rubbing parts are bent, from -1 to 1, shape (..., N).

    .. math:: dz = (\mathrm{sign}(dq) - z)\,|dq| / \mathrm{travel} - z\,\mathrm{leak}

    Dahl's model [3]_, with a leak by which what is bent lets go in time; solved exactly for steps
    that are even between samples. ``step`` is since the sample before, ``travel`` what bristles
    bend over [rad or m]; ``leak`` is the time since the sample before over that in which bristles
    let go.
    """
    bent = np.abs(step) / travel
    whole = bent + leak
    share = bent / np.where(whole > _STILL, whole, 1.0)
    drive = np.where(whole > _STILL, -share * np.expm1(-whole), bent)
    return linear(np.exp(-whole), np.sign(step) * drive, start)


def bristle_tangent(
    step: Array, travel: Array | float, leak: Array | float, z: Array, change: Array
) -> Array:
    """
    Return how a small change comes out in `bristle`, which returned z (..., N) from rest.

    The change is that of step over travel, along the direction of the step, shape (..., N).
    """
    bent = np.abs(step) / travel
    whole = bent + leak
    remaining, moving = np.exp(-whole), whole > _STILL
    safe = np.where(moving, whole, 1.0)
    drive = (leak / safe * -np.expm1(-whole) + bent * remaining) / safe
    before = np.concatenate([np.zeros_like(z[..., :1]), z[..., :-1]], axis=-1)
    way = np.where(step < 0.0, -1.0, 1.0)
    rise = way * np.where(moving, drive, 1.0) - remaining * before
    slope: Array = linear(remaining, change * rise, np.zeros(np.shape(rise)[:-1]))
    return slope


def last_true(mask: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return for each sample the index of the last true entry up to it, or -1; shape as mask."""
    index = np.where(mask, np.arange(mask.shape[-1]), -1)
    last: NDArray[np.intp] = np.maximum.accumulate(index, axis=-1)
    return last


def linear(gain: NDArray[Any], drive: NDArray[Any], start: NDArray[Any]) -> NDArray[Any]:
    """Return y_k = gain_k y_{k-1} + drive_k from a start; real or complex, |gain| <= 1."""
    factor, value = (np.array(part) for part in np.broadcast_arrays(gain, drive))
    value[..., 0] += factor[..., 0] * start
    step = 1
    while step < value.shape[-1]:
        value[..., step:] += factor[..., step:] * value[..., :-step].copy()
        factor[..., step:] *= factor[..., :-step].copy()
        step *= 2
    return value
