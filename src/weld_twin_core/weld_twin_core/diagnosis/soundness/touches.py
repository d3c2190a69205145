# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Contacts that are not what they are called: another socket, a slip, a place that was moved.

What is far off once an arm as wrong as machines are is fitted is no error of the arm. Postures of
another socket are counted there, a place that moved counts as two, a slip is left out. Where known
lengths cannot be, files were mixed up, and nothing is mended.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...contacts import Artefact, Contact, Contacts, Tie
from ...recording import Recording
from ..algebra.fit import robust_fit
from ..algebra.independent_rows import robust_spread
from ..algebra.motions import plain_causes
from ..algebra.posed import FEWEST
from ..algebra.problem import ROWS, Model, Problem
from ..frames.aligned import aligned
from ..limits import CLEAR, FEW, LARGE, RUN, STRAY, TINY, UNDONE, UNEXPLAINED, WORTH
from ..result import Unsound
from .evidence import Finding, mistake

SUREST = 1e-6
"""Noise [m] below which none is told from less: no instrument and no socket is better."""


class Touched(NamedTuple):
    """What is diagnosed, what was reported and mended, and what cannot be mended."""

    problem: Problem
    model: Model
    unsound: tuple[Unsound, ...] = ()
    mistakes: tuple[Finding, ...] = ()


def touches(problem: Problem, model: Model) -> Touched:
    """Return contacts as they are, and what was wrong with how they were called."""
    untied = _untied(problem, model)
    # Frames first: a tool point that is off by a hand's breadth is no error of the arm.
    plain = _fitted(untied, _with_plain_causes(problem, _fitted(untied, model)))
    # The noise of an instrument and that of contacts are told from each other in turn.
    for _ in range(0 if problem.untracked else 2):
        problem = replace(problem, loose=_loose(problem, problem.residuals(plain)))
        plain = _fitted(replace(untied, loose=problem.loose), plain)
    rows = problem.residuals(plain)
    every = {
        k: _Postures(r, plain.twin(k).poses(r, r.joints.t).position)
        for k, r in enumerate(problem.recordings)
        if problem.contact(k) is not None
    }
    middles = {label: at for own in every.values() for label, at in own.middles()}
    broken = tuple(mixed for own in every.values() for mixed in own.broken(middles))
    if broken:
        return Touched(problem, model, mistakes=broken)
    usual = float(np.median(np.concatenate([np.linalg.norm(rows[k], axis=0) for k in every])))
    if usual > UNEXPLAINED:
        return Touched(problem, model, mistakes=(_apart(usual),))
    reported = tuple(each for own in every.values() for each in own.resorted(middles, usual))
    if not reported:
        return Touched(problem, model)
    mended = [every[k].recording if k in every else r for k, r in enumerate(problem.recordings)]
    again, start = aligned(mended, model.robot, problem.align, model.known, problem.given)
    loose = dict(zip(problem.given, problem.loose, strict=False))
    again = replace(again, loose=tuple(loose[k] for k in again.given if loose))
    return Touched(again, start, reported)


def _apart(usual: float) -> Finding:
    return mistake(
        f'No place of what was touched and no plausible arm brings the tool point nearer than '
        f'{usual * 1e3:.3g} mm (median) to what it touched.',
        'other',
        (),
        'Check units (the artefact is in m), the joints, the tool of the robot file, and in which '
        'frame places are known',
    )


def _untied(problem: Problem, model: Model) -> Problem:
    """Return the problem without known lengths between points, which are held against the fit."""
    recordings = []
    for recording in problem.recordings:
        if (contacts := recording.contacts) is not None:
            artefact = contacts.artefact
            ties = tuple(tie for tie in artefact.ties if not _between_points(artefact, tie))
            contacts = replace(contacts, artefact=Artefact(artefact.contacts, ties))
            recording = replace(recording, contacts=contacts)
        recordings.append(recording)
    return replace(problem, recordings=tuple(recordings)).touching(model)


def _between_points(artefact: Artefact, tie: Tie) -> bool:
    return artefact.named(tie.between[0]).kind == 'point'


def _with_plain_causes(problem: Problem, model: Model) -> Model:
    """Return the model with all constant errors and springs, of no size yet."""
    view = problem.features(model)[0].view
    every = plain_causes(model.robot, view, ('constant', 'load'))
    return model.with_found((*model.found, *every))


def _fitted(problem: Problem, model: Model) -> Model:
    """Return the model fitted, outliers with little weight."""
    return robust_fit(problem.thinned(ROWS), model)[0].model


def _loose(problem: Problem, rows: list[Array]) -> tuple[float, ...]:
    """Return the noise of every recording in that of the surest."""
    of: dict[object, list[int]] = {}
    for k in range(len(rows)):
        touched = problem.contact(k) is not None
        of.setdefault(problem.given[k] if touched else 'instrument', []).append(k)
    noise = np.ones(len(rows))
    for own in of.values():
        every = np.concatenate([rows[k][:3].ravel() for k in own])
        taken = sum(u.freedom for k in own if (u := problem.contact(k)) is not None)
        remaining = max(1.0 - taken / every.size, FEW)
        noise[own] = max(robust_spread(every) / np.sqrt(remaining), SUREST)
    return tuple(float(value) for value in noise / noise.min())


