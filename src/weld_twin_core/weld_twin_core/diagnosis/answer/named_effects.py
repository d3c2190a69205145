# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The effects that a verdict names, with their standard errors."""

from __future__ import annotations

from ..hypotheses.search import Search
from ..result import Found, Site
from ..unseen.unseen_stretches import Unseen
from ..verdict.decision import Verdict
from .standard_errors import standard_errors

LEAST_SHARE = 1e-3
"""Share of the rows that counts as independent at the least; keeps a division finite."""


def named_effects(found: Search, unseen: Unseen, verdict: Verdict) -> tuple[Found, ...]:
    """
    Return the effects named, those that move the tool most first.

    Parameters
    ----------
    found : Search
    unseen : Unseen
        Of the final model; tells how far each effect moves the tool.
    verdict : Verdict

    """
    if verdict.status in ('none', 'unknown') and not verdict.sets:
        return ()
    model = found.final.model
    squares = (unseen.targets[1:] ** 2).sum(axis=1)
    share = max(found.effective(found.small) / found.small.residual.size, LEAST_SHARE)
    errors = standard_errors(found.problem, model, found.scale, found.precision, share)
    named = {site for group in verdict.sets for site in group}
    out = [
        (squares[k], Found(effect, errors[k]))
        for k, effect in enumerate(model.found)
        if Site(effect.name, effect.site) in named
    ]
    return tuple(item for _, item in sorted(out, key=lambda pair: -pair[0]))
