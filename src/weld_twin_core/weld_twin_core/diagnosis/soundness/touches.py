# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Contacts that are not what they are called: another socket, a slip, a place that was moved.

An arm as wrong as machines are is fitted first, all its constant errors and springs together; what
is far off then is no error of the arm. Such postures are told of and not fitted as what they were
called: those of another socket are counted there, a place that moved counts as two, a slip is left
out. Where known lengths cannot be, nothing is mended: files were mixed up.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...contacts import Artefact, Contact, Contacts
from ...recording import Recording
from ..algebra.fit import robust_fit, robust_scale
from ..algebra.independent_rows import robust_spread
from ..algebra.problem import Model, Problem
from ..frames.places import FEWEST, posed
from ..hypotheses.library import plain_causes
from ..result import Unsound
from .evidence import Finding, mistake

FAR = 8.0
"""Distance from its contact, in median distances, from which a posture is a slip: of normal errors
one in ten million is so far off; errors of gears are bounded."""
LEAST_SLIP = 1e-3
"""Distance [m] below which nothing is called a slip: gears and hands alone make tenths of it."""
NEARER = 0.3
"""A posture belongs to another contact where that is this much nearer than its own."""
EXPLAINED = 0.75
"""Share of a contact's squares that a move of its place must explain. What an arm's own errors leave
follows the order of postures too; of three measured arms they explained up to 0.6."""
STRETCH = 4
"""Postures in a row at the least that tell of a place that moved."""
BROKEN = 10.0
"""Uncertainties that a known length may be off before files are taken for mixed up, and"""
LEAST_BROKEN = 5e-3
"""how far it must be off for that at the least [m]."""


ROUNDS = 2
"""Times that an instrument's noise and that of contacts are told from each other anew; a third
changes nothing."""
FIT_ROWS = 6000
"""Rows of an instrument's recordings that are fitted along with contacts: far more than the errors
of an arm need."""
LEFT = 0.1
"""Share of a place's rows that is left at the least once its place was taken out."""
SUREST = 1e-6
"""Noise [m] below which none is told from less: no instrument and no socket is better."""


class Touched(NamedTuple):
    """What is diagnosed, what was told and mended, and what cannot be mended."""

    problem: Problem
    model: Model
    told: tuple[Unsound, ...]
    mistakes: tuple[Finding, ...]


def touches(problem: Problem, model: Model) -> Touched:
    """
    Return contacts as they are, and what was wrong with how they were called.

    Parameters
    ----------
    problem : Problem
        Of contacts.
    model : Model

    """
    plain = _plain_fit(problem, model)
    for _ in range(0 if problem.untracked else ROUNDS):
        problem = replace(problem, loose=_loose(problem, problem.residuals(plain)))
        plain = _plain_fit(problem, plain.with_found(()))
    rows = problem.residuals(plain)
    each = [k for k in range(len(problem.recordings)) if problem.contact(k) is not None]
    points = {
        k: plain.twin(k).poses(r, r.joints.t).position
        for k, r in enumerate(problem.recordings)
        if k in each
    }
    recordings = {k: problem.recordings[k] for k in each}
    broken = tuple(_broken(recordings, points))
    if broken:
        return Touched(problem, model, (), broken)
    usual = float(np.median(np.concatenate([np.linalg.norm(rows[k], axis=0) for k in each])))
    told: list[Unsound] = []
    kept = _resorted(recordings, points, usual, told)
    if not told:
        return Touched(problem, model, (), ())
    every = [kept.get(k, recording) for k, recording in enumerate(problem.recordings)]
    again, start = posed(every, model.robot, problem.align, model.known, problem.given)
    loose = dict(zip(problem.given, problem.loose, strict=False))
    again = replace(again, loose=tuple(loose[k] for k in again.given if loose))
    return Touched(again, start, tuple(told), ())


def _plain_fit(problem: Problem, model: Model) -> Model:
    """Return the model with all constant errors and springs fitted, outliers with little weight."""
    problem = problem.thinned(FIT_ROWS)
    view = problem.features(model)[0].view
    every = plain_causes(model.robot, view, ('constant', 'load'))
    start = model.with_found((*model.found, *every))
    scale = robust_scale(problem, problem.residuals(model))
    return robust_fit(problem, start, scale)[0].model


