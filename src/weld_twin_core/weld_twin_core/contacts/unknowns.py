# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The unknown places taken out of residuals, so that no hypothesis has to fit them.

A place is best where it makes the squares least. With its unknowns z linear, r + K z, and known
lengths as further rows G z of their own uncertainty, the least sum of squares is r' S r with
S = I - K (K'K + G'G)^-1 K'. Rows times the root of S are therefore what is left of a residual, and
of every column, once the places were fitted; without known lengths the root is the projection.
This is variable projection [1]_.

References
----------
.. [1] L. Kaufman, "A variable projection method for solving separable nonlinear least squares
   problems", BIT 15, 1975.

"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from .artefact import Contacts
from .places import places

_RANK = 1e-9
"""Share of the largest singular value below which a combination of unknowns is not determined."""


@dataclass(frozen=True, eq=False)
class Unknowns:
    """What one place has of unknowns, at one set of tool points."""

    seen: Array
    """What each row sees of a displacement of the tool point, shape (M, c, 3)."""
    free: Array
    """Change of each row with the unknowns, shape (M, c, Z)."""
    ties: Array
    """Change of what is known with the unknowns, over its uncertainty [1/m], shape (T, Z)."""

    def eliminated(self, unit: Array) -> tuple[Array, Array]:
        """
        Return orthonormal directions (k, rows) that places can take up, and the share they leave.

        Whitened rows, by ``unit`` (M,) [1/m] in each posture, lose ``(1 - left) * u (u' rows)``
        along each.
        """
        count = self.free.shape[0] * self.free.shape[1]
        columns = (unit[:, None, None] * self.free).reshape(count, -1)
        both = np.concatenate([columns, self.ties])
        size = np.maximum(np.linalg.norm(both, axis=0), 1e-300)
        basis, strength, _ = np.linalg.svd(both / size, full_matrices=False)
        basis = basis[:count, strength > _RANK * strength.max(initial=0.0)]
        directions, taken, _ = np.linalg.svd(basis, full_matrices=False)
        remaining = np.sqrt(np.clip(1.0 - taken**2, 0.0, 1.0))
        return directions.T, np.where(remaining < 1e-7, 0.0, remaining)

    @property
    def freedom(self) -> int:
        """Return the number of unknowns."""
        return int(self.free.shape[2])


def unknowns(contacts: Contacts, points: Array) -> Unknowns:
    """Return the unknowns of the contacts of a place at tool points, shape (M, 3) [m]."""
    here = places(contacts, points)
    _, seen, free = here.rows(points)
    _, change, sigma = here.ties()
    return Unknowns(seen, free, change / sigma[:, None])
