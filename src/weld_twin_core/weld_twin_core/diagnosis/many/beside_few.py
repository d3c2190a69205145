# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How many small errors there are beside the few that were found one by one.

Fitted in the place of one large error, dozens of others share it: a wrong scale of the instrument
looks like ten wrong links. With the large one fitted along, and the sizes of the others learned
anew, they shrink to nothing if that is all there is.
"""

from __future__ import annotations

import numpy as np

from ..algebra.fit import design
from ..beliefs import Beliefs
from ..hypotheses.search import Search
from ..unseen.unseen_stretches import Unseen
from .shrinkage import believed, groups, learned_precision, projected


def members_beside(few: Search, many: Search, beliefs: Beliefs) -> int:
    """
    Return how many of many effects move the tool by much of what all of them leave.

    Parameters
    ----------
    few, many : Search
        What was found one by one, and all kinds fitted together.
    beliefs : Beliefs

    """
    unseen = Unseen.of(many.problem, many.scale, many.final, many.precision)
    problem, scale, model = many.problem, many.scale, few.final.model
    have = {effect.key for effect in model.found}
    others = tuple(effect for effect in many.final.model.found if effect.key not in have)
    if not others:
        return 0
    own, _ = design(problem, model, scale)
    features = problem.features(model)
    each = [
        problem.whitened(problem.effect_columns(features, effect, atoms=False), scale)
        for effect in others
    ]
    columns = np.concatenate([own, *each])
    residual = problem.whitened(problem.residuals(model), scale)
    normal, right, rss = projected(
        columns @ columns.T, columns @ residual, float(residual @ residual), len(own)
    )
    labels, scales = groups(others, beliefs)
    held = believed(model.with_found(others))
    ridge, _ = learned_precision(normal, right, rss, residual.size, labels, scales, held)
    mean = np.linalg.lstsq(normal + np.diag(ridge), right, rcond=1e-12)[0]
    basis = np.linalg.lstsq(own.T, columns[len(own) :].T, rcond=1e-12)[0]
    parts = mean[:, None] * (columns[len(own) :] - basis.T @ own)
    least = beliefs.member * unseen.rms(unseen.base(range(len(unseen.parts))).residual)
    ends = np.cumsum([len(part) for part in each])[:-1]
    return sum(unseen.rms(part.sum(axis=0)) > least for part in np.split(parts, ends))
