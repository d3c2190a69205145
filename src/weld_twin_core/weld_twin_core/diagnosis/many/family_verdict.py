# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The verdict when many small errors act together: families are named, with their members."""

from __future__ import annotations

import numpy as np

from ..hypotheses.search import Search
from ..result import Family, Site
from ..unseen.unseen_stretches import Unseen
from ..verdict.decision import STRUCTURE, Evidence, Verdict

WORTH = 0.03
"""A family whose absence raises the squared unseen error by less than this is not named."""
FAMILIES = 0.75
"""Belief in the families named where nothing is left; a judgement, as dozens of errors at once are
seldom put together on purpose."""
CERTAIN = 2.0
LEAST = 1e-6
"""A member that moves the tool by less [m] is nobody's concern."""


def family_verdict(found: Search, unseen: Unseen, evidence: Evidence) -> Verdict:
    """Return the families that earn their place on unseen data, each with its members."""
    families = weighed(found, unseen)
    sets = tuple((site,) for family in families if family.named for site, _ in family.members)
    left = evidence.left
    status = 'unknown' if left > STRUCTURE else 'identified'
    reasons = (
        'many small errors act together; members of one family are fitted jointly and only their '
        'sum is certain',
    )
    sure = FAMILIES / (1.0 + (left / STRUCTURE) ** 3)
    return Verdict(status, sure, sets, reasons, families)


def weighed(found: Search, unseen: Unseen) -> tuple[Family, ...]:
    """Return every family with what it accounts for on unseen data, largest first."""
    model = found.final.model
    members: dict[str, list[int]] = {}
    for k, effect in enumerate(model.found):
        if effect.cause:
            members.setdefault(effect.name, []).append(k)
    everything = list(range(len(model.found)))
    full = unseen.squares(unseen.predict(everything))
    labels = unseen.trusted_labels()
    out = []
    for name, index in members.items():
        less = unseen.squares(unseen.predict([k for k in everything if k not in index]))
        falls = np.array([(less - full)[labels == b].mean() for b in np.unique(labels)])
        error = falls.std(ddof=1) / np.sqrt(falls.size) if falls.size > 1 else np.inf
        named = bool(falls.mean() > max(WORTH * full.mean(), CERTAIN * error))
        size = float(np.sqrt(max(falls.mean(), 0.0)))
        sites = [
            (Site(name, model.found[k].site), unseen.rms(unseen.targets[1 + k])) for k in index
        ]
        sites = [item for item in sites if item[1] > LEAST]
        sites.sort(key=lambda item: -item[1])
        if sites:
            out.append(Family(name, named, size, tuple(sites)))
    return tuple(sorted(out, key=lambda family: -family.rms_m))
