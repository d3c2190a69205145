# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Saltelli's design and the estimators of Sobol indices as whole-array operations.

The same design and the same estimators as SALib's, which builds the one run by run and the other
input by input; with a model as fast as `draws` that would be most of the time. The tests hold
both against SALib.

References
----------
.. [1] A. Saltelli et al., "Variance based sensitivity analysis of model output", Computer Physics
   Communications 181, 2010.

"""

from __future__ import annotations

import numpy as np
from scipy.stats import qmc

from ..arrays import Array


def saltelli_design(inputs: int, base: int, seed: int) -> Array:
    """
    Return probabilities of every input, shape (base, inputs + 2, inputs).

    Of the runs of one base sample the first is A, the last is B, and run 1 + i is A with input i
    from B.
    """
    pair = qmc.Sobol(2 * inputs, scramble=True, seed=seed).random(base)
    first, second = pair[:, :inputs], pair[:, inputs:]
    out = np.empty((base, inputs + 2, inputs))
    out[:, :-1] = first[:, None]
    out[:, -1] = second
    each = np.arange(inputs)
    out[:, 1 + each, each] = second
    return out


def sobol_estimates(results: Array) -> tuple[Array, Array]:
    """Return first-order and total indices, shape (inputs,), of results (base, inputs + 2)."""
    values = (results - results.mean()) / results.std()
    first, second, mixed = values[:, 0], values[:, -1], values[:, 1:-1]
    scatter = values[:, [0, -1]].var()
    change = mixed - first[:, None]
    own: Array = second @ change / (len(values) * scatter)
    total: Array = 0.5 * (change * change).mean(axis=0) / scatter
    return own, total