def _loose(problem: Problem, rows: list[Array]) -> tuple[float, ...]:
    """
    Return the noise of every recording in that of the surest, where an instrument and contacts are.

    A ball in its socket and a tracker differ by several times. What an arm as wrong as machines are
    leaves of each tells; the places of contacts took their share of it.
    """
    if problem.untracked:
        return ()
    of: dict[object, list[int]] = {}
    for k in range(len(rows)):
        touched = problem.contact(k) is not None
        of.setdefault(problem.given[k] if touched else 'instrument', []).append(k)
    noise = np.ones(len(rows))
    for own in of.values():
        every = np.concatenate([rows[k][:3].ravel() for k in own])
        taken = sum(u.freedom for k in own if (u := problem.contact(k)) is not None)
        left = max(1.0 - taken / every.size, LEFT)
        noise[own] = max(robust_spread(every) / np.sqrt(left), SUREST)
    return tuple(float(value) for value in noise / noise.min())


def _broken(recordings: Mapping[int, Recording], points: Mapping[int, Array]) -> Iterator[Finding]:
    """Yield known lengths that cannot be; a few postures in a wrong socket do not move a median."""
    middles = _middles(recordings, points)
    for recording in recordings.values():
        assert recording.contacts is not None
        for tie in recording.contacts.artefact.ties:
            if not set(tie.between) <= set(middles):
                continue
            one, other = tie.between
            found = float(np.linalg.norm(middles[one] - middles[other]))
            if abs(found - tie.value) < max(BROKEN * tie.sigma, LEAST_BROKEN):
                continue
            yield mistake(
                f'{one!r} and {other!r} are {tie.value * 1e3:.4g} mm apart by the artefact '
                f'and {found * 1e3:.4g} mm by the postures: files or labels are mixed up.',
                'other',
                tie.between,
                'Check which file belongs to which contact, and the length in the artefact',
            )


def _resorted(
    recordings: Mapping[int, Recording],
    points: Mapping[int, Array],
    usual: float,
    told: list[Unsound],
) -> dict[int, Recording]:
    """Return the recordings with postures where they belong, and say what was changed."""
    middles = _middles(recordings, points)
    out: dict[int, Recording] = {}
    for k, recording in recordings.items():
        contacts = recording.contacts
        assert contacts is not None
        labels = list(contacts.labels)
        keep = np.ones(contacts.size, dtype=bool)
        for contact in contacts.artefact.contacts:
            index = contacts.of(contact.label)
            if contact.kind != 'point':
                continue
            _strays(contact.label, index, points[k], middles, usual, labels, keep, told)
            _moved(contact.label, index[keep[index]], points[k], usual, labels, told)
        out[k] = _relabelled(recording, labels, keep)
    return out


def _middles(recordings: Mapping[int, Recording], points: Mapping[int, Array]) -> dict[str, Array]:
    """Return where every contact of a point is, by the median of its postures."""
    out = {}
    for k, recording in recordings.items():
        own = points[k]
        assert recording.contacts is not None
        for contact in recording.contacts.artefact.contacts:
            if contact.kind == 'point':
                out[contact.label] = np.median(own[recording.contacts.of(contact.label)], axis=0)
    return out


def _strays(
    label: str,
    index: np.ndarray,
    points: Array,
    middles: dict[str, Array],
    usual: float,
    labels: list[str],
    keep: np.ndarray,
    told: list[Unsound],
) -> None:
    """Leave out postures that rest elsewhere, and name where; a row of them may have moved."""
    away = np.linalg.norm(points[index] - middles[label], axis=1)
    far = away > max(FAR * usual, LEAST_SLIP)
    elsewhere: dict[str, list[int]] = {}
    for row, (k, off) in enumerate(zip(index, away, strict=True)):
        if far[row]:
            distances = {
                name: float(np.linalg.norm(points[k] - middle))
                for name, middle in middles.items()
                if name != label
            }
            nearest = min(distances, key=lambda name: distances[name], default='')
            found = nearest if nearest and distances[nearest] < NEARER * off else ''
            elsewhere.setdefault(found, []).append(row)
    for name, rows in elsewhere.items():
        if not name and len(rows) >= STRETCH and np.ptp(rows) == len(rows) - 1:
            continue
        keep[index[rows]] = False
        told.append(_told_stray(label, name, rows, float(away[rows].max())))


