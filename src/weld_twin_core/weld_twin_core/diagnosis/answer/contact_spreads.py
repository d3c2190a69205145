# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How well contacts agree before and after, and on places that were not fitted."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...contacts import Length, lengths, spreads
from ...effects.plausible import spreads as spreads_of
from ..algebra.definite import outside, span_of
from ..algebra.motions import plain_causes
from ..algebra.open_directions import VISIBLE
from ..algebra.problem import Model, Problem
from ..evidence import Search
from ..result import ContactResult, KnownLength, Touched
from ..unseen.unseen_stretches import Unseen


def contact_spreads(result: Search, unseen: Unseen) -> ContactResult | None:
    """Return how far tool points are from contacts, also from places left out; else None."""
    problem = result.problem
    if not problem.touched:
        return None
    before, was = _of(problem, result.baseline.model)
    after, now = _of(problem, result.final.model)
    held = _held_out(unseen)
    three = before, after, held
    touched = tuple(
        Touched(label, before[label].size, *(float(each[label].mean()) for each in three))
        for label in before
    )
    known = tuple(
        KnownLength(a.tie.between, a.tie.kind, a.tie.value, a.tie.sigma, a.measured, b.measured)
        for a, b in zip(was, now, strict=True)
    )
    was_m, now_m, held_m = (float(np.concatenate([*own.values()]).mean()) for own in three)
    return ContactResult(was_m, now_m, held_m, touched, known, _not_seen(result))


def _not_seen(result: Search) -> tuple[str, ...]:
    """Return in words what no contact shows: errors as machines have them, below the noise."""
    problem, model, scale = result.problem, result.final.model, result.scale
    features = problem.features(model)
    frames = problem.whitened(problem.frame_columns(features)[0], scale)
    span, hidden = span_of(frames), dict[str, list[str]]()
    for effect in plain_causes(model.robot, features[0].view, ('constant',)):
        rows = problem.whitened(problem.effect_columns(features, effect), scale)
        remaining = np.linalg.norm(outside(rows, span), axis=1)
        size = remaining * spreads_of(model.robot, effect)
        if size.max(initial=0.0) < 1.0:
            hidden.setdefault(effect.name.replace('_', ' '), []).append(str(effect.site))
    listed = [f'{name} of {", ".join(sites)}' for name, sites in hidden.items()]
    return (*_base_hidden(result), *listed)


def _base_hidden(result: Search) -> tuple[str, ...]:
    """Return what of the base no contact shows: all of it unless places are known."""
    problem, model = result.problem, result.final.model
    if not problem.placed:
        return ('where the base stands',) if problem.untracked else ()
    rows = [
        problem.seen(k, np.stack([maker.column(('base', j)) for j in range(6)]))
        for k, maker in enumerate(problem.features(model))
    ]
    size = np.linalg.norm(problem.whitened(rows, result.scale), axis=1)
    shown = size * np.repeat(VISIBLE, 3) >= 1.0
    words = [f'the base along {axis}' for axis in 'xyz']
    words += [f'a turn of the base about {axis}' for axis in 'xyz']
    return tuple(text for text, seen in zip(words, shown, strict=True) if not seen)


def _of(problem: Problem, model: Model) -> tuple[dict[str, Array], list[Length]]:
    """Return distances from every contact and what is made of known lengths, at a model."""
    away: dict[str, Array] = {}
    known: list[Length] = []
    for k, recording in enumerate(problem.recordings):
        if recording.contacts is None:
            continue
        points = model.twin(k).poses(recording, recording.joints.t).position
        away |= spreads(recording.contacts, points)
        known += lengths(recording.contacts, points)
    return away, known


def _held_out(unseen: Unseen) -> dict[str, Array]:
    """Return distances from every contact as predicted where it was not fitted."""
    parts = unseen.problem.measured_rows(unseen.whole, unseen.scale)
    out: dict[str, Array] = {}
    for recording, rows in zip(unseen.problem.recordings, parts, strict=True):
        contacts = recording.contacts
        if contacts is None:
            continue
        for label in dict.fromkeys(contacts.labels):
            index = contacts.of(label)
            own = rows[index]
            if own.shape[1] == 3 and not contacts.artefact.named(label).known:
                own = own - own.mean(axis=0)
            out[label] = np.linalg.norm(own, axis=1)
    return out
