# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The effects that a verdict names, with their standard errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...effects.effect import Effect
from ..hypotheses.search import Search
from ..result import Cause, Found, Site
from ..unseen.unseen_stretches import Unseen
from ..verdict.decision import Verdict
from .standard_errors import standard_errors

LEAST_SHARE = 1e-3
"""Share of the rows that counts as independent at the least; keeps a division finite."""


def named_effects(
    found: Search, unseen: Unseen, verdict: Verdict, causes: Sequence[Cause]
) -> tuple[tuple[Found, ...], Verdict, tuple[Cause, ...]]:
    """
    Return the effects told, those that move the tool most first.

    Parameters
    ----------
    unseen : Unseen
        Of the final model; tells how far each effect moves the tool.

    Returns
    -------
    effects : tuple of Found
    verdict : Verdict
        With its sets in the same order.
    causes : tuple of Cause
        Each with its index in both.

    """
    model = found.final.model
    told = _told(model.found, verdict, causes, dense=found.dense)
    squares = (unseen.targets[1:] ** 2).sum(axis=1)
    told.sort(key=lambda pair: -squares[pair[0]])
    if not told:
        return (), replace(verdict, sets=()), tuple(replace(c, effect=None) for c in causes)
    share = max(found.effective(found.small) / found.small.residual.size, LEAST_SHARE)
    errors = standard_errors(found.problem, model, found.scale, found.precision, share)
    effects = tuple(Found(model.found[member], errors[member]) for member, _ in told)
    at = {group: k for k, (_, group) in enumerate(told)}
    return (
        effects,
        replace(verdict, sets=tuple(verdict.sets[group] for _, group in told)),
        tuple(replace(c, effect=None if c.effect is None else at.get(c.effect)) for c in causes),
    )


def _told(
    model: Sequence[Effect], verdict: Verdict, causes: Sequence[Cause], *, dense: bool
) -> list[tuple[int, int]]:
    """Return which effects of the model are told, each with the number of its set."""
    if not dense:
        return [(c.members[0], c.effect) for c in causes if c.effect is not None]
    sites = [Site(effect.name, effect.site) for effect in model]
    return [
        (sites.index(site), k)
        for k, group in enumerate(verdict.sets)
        for site in group[:1]
        if site in sites
    ]
