# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What counts as nothing beside something else, and how often a fit by weights is repeated."""

EMPTY = 1e-300
"""Least that anything is divided by: keeps a division by nothing, as a norm of zeros, finite."""
ROUNDING = 1e-12
"""Share of a number below which another beside it is its rounding."""
REPEATED = 1e-11
"""Added to a diagonal of ones, so that columns that repeat others do no harm; far above rounding."""
FLAT = 1e-9
"""A direction, or a column once others are projected out, of less than this share carries nothing."""
SLIGHT = 1e-6
"""Share of a number that decides nothing, though it is far above rounding."""
REWEIGHTED = 15
"""Times that something is found anew by weights of what it leaves; it settles within ten."""
HIDDEN = 0.05
"""Part of what an error does to the tool that fitted frames must leave of it for it to be told from
them: formulas are a few per cent off real arms, so that less says nothing of the error."""
NANOMETRE = 1e-9
"""Least error [m] divided by, far below any instrument."""
MICROMETRE = 1e-6
"""Least error [m] that any instrument sees."""
