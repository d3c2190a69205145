# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What each kind of many small errors accounts for on unseen data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ..hypotheses.search import Search
from ..result import Site
from ..unseen.regions import posture_regions
from ..unseen.unseen_stretches import Unseen

TINY = 1e-18
"""Least squared error [m^2] divided by: a nanometre, far below any instrument."""


@dataclass(frozen=True)
class WeighedFamily:
    """
    One kind of small error, and how much worse unseen data get without it.

    Attributes
    ----------
    effect : str
    fall : float
        Mean growth of the squared unseen error without the family, the rest as it is, [m^2].
    growths : tuple of float
        The same over the squared error with everything, in each stretch of time and in each region
        of posture that was left out.
    members : tuple of (Site, float)
        Its members and how far each moves the tool, RMS [m], largest first.

    """

    effect: str
    fall: float
    growths: tuple[float, ...]
    members: tuple[tuple[Site, float], ...]

    @property
    def rms_m(self) -> float:
        """Return what the family accounts for at the tool, RMS [m]."""
        return float(np.sqrt(max(self.fall, 0.0)))

    def returns(self, worth: float) -> float:
        """Return the share of the parts in which the error grows by this share of itself."""
        return float(np.mean(np.array(self.growths) > worth)) if self.growths else 0.0


def weighed_families(found: Search, unseen: Unseen) -> tuple[WeighedFamily, ...]:
    """Return what every family of the final model accounts for on unseen data."""
    model = found.final.model
    members: dict[str, list[int]] = {}
    for k, effect in enumerate(model.found):
        if effect.cause:
            members.setdefault(effect.name, []).append(k)
    everything = list(range(len(model.found)))
    views = (unseen, unseen.by(posture_regions(unseen.problem)))
    full = [view.squares(view.predict(everything)) for view in views]
    out = []
    for name, index in members.items():
        rest = [k for k in everything if k not in index]
        less = [view.squares(view.predict(rest)) for view in views]
        growths = [
            _growths(view, more, squares)
            for view, more, squares in zip(views, less, full, strict=True)
        ]
        sites = [
            (Site(name, model.found[k].site), unseen.rms(unseen.targets[1 + k])) for k in index
        ]
        sites.sort(key=lambda item: -item[1])
        fall = _between(unseen, less[0] - full[0])
        told = tuple(np.concatenate(growths).tolist())
        out.append(WeighedFamily(name, float(fall.mean()), told, tuple(sites)))
    return tuple(out)


def _growths(view: Unseen, less: Array, full: Array) -> Array:
    """Return by what share of itself the squared error of every part grows, shape (parts,)."""
    return np.asarray((_between(view, less) / np.maximum(_between(view, full), TINY)) - 1.0)


def _between(view: Unseen, squares: Array) -> Array:
    """Return the mean of squared errors in every part left out, shape (parts,)."""
    labels = view.trusted_labels()
    return np.array([squares[labels == part].mean() for part in np.unique(labels)])
