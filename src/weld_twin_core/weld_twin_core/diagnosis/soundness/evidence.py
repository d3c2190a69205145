# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What every check looks at: the recordings, the aligned model, and what it leaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...recording import Recording
from ..algebra.problem import ROWS, Model, Problem
from ..frames.alignment import refined
from ..limits import ENOUGH, FAR, FEW, HALVED, SOUND, TINY, UNEXPLAINED, WORTH
from ..result import Unsound
from .lag import Lag, lag
from .lengths import distance, middle_of_each, swept
from .mending import Mend, as_entry
from .slips import Rest, Settling, Slip, changes, rest_of
from .snapshot import Snapshot, snapshot


class Finding(NamedTuple):
    """
    What a check found: a 'note' or a 'warning' in a sentence for people, or a mistake.

    A mistake, level 'unsound', also has what `weld_twin_core.diagnosis.result.Unsound` tells.
    ``mend`` undoes it, None where nothing can; ``alike`` are kinds and places that would explain the
    data as well.
    """

    level: str
    sentence: str
    kind: str = ''
    at: tuple[str, ...] = ()
    remedy: str = ''
    mend: Mend | None = None
    alike: tuple[tuple[str, tuple[str, ...]], ...] = ()

    def as_unsound(self, *, applied: bool) -> Unsound:
        """Return what a diagnosis reports of a mistake, undone or not."""
        done = as_entry(self.mend)
        return Unsound(self.kind, self.at, self.sentence, self.remedy, applied, self.alike, done)


note, warning = partial(Finding, 'note'), partial(Finding, 'warning')
"""Return what a check found in a sentence."""
mistake = partial(Finding, 'unsound')
"""Returns the mistake of a sentence, kind, place and remedy."""


@dataclass(frozen=True, eq=False)
class Case:
    """The problem, the model after alignment, and what several checks need, computed once."""

    problem: Problem
    model: Model

    @property
    def recordings(self) -> tuple[Recording, ...]:
        return self.problem.recordings

    @cached_property
    def residuals(self) -> list[Array]:
        """Return measured minus twin, one array (3 or 6, M) per recording."""
        return self.problem.residuals(self.model)

    @cached_property
    def gap(self) -> float:
        """Return the median distance between measured and twin [m], or where a joint was swept."""
        return middle_of_each([distance(part) for part in self.residuals], self.swept)

    @cached_property
    def swept(self) -> tuple[NDArray[np.bool_], ...]:
        return swept(self._motions([None] * len(self.recordings)))

    @cached_property
    def tool_fixed(self) -> bool:
        """Return whether the tool is where the chain begins, as two arms hold one bar."""
        still = all((np.ptp(r.seen.position, axis=0) < TINY).all() for r in self.recordings)
        widest = max(float(np.ptp(q, axis=0).max()) for q in self.motions)
        return still and self.gap < FAR * widest

    @cached_property
    def lags(self) -> list[Lag | None]:
        """
        Return how late the measurements are; None where no lag explains the gap.

        Where nobody could use the data as they are, the clocks may be far apart. Of a gap that a
        sound arm may leave, a lag must explain more than the arm's own errors could: on a way out and
        back play is late both times, and later where the arm is slower.
        """
        result = self._explained(wide=False)
        if not any(result) and self.gap > UNEXPLAINED:
            result = self._explained(wide=True)
        if not any(result) or self.gap > SOUND:
            return result
        rest = self.rest[1]
        return [
            late if late is not None and late.after < WORTH * rest.rms(k) else None
            for k, late in enumerate(result)
        ]

    def _explained(self, *, wide: bool) -> list[Lag | None]:
        """Return lags that explain the gap, with frames fitted anew: at a wrong lag they hide it."""
        first = self._lags(self.model, wide=wide)
        late = [f if f is not None and f.after < (1.0 - FEW) * f.before else None for f in first]
        if not any(late):
            return [None] * len(late)
        shot = snapshot(self.problem, self.model, self._motions(late))
        model = refined(replace(shot.problem, align=self.problem.align), shot.model)
        pairs = zip(late, self._lags(model, wide=wide), strict=True)
        return [new if _believed(old, new) else None for old, new in pairs]

    def _lags(self, model: Model, *, wide: bool) -> list[Lag | None]:
        out: list[Lag | None] = [None] * len(self.recordings)
        for k, recording in enumerate(self.recordings):
            t, seen = recording.joints.t, recording.seen
            if not recording.joints.static and t.size >= ENOUGH:
                path = model.twin(k).poses(recording, t).position
                out[k] = lag(t, path, seen.t, seen.position, wide=wide)
        return out

    def _motions(self, lags: Sequence[Lag | None]) -> list[Array]:
        return [
            r.joints.at(r.seen.t if late is None else r.seen.t - late.at(r.seen.t))[0]
            for r, late in zip(self.recordings, lags, strict=True)
        ]

    @cached_property
    def motions(self) -> list[Array]:
        """Return joint positions at the measurements, lag undone, (M, n) per recording."""
        return self._motions(self.lags)

    @cached_property
    def rest(self) -> tuple[Problem, Rest]:
        """Return fewer measurements, and what frames and arm leave of them."""
        few = self.problem.thinned(ROWS)
        return few, rest_of(few.residuals(self.model), few, self.model)

    @cached_property
    def changes(self) -> list[Slip | Settling]:
        return changes(*self.rest, self.model.robot.joint_names, self.largest)

    @cached_property
    def largest(self) -> float:
        """Return how far the largest gaps are [m]; the last per cent may be outliers."""
        return max(float(np.quantile(distance(part), 1.0 - FEW**2)) for part in self.residuals)

    @property
    def slips(self) -> list[Slip]:
        return [each for each in self.changes if isinstance(each, Slip) and each.dated]

    @cached_property
    def snapshot(self) -> Snapshot:
        return snapshot(self.problem, self.model, self.motions)


def _believed(before: Lag | None, after: Lag | None) -> bool:
    """Return whether a lag explains most of the gap before it, and is one of clocks."""
    if before is None or after is None or abs(after.rate) > FEW:
        return False
    return HALVED * after.after < before.before and after.after < UNEXPLAINED
