# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Many small errors acting together: a row per kind, ripple by joint, instead of hundreds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from weld_twin_core.diagnosis.result import Diagnosis, Family
from weld_twin_core.effects.transmission_ripple import TransmissionRipple
from weld_twin_nodes.wording.quantities import millimetres, turned
from weld_twin_nodes.wording.words import cause, site_name

_LARGEST = 3
"""Joints of a kind told, those first that need it most."""
_LINES = 3
"""Orders of ripple told for each joint."""


class Ripple(NamedTuple):
    """The ripple of one joint: RMS of its amplitudes together [rad], and its strongest lines."""

    joint: str
    rms: float
    lines: tuple[tuple[float, float], ...]
    """Order and amplitude [rad], strongest first."""


def family_rows(families: tuple[Family, ...]) -> list[list[str]]:
    """Return kind, what it accounts for, how much worse it is without, joints, what is like it."""
    rows = []
    for family in families:
        joints = [site.joint for site, _ in family.needed if site.joint] if family.named else []
        like = [site_name(site) for site, _ in family.like] if family.named else []
        name = cause(family.effect, None) + ('' if family.named else ' (exchangeable)')
        without = f'{100.0 * family.growth:+.0f} %'
        reported = [
            millimetres(family.rms_m),
            without,
            ', '.join(joints[:_LARGEST]),
            ', '.join(like),
        ]
        rows.append([name, *reported])
    return rows


def ripples(diagnosis: Diagnosis) -> list[Ripple]:
    """Return the ripple of every joint that has any, in chain order."""
    out = []
    for effect in diagnosis.model.known + diagnosis.model.found:
        if isinstance(effect, TransmissionRipple):
            size = np.abs(np.atleast_1d(np.asarray(effect.amplitude)))
            order = np.broadcast_to(np.atleast_1d(np.asarray(effect.order)), size.shape)
            first = np.argsort(-size)[:_LINES]
            lines = tuple((float(order[k]), float(size[k])) for k in first)
            out.append(Ripple(effect.joint, float(np.sqrt((size**2).sum() / 2.0)), lines))
    return out


def ripple_rows(diagnosis: Diagnosis) -> list[list[str]]:
    """Return joint, RMS of its ripple, strongest lines."""
    return [
        [
            r.joint,
            f'{turned(r.rms)} ({1e6 * r.rms:.0f} µrad)',
            ', '.join(
                f'{order:g} ({turned(size)}, {1e6 * size:.0f} µrad)' for order, size in r.lines
            ),
        ]
        for r in ripples(diagnosis)
        if r.rms > 0.0
    ]


FAMILY_HEADS = ('Kind', 'Accounts for', 'Error without it', 'Needed at', 'Would do as well')
RIPPLE_HEADS = ('Joint', 'Ripple, RMS', 'Strongest orders per turn')
