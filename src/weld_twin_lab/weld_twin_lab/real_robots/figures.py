# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of one arm: ripple against order, error over a turn, the workspace before and after."""

from __future__ import annotations

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_core.effects.transmission_ripple import TransmissionRipple
from weld_twin_report.sensitivity_report.figures.canvas import COLOURS, panels, svg


def ripple_spectrum(diagnosis: Diagnosis) -> str:
    """Return the amplitude of every order of every joint as SVG."""
    found = [e for e in diagnosis.model.found if isinstance(e, TransmissionRipple)]
    figure, axes = panels(max(len(found), 1), 2.5, sharey=True)
    for axis, effect in zip(axes, found, strict=False):
        order, size = (np.atleast_1d(np.asarray(v)) for v in (effect.order, effect.amplitude))
        axis.vlines(order, 0.1, np.maximum(1e6 * np.abs(size), 0.1), color=COLOURS[0], lw=0.9)
        axis.set(yscale='log', ylim=(0.1, None), xlim=(0, 430))
        axis.set_title(effect.joint.removesuffix('_joint').replace('_', ' '), fontsize=8.5)
        axis.set_xlabel('order [1/turn]')
    axes[0].set_ylabel('amplitude [µrad]')
    return svg(figure)


def ripple_over_range(diagnosis: Diagnosis) -> str:
    """Return each joint's ripple against its angle, over the range it moved, as SVG."""
    found = [e for e in diagnosis.model.found if isinstance(e, TransmissionRipple)]
    figure, axes = panels(max(len(found), 1), 2.3, sharey=False)
    joints = diagnosis.recordings[0].joints
    for axis, effect in zip(axes, found, strict=False):
        q = joints.q[:, diagnosis.model.robot.index(effect.joint)]
        low, high = np.percentile(q, [1.0, 99.0])
        theta = np.linspace(low, high, 1500)
        order, size, phase = (
            np.atleast_1d(np.asarray(v)) for v in (effect.order, effect.amplitude, effect.phase)
        )
        wave = size @ np.sin(np.outer(order, theta) + phase[:, None])
        # A straight line over the range is offset and gear ratio, not ripple.
        wave = wave - np.polyval(np.polyfit(theta, wave, 1), theta)
        axis.plot(np.degrees(theta), 1e6 * wave, color=COLOURS[0], lw=0.6)
        axis.set_title(effect.joint.removesuffix('_joint').replace('_', ' '), fontsize=8.5)
        axis.set_xlabel('angle [deg]')
    axes[0].set_ylabel('ripple [µrad]')
    return svg(figure)


def workspace(position: Array, before: Array, after: Array) -> str:
    """
    Return the size of the error at every held-out pose from above, before and after, as SVG.

    Parameters
    ----------
    position, before, after : arrays, shapes (M, 3), (3, M), (3, M) [m]

    """
    figure, axes = panels(3, 3.2)
    sizes = [1e3 * np.linalg.norm(part, axis=0) for part in (before, after)]
    names = ('frames fitted only', 'with everything found')
    for axis, size, name in zip(axes, sizes, names, strict=False):
        top = float(np.percentile(size, 98.0))
        dots = axis.scatter(
            position[:, 0], position[:, 1], c=size, s=7, vmin=0.0, vmax=top, cmap='viridis'
        )
        axis.set(aspect='equal', xlabel='x [m]', ylabel='y [m]')
        axis.set_title(f'{name} [mm]', loc='left', fontsize=9.0)
        figure.colorbar(dots, ax=axis, shrink=0.8)
    top = float(np.percentile(sizes[0], 99.0))
    for size, name, colour in zip(sizes, names, (COLOURS[1], COLOURS[0]), strict=True):
        edges = list(np.linspace(0.0, top, 60))
        axes[2].hist(size, bins=edges, histtype='step', color=colour, label=name)
    axes[2].set(xlabel='error [mm]', ylabel='held-out poses')
    axes[2].legend(frameon=False, fontsize=8.0)
    return svg(figure)
