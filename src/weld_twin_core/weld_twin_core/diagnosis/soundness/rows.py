# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Does each measurement at rest belong to the station that it stands beside?

One reading that was missed or doubled shifts all that follow. What agrees with some rigid arm among the
stations before or behind gives the frames; with them each reading says at which station it was taken.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from ...arrays import Array
from ...recording import Recording
from ..algebra.problem import Model, Problem
from ..limits import CLEAR, FAR, FEW, RUN, UNEXPLAINED
from .evidence import Case, Finding, mistake
from .lengths import distance, listed
from .mending import repaired
from .snapshot import rough_models, snapshot

CHANGE = 2.0
"""Readings that another shift from some row on must bring back at the least. Where stations spread by
half a metre, one in some 10^4 readings is within `UNEXPLAINED` of a station that is not its own."""
NEAR = (0, 1, -1, 2, -2)
"""Rows that readings are shifted by while no arm is known yet."""

Rows = NDArray[np.int_]


def rows(case: Case) -> Iterator[Finding]:
    """Yield recordings of stations in which readings belong to other rows from some row on."""
    for k, recording in enumerate(case.recordings):
        off = distance(case.residuals[k])
        few = off.size < 2 * RUN or np.count_nonzero(off > UNEXPLAINED) <= CHANGE
        if recording.joints.static and recording.contacts is None and not few:
            known = case.model.known + case.model.changed(k)
            alone = Model(case.model.robot, (case.model.bases[k],), known)
            yield from _Stations(recording, alone, case.problem.align).shifted(k)


class _Pairing(NamedTuple):
    """The station of every reading, (M,), beyond both ends too; which agree with one; how far off."""

    station: Rows
    agrees: NDArray[np.bool_]
    off: Array

    @property
    def steps(self) -> list[tuple[int, int]]:
        """Return every row from which on another shift holds, and how many were missed before it."""
        step = np.diff(self.station - np.arange(self.station.size), prepend=0)
        return [(i, int(step[i])) for i in np.flatnonzero(step).tolist()]


class _Stations(NamedTuple):
    recording: Recording
    model: Model
    align: frozenset[str]

    def shifted(self, k: int) -> Iterator[Finding]:
        for start in self._starts():
            rough = _paired(self._apart(start), FAR)
            if rough.agrees.mean() < 1.0 - FEW:
                continue
            kept = np.flatnonzero(rough.agrees)
            arm = self._model(kept, rough.station[kept])
            apart = self._apart(arm)
            found = _paired(apart, UNEXPLAINED)
            if found.steps and found.agrees.mean() >= 1.0 - FEW:
                yield self._finding(k, found, apart)
            return

    def _starts(self) -> Iterator[Model]:
        """Yield models that may be right where most readings, or half of them, are in one row."""
        every = np.arange(self.recording.seen.t.size)
        yield self._model(every, every)
        shots = []
        for part in np.array_split(every, 2):
            for shift in NEAR:
                at = part + shift
                inside = (at >= 0) & (at < every.size)
                problem, motion = self._pairs(part[inside], at[inside])
                shots.append(snapshot(problem, self.model, [motion]))
        rough = zip(rough_models(shots, thorough=True), shots, strict=True)  # all at once
        yield from (shot.framed for model, shot in rough if shot.gap(model) < FAR)

    def _pairs(self, reading: Rows, station: Rows) -> tuple[Problem, Array]:
        seen = self.recording.seen
        own = self.recording.with_measured(replace(seen.take(reading), t=seen.t[station]))
        return Problem((own,), self.align), own.joints.at(seen.t[station])[0]

    def _model(self, reading: Rows, station: Rows) -> Model:
        """Return a plausible arm fitted to readings beside the stations of these rows."""
        _, first = np.unique(station, return_index=True)
        problem, motion = self._pairs(reading[first], station[first])
        return snapshot(problem, self.model, [motion]).arm.model

    def _apart(self, model: Model) -> Array:
        """Return how far every reading is from the tool at every station, (M, M) [m]."""
        seen = self.recording.seen
        tool = model.twin(0).poses(self.recording, seen.t).position
        return np.asarray(cdist(seen.position, tool))

    def _finding(self, k: int, found: _Pairing, apart: Array) -> Finding:
        count = found.station.size
        each = np.arange(count)
        alone = np.isin(each, np.unique(found.station, return_index=True)[1])
        clear = np.ones(count, dtype=bool)
        for shift in {0, *(found.station - each).tolist()}:
            other = each + shift
            inside = (other >= 0) & (other < count) & (other != found.station)
            near = apart[each[inside], other[inside]] < CLEAR * found.off[inside]
            clear[inside] &= ~near
        kept = np.flatnonzero(found.agrees & alone & clear)
        certain = kept.size >= (1.0 - FEW) * count
        make = partial(repaired, k=k, reading=kept, station=found.station[kept], count=count)
        off = int(np.count_nonzero(np.diagonal(apart) > UNEXPLAINED))
        done = (
            '; --apply does, and leaves out those that have none or stand twice' if certain else ''
        )
        return mistake(
            f'Measurements and joints of {self.recording.name} do not belong together row by row: '
            f'{listed([_words(*step) for step in found.steps])}. {off} of {count} stations are more '
            f'than {UNEXPLAINED * 1e3:.0f} mm off as they stand, and '
            f'{int(np.count_nonzero(~found.agrees))} where each reading is put beside its station.',
            'other',
            ('instrument',),
            f'Put each reading beside the station where it was taken{done}',
            make if certain else None,
        )


def _words(row: int, missed: int) -> str:
    many = 'one reading is' if abs(missed) == 1 else f'{abs(missed)} readings are'
    return f'{many} {"missing before" if missed > 0 else "too many at"} row {row + 1}'


def _paired(apart: Array, limit: float) -> _Pairing:
    """
    Return the station of every reading in order, where each one skipped or read again costs `CHANGE`.

    apart: how far readings are from stations, (M, M) [m]; beyond ``limit`` a reading is of none.
    """
    count = len(apart)
    cost = np.pad(np.minimum(apart / limit, 1.0), ((0, 0), (count, count)), constant_values=1.0)
    width = cost.shape[1]
    best = cost[0] + CHANGE * (np.arange(width) != count)
    came = np.zeros(cost.shape, dtype=int)
    for i in range(1, count):
        least = np.minimum.accumulate(best)
        # The last of those before that cost as little: no more is skipped than must be.
        lowest = np.maximum.accumulate(np.where(best <= least, np.arange(width), 0))
        onward = np.r_[np.inf, best[:-1]]
        came[i] = np.where(onward <= least + CHANGE, np.arange(width) - 1, lowest)
        best = cost[i] + np.minimum(onward, least + CHANGE)
    path = np.zeros(count, dtype=int)
    path[-1] = int(best.argmin())
    for i in range(count - 1, 0, -1):
        path[i - 1] = came[i, path[i]]
    station, each = path - count, np.arange(count)
    inside = (station >= 0) & (station < count)
    off = np.where(inside, apart[each, station.clip(0, count - 1)], np.inf)
    return _Pairing(station, off < limit, off)
