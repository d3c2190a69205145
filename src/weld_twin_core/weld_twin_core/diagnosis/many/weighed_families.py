# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What each kind of many small errors accounts for on unseen data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..hypotheses.search import Search
from ..result import Site
from ..unseen.regions import posture_regions
from ..unseen.unseen_stretches import Unseen


@dataclass(frozen=True)
class WeighedFamily:
    """
    One kind of small error, and how much worse unseen data get without it.

    Attributes
    ----------
    effect : str
    fall : float
        Mean growth of the squared unseen error without the family, the rest as it is, [m^2].
    error : float
        Its standard error between stretches, [m^2].
    full : float
        Mean squared unseen error with everything, [m^2].
    members : tuple of (Site, float)
        Its members and how far each moves the tool, RMS [m], largest first.
    elsewhere : float
        ``fall`` over ``full`` on regions of posture left out, instead of stretches of time.

    """

    effect: str
    fall: float
    error: float
    full: float
    members: tuple[tuple[Site, float], ...]
    elsewhere: float = 0.0

    @property
    def rms_m(self) -> float:
        """Return what the family accounts for at the tool, RMS [m]."""
        return float(np.sqrt(max(self.fall, 0.0)))


def weighed_families(found: Search, unseen: Unseen) -> tuple[WeighedFamily, ...]:
    """Return what every family of the final model accounts for on unseen data."""
    model = found.final.model
    members: dict[str, list[int]] = {}
    for k, effect in enumerate(model.found):
        if effect.cause:
            members.setdefault(effect.name, []).append(k)
    everything = list(range(len(model.found)))
    full = unseen.squares(unseen.predict(everything))
    labels = unseen.trusted_labels()
    apart = unseen.by(posture_regions(unseen.problem))
    whole = apart.squares(apart.predict(everything)).mean()
    out = []
    for name, index in members.items():
        rest = [k for k in everything if k not in index]
        less = unseen.squares(unseen.predict(rest))
        gone = apart.squares(apart.predict(rest)).mean()
        falls = np.array([(less - full)[labels == b].mean() for b in np.unique(labels)])
        error = falls.std(ddof=1) / np.sqrt(falls.size) if falls.size > 1 else np.inf
        sites = [
            (Site(name, model.found[k].site), unseen.rms(unseen.targets[1 + k])) for k in index
        ]
        sites.sort(key=lambda item: -item[1])
        out.append(
            WeighedFamily(
                name,
                float(falls.mean()),
                float(error),
                float(full.mean()),
                tuple(sites),
                float(gone / max(whole, 1e-300)) - 1.0,
            )
        )
    return tuple(out)
