# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Entries of effects files for tests that hold for every effect, also for one that is new."""

from weld_twin_core.effects import REGISTRY

OF_CELLS = {'root_pose', 'guide_bend', 'guide_tilt'}
"""Effects of robots beside a positioner, or on a track; tested in test_cells."""


def bundled():
    """Return the effects of the package."""
    return [kind for kind in REGISTRY.values() if kind.__module__.startswith('weld_twin')]


def usual(special, without=()):
    """Return the entry of every effect of an arm: a special one, else with typical sizes on j1."""
    names = [kind for kind in bundled() if kind.name not in {*OF_CELLS, *without}]
    return {kind.name: special.get(kind.name) or _typical(kind) for kind in names}


def _typical(kind):
    sizes = {
        p.name: p.typical if p.size < 2 else [p.typical * (k + 1) for k in range(p.size)]
        for p in kind.parameters
    }
    return sizes | ({'joint': 'j1'} if kind.of in ('joint', 'link') else {})