def _told_stray(label: str, name: str, rows: list[int], off: float) -> Unsound:
    which = _numbered(rows)
    if name:
        rest = 'rest' if len(rows) > 1 else 'rests'
        sentence = f'{which} of {label!r} {rest} in {name!r}, {off * 1e3:.1f} mm away.'
        return Unsound('other', (label, name), sentence, f'Label them {name!r}', True)
    lie = 'are up to' if len(rows) > 1 else 'is'
    sentence = f'{which} of {label!r} {lie} {off * 1e3:.1f} mm off: the contact slipped.'
    return Unsound('other', (label,), sentence, 'Touch again in these postures', True)


def _numbered(rows: list[int]) -> str:
    """Return postures by their number among those of a contact, counted from 1."""
    numbers = [str(row + 1) for row in rows]
    return f'Posture{"s" if len(rows) > 1 else ""} ' + ', '.join(numbers)


def _moved(
    label: str,
    index: np.ndarray,
    points: Array,
    usual: float,
    labels: list[str],
    told: list[Unsound],
) -> None:
    """Give postures in a row that rest together elsewhere a contact of their own."""
    if index.size < 2 * STRETCH:
        return
    first, last, shift, explained = _stretch(points[index])
    if explained < EXPLAINED or shift < max(2.0 * usual, LEAST_SLIP):
        return
    for k in index[first:last]:
        labels[k] = f'{label} moved'
    told.append(
        Unsound(
            'other',
            (label,),
            f'Postures {first + 1} to {last} of {label!r} rest {shift * 1e3:.1f} mm from the '
            'others: its place was moved while it was measured.',
            'Fasten the artefact, and measure this place again',
            True,
        )
    )


def _stretch(points: Array) -> tuple[int, int, float, float]:
    """Return the postures in a row that lie most apart: first, end, shift [m], share explained."""
    x = points - points.mean(axis=0)
    total = float((x**2).sum())
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(x, axis=0)])
    m, best = len(x), (0, 0, 0.0, 0.0)
    for i in range(m - STRETCH + 1):
        for j in range(i + STRETCH, m + 1):
            inside, outside = j - i, m - (j - i)
            if outside < STRETCH:
                continue
            part = sums[j] - sums[i]
            gain = float(part @ part) * (1.0 / inside + 1.0 / outside)
            if gain > best[3] * total:
                shift = float(np.linalg.norm(part)) * (1.0 / inside + 1.0 / outside)
                best = (i, j, shift, gain / max(total, 1e-300))
    first, last, shift, share = best
    # The shorter part is what is told of.
    if first == 0 and last > m // 2:
        first, last = last, m
    return first, last, shift, share


def _relabelled(recording: Recording, labels: list[str], keep: np.ndarray) -> Recording:
    """Return the recording with some postures left out and others under new labels."""
    contacts = recording.contacts
    assert contacts is not None
    index = np.flatnonzero(keep)
    few = {label for label in labels if sum(labels[k] == label for k in index) < FEWEST}
    index = np.array([k for k in index if labels[k] not in few], dtype=int)
    new = dict.fromkeys(labels[k] for k in index)
    known = {contact.label: contact for contact in contacts.artefact.contacts}
    artefact = Artefact(
        (*known.values(), *(Contact(label) for label in new if label not in known)),
        contacts.artefact.ties,
    )
    part = contacts.take(index)
    touched = Contacts(artefact, tuple(labels[k] for k in index), part.value, part.sigma)
    motion = replace(
        recording.joints, t=recording.joints.t[index], q=recording.joints.q[index], qd=None
    )
    return replace(recording, joints=motion, measured=None, contacts=touched)
