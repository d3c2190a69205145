# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A measured curve as a small picture: the spline, its band, and axes in units people read."""

from __future__ import annotations

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.effects.curve import basis
from weld_twin_core.effects.joint_curve import JointCurve

from .charts import Axis, Line, chart
from .html import Html

_SAMPLES = 60
"""Points of a drawn curve: one for every four units of its width."""
_NINETY = 1.645
"""Standard deviations to either side that hold 90 % of a Gaussian."""
_DEGREES = 180.0 / np.pi
"""Degrees in a radian."""
_AXES = {
    'angle': (_DEGREES, Axis('angle', '°')),
    'direction': (1.0, Axis('direction, backward to forward')),
    'speed': (_DEGREES, Axis('speed', '°/s')),
    'load': (1.0, Axis('load torque', 'N m')),
    'temperature': (1.0, Axis('temperature', '°C')),
    'time': (1.0, Axis('time', 's')),
}
_VALUES = {'d': (1e3, 'mm'), 'a': (1e3, 'mm')}


def curve_figure(curve: JointCurve, covariance: Array | None, joint: int) -> Html:
    """
    Return a figure of a curve over what it runs over.

    Parameters
    ----------
    curve : JointCurve
    covariance : array, shape (K, K), optional
        Of its values; without it there is no band.
    joint : int
        Number of its joint: over its angle, the cursor follows the instant looked at.

    """
    x = np.linspace(curve.knots[0], curve.knots[-1], _SAMPLES)
    weights = basis(curve.knots, x)
    y = np.asarray(curve.values) @ weights
    band = np.zeros_like(y)
    if covariance is not None:
        band = _NINETY * np.sqrt(
            np.maximum(np.einsum('ki,kl,li->i', weights, covariance, weights), 0)
        )
    size, unit = _VALUES.get(curve.channel, (_DEGREES, '°'))
    across, label = _AXES[curve.over]
    what = 'zero' if curve.channel == 'q' else curve.channel
    middle, half = y * size, band * size
    return chart(
        f'{curve.joint}: {what} over {curve.over}',
        x * across,
        [Line('off by', middle), Line('not off', 0.0 * middle, 'soft', dashed=True)],
        (label, Axis('off by', unit)),
        band=(middle - half, middle + half),
        joint=joint if curve.over == 'angle' else None,
    )
