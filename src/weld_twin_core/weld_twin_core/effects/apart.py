# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What parts effects that move the tool alike on every motion of the joints."""

from __future__ import annotations

from collections.abc import Sequence

from .registry import REGISTRY

ELSE = 'mend whichever is easier, for anywhere in the workspace they differ by less than the noise'
"""What is said of all others."""


def way(families: Sequence[str]) -> str:
    """Return what tells causes of these families apart when no motion does."""
    names = set(families)
    for name in sorted(names & set(REGISTRY)):
        (other,) = names - {name} if len(names) == 2 else {name}
        way = REGISTRY[name].traits.apart.get(other)
        if way and len(names) < 3:
            return way
    return ELSE
