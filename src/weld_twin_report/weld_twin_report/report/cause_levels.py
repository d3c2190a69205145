# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is certain of each cause: its place, what it depends on, its name, and its curve."""

from __future__ import annotations

import numpy as np

from weld_twin_core.diagnosis.result import Cause, Diagnosis, Site
from weld_twin_nodes.wording.quantities import odds, with_ends
from weld_twin_nodes.wording.words import CURVES, DEPENDENCES, place_name, site_name, unnamed

LEVEL_HEADS = ('Share of the gap', 'Where', 'Depends on', 'Name')


def level_row(cause: Cause) -> list[str]:
    """Return share, place, dependence and name of a cause, each with its odds."""
    value, ends = with_ends(cause.share, *cause.share_ci90)
    return [
        f'{value} ({ends})',
        _alternatives([(place_name(at), p) for at, p in cause.place]),
        _alternatives([(DEPENDENCES.get(on, on), p) for on, p in cause.dependence]),
        _names(cause),
    ]


def _alternatives(told: list[tuple[str, float]]) -> str:
    return ', '.join(f'{name} ({odds(p)})' for name, p in told[:3])


def _names(cause: Cause) -> str:
    named = [(site, p) for site, p in cause.name if site.effect not in CURVES]
    if unnamed(cause):
        return 'none that was tried'
    return _alternatives([(site_name(site), p) for site, p in named])


def spreads(diagnosis: Diagnosis) -> list[np.ndarray | None]:
    """Return the covariance of every found effect's coordinates, None where it is not known."""
    found = diagnosis.model.found
    posterior = diagnosis.posterior
    if posterior is None:
        return [None] * len(found)
    what = posterior.directions
    starts = what.frame_count + np.concatenate([[0], np.cumsum(what.sizes)]).astype(int)
    out: list[np.ndarray | None] = []
    for effect in found:
        matching = [
            k
            for k, other in enumerate(what.effects)
            if Site(other.name, other.site) == Site(effect.name, effect.site)
            and other.key == effect.key
        ]
        if not matching:
            out.append(None)
            continue
        rows = slice(starts[matching[0]], starts[matching[0] + 1])
        out.append(posterior.covariance[rows, rows])
    return out
