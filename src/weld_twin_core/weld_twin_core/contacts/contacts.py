# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which posture touched what."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, readonly
from ..errors import DataError
from .artefact import Artefact


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contacts of the tool point, one for every posture; DataError for one that is not known."""

    artefact: Artefact
    labels: tuple[str, ...]
    """What each posture touched."""
    value: Array | None = None
    """Measured distance from the centre, of contacts of kind 'length', shape (M,) [m]."""
    sigma: Array | None = None
    """Standard deviation of each contact, where known, shape (M,) [m]."""

    def __post_init__(self) -> None:
        for label in dict.fromkeys(self.labels):
            self.artefact.named(label)
        count = (len(self.labels),)
        for name in ('value', 'sigma'):
            given = getattr(self, name)
            if given is not None:
                object.__setattr__(self, name, readonly(given, count, f'{name} of the contacts'))
        if self.sigma is not None and not (self.sigma > 0.0).all():
            raise DataError('sigma of the contacts must be positive [m]')
        lengths = [self.artefact.named(label).kind == 'length' for label in self.labels]
        if any(lengths) and (self.value is None or (self.value[lengths] <= 0.0).any()):
            raise DataError(
                'a contact of kind length needs the measured distance in the column value [m]'
            )

    @property
    def size(self) -> int:
        """Return the number of postures."""
        return len(self.labels)

    def of(self, label: str) -> NDArray[np.intp]:
        """Return the postures that touched one contact."""
        return np.flatnonzero(np.array(self.labels) == label)

    def take(self, index: NDArray[np.intp]) -> Contacts:
        """Return some of the postures, and of the artefact what they touched."""
        labels = tuple(self.labels[k] for k in index)
        return Contacts(
            self.artefact.part(labels),
            labels,
            None if self.value is None else self.value[index],
            None if self.sigma is None else self.sigma[index],
        )

    def parts(self) -> list[NDArray[np.intp]]:
        """Return the postures of every place: contacts that hang together, one kind each."""
        touched = self.artefact.part(self.labels)
        out = []
        for group in touched.groups():
            index = np.flatnonzero(np.isin(self.labels, group))
            out.append(index)
        return out

    @property
    def rows(self) -> int:
        """Return the scalar rows of a posture: 3 for points, 2 for a line, 1 for the others."""
        return max(_ROWS[self.artefact.named(label).kind] for label in set(self.labels))


_ROWS = {'point': 3, 'line': 2, 'length': 1, 'sphere': 1, 'plane': 1}
"""Scalar rows that one posture gives."""