class _Postures:
    """The postures of a recording with their tool points, (M, 3): what each touches; which count."""

    def __init__(self, recording: Recording, points: Array) -> None:
        self._given, self._contacts, self._points = recording, recording.touched, points
        self._labels = list(self._contacts.labels)
        self._keep = np.ones(self._contacts.size, dtype=bool)

    def _touched(self) -> Iterator[tuple[str, NDArray[np.int_]]]:
        for contact in self._contacts.artefact.contacts:
            if contact.kind == 'point':
                yield contact.label, self._contacts.of(contact.label)

    def middles(self) -> Iterator[tuple[str, Array]]:
        for label, index in self._touched():
            yield label, np.median(self._points[index], axis=0)

    def broken(self, middles: Mapping[str, Array]) -> Iterator[Finding]:
        """Yield known lengths that cannot be; a few postures in a wrong socket move no median."""
        for tie in self._contacts.artefact.ties:
            if not set(tie.between) <= set(middles):
                continue
            one, other = tie.between
            result = float(np.linalg.norm(middles[one] - middles[other]))
            if abs(result - tie.value) < max(STRAY * tie.sigma, UNDONE):
                continue
            yield mistake(
                f'{one!r} and {other!r} are {tie.value * 1e3:.4g} mm apart by the artefact '
                f'and {result * 1e3:.4g} mm by the postures: files or labels are mixed up, '
                'or the length is wrong.',
                'other',
                tie.between,
                'Check which file belongs to which contact, and the length in the artefact [m]',
            )

    def resorted(self, middles: Mapping[str, Array], usual: float) -> Iterator[Unsound]:
        for label, index in self._touched():
            yield from self._strays(label, index, middles, usual)
            yield from self._moved(label, index[self._keep[index]], usual)

    def _strays(
        self, label: str, index: NDArray[np.int_], middles: Mapping[str, Array], usual: float
    ) -> Iterator[Unsound]:
        """Leave out postures that rest elsewhere, and name where; a row of them may have moved."""
        others = {name: middle for name, middle in middles.items() if name != label}
        away = np.linalg.norm(self._points[index] - middles[label], axis=1)
        elsewhere: dict[str, list[int]] = {}
        for row in np.flatnonzero(away > max(STRAY * usual, LARGE)).tolist():
            point = self._points[index[row]]
            apart = {name: float(np.linalg.norm(point - at)) for name, at in others.items()}
            nearest = min(apart, key=lambda name: apart[name], default='')
            near = bool(nearest) and CLEAR * apart[nearest] < away[row]
            elsewhere.setdefault(nearest if near else '', []).append(row)
        for name, rows in elsewhere.items():
            if not name and len(rows) >= RUN and np.ptp(rows) == len(rows) - 1:
                continue
            self._keep[index[rows]] = False
            several = len(rows) > 1
            numbers = ', '.join(str(k + 1) for k in rows)
            which = f'Posture{"s" if several else ""} {numbers} of {label!r}'
            off = f'{float(away[rows].max()) * 1e3:.1f} mm'
            if name:
                rest = f'rest{"" if several else "s"} in {name!r}, {off} away.'
                yield _mended((label, name), f'{which} {rest}', f'Label them {name!r}')
            else:
                lie = f'{"are up to" if several else "is"} {off} off: the contact slipped.'
                again = 'Touch again in these postures'
                yield _mended((label,), f'{which} {lie}', again)

    def _moved(self, label: str, index: NDArray[np.int_], usual: float) -> Iterator[Unsound]:
        """Give postures in a row that rest together elsewhere a contact of their own."""
        if index.size < 2 * RUN:
            return
        first, last, shift, explained = _moved_run(self._points[index])
        # What an arm's own errors leave follows the order of postures too; of three measured arms they
        # explained up to 0.6.
        if explained < WORTH or shift < max(2.0 * usual, LARGE):
            return
        for k in index[first:last]:
            self._labels[k] = f'{label} moved'
        yield _mended(
            (label,),
            f'Postures {first + 1} to {last} of {label!r} rest {shift * 1e3:.1f} mm from the '
            'others: its place was moved while it was measured.',
            'Fasten the artefact, and measure this place again',
        )

    @property
    def recording(self) -> Recording:
        """Return the recording with the postures that count, under the labels they have now."""
        given, labels, artefact = self._given, self._labels, self._contacts.artefact
        counted = [label for label, kept in zip(labels, self._keep, strict=True) if kept]
        kept = np.flatnonzero(self._keep).tolist()
        index = [k for k in kept if counted.count(labels[k]) >= FEWEST]
        known = {contact.label for contact in artefact.contacts}
        new = dict.fromkeys(labels[k] for k in index if labels[k] not in known)
        artefact = Artefact((*artefact.contacts, *map(Contact, new)), artefact.ties)
        part = self._contacts.take(np.array(index, dtype=int))
        touched = Contacts(artefact, tuple(labels[k] for k in index), part.value, part.sigma)
        t, q = given.joints.t[index], given.joints.q[index]
        motion = replace(given.joints, t=t, q=q, qd=None)
        return replace(given, joints=motion, measured=None, contacts=touched)


def _mended(at: tuple[str, ...], sentence: str, remedy: str) -> Unsound:
    return Unsound('other', at, sentence, remedy, applied=True)


def _moved_run(points: Array) -> tuple[int, int, float, float]:
    """Return the postures in a row that lie most apart: first, end, shift [m], share explained."""
    x = points - points.mean(axis=0)
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(x, axis=0)])
    i, j = np.triu_indices(len(x) + 1, RUN)
    fair = len(x) - (j - i) >= RUN
    i, j = i[fair], j[fair]
    part, each = sums[j] - sums[i], 1.0 / (j - i) + 1.0 / (len(x) - (j - i))
    gain = (part**2).sum(axis=1) * each
    best = int(gain.argmax())
    first, last = int(i[best]), int(j[best])
    shift = float(np.linalg.norm(part[best]) * each[best])
    # The shorter part is what is reported.
    if first == 0 and last > len(x) // 2:
        first, last = last, len(x)
    return first, last, shift, float(gain[best]) / max(float((x**2).sum()), TINY**2)
