# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a verdict is drawn from, as plain values."""

from __future__ import annotations

from dataclasses import dataclass

from ..hypotheses.rivals import Rival
from ..many.weighed_families import WeighedFamily
from ..unseen.leftover_structure import Structure


@dataclass(frozen=True, eq=False)
class Evidence:
    """
    What the verdict is drawn from.

    Attributes
    ----------
    slots : tuple of tuple of Rival
        For every found effect, itself and its rivals, most probable first.
    structure : Structure
        What generic columns still find.
    gap, after, floor : float
        RMS on unseen data before and after, and of the noise, [m].
    fitted : float
        RMS after on unseen stretches of the recordings fitted, [m]; the same as ``after`` where
        nothing was held out.
    independent : bool
        Whether the floor was measured apart from any model.
    parts : tuple of float
        Squared contribution of every effect over the square of their sum.
    refused : tuple of str
        What would explain the rest best but no machine has, in words.
    lacking : tuple of str
        What was taken out of the library and fits clearly better than what was found, in words.
    families : tuple of WeighedFamily, optional
        Where many small errors were fitted together: what each kind accounts for.
    least : float, optional
        Least RMS [m] on held-out data over what could be in the model, one rival at a time; left
        out, it is ``after``.
    chance : float
        Ratio of ``after`` to ``fitted`` that chance alone reaches: few stations vary much.
    believed : tuple of float
        How probable it is of every effect found that its name is right, as the calibration has it;
        of many small errors, of all that are named.
    missed : tuple of (str, str)
        Places at which something free predicts beyond doubt what the formula of a name should, and
        that in words; at 'instrument' it speaks against every name.

    """

    slots: tuple[tuple[Rival, ...], ...]
    structure: Structure
    gap: float
    after: float
    floor: float
    fitted: float
    independent: bool
    parts: tuple[float, ...]
    refused: tuple[str, ...] = ()
    lacking: tuple[str, ...] = ()
    families: tuple[WeighedFamily, ...] | None = None
    least: float | None = None
    chance: float = 1.0
    believed: tuple[float, ...] = ()
    missed: tuple[tuple[str, str], ...] = ()
