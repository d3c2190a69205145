# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Contacts in a bag: one message for every posture in which the tool point touched something."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.contacts import Artefact, Contact, Contacts
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Recording

from ..messages.from_messages import stamp_ns
from ..messages.topics import CONTACT, TopicNames
from .reader import BagReader


class Mark(NamedTuple):
    """That something was touched: stamp [ns], label, length and its deviation [m]."""

    ns: int
    label: str
    value: float
    sigma: float


def marks(bag: BagReader, names: TopicNames) -> list[Mark]:
    """
    Return the contacts of a bag, in the order of their stamps; none where it holds none.

    Raises DataError: a contact has no label or no stamp, two have the same stamp, or the topic is
    of another type.
    """
    kind, count = bag.topics.get(names.contact, ('', 0))
    if not count:
        return []
    if kind != CONTACT.type:
        raise DataError(
            f"topic '{names.contact}' has the type {kind}, but contacts are of {CONTACT.type}"
        )
    out: list[Mark] = []
    for topic, _, _, message in bag.messages([names.contact]):
        label = message.header.frame_id
        if not label:
            raise DataError(
                f"message {len(out)} of '{topic}' has no label; put what was touched in "
                'header.frame_id'
            )
        value, variance = float(message.range), float(message.variance)
        if not (np.isfinite(value) and np.isfinite(variance) and variance >= 0.0):
            raise DataError(f"message {len(out)} of '{topic}' holds numbers that are not finite")
        out.append(Mark(stamp_ns(message), label, value, float(np.sqrt(variance))))
    out.sort(key=lambda mark: mark.ns)
    for before, after in pairwise(out):
        if before.ns == after.ns:
            raise DataError(f"two contacts of '{names.contact}' have the stamp {after.ns} ns")
    return out


def touching(recording: Recording, each: list[Mark], made: Mapping[str, Any]) -> Recording:
    """
    Return the recording as stations, one for every contact.

    Raises DataError: a contact lies outside the joint states, or is not in the artefact.

    recording: with the joint states, as they came.
    made: how the bag was made; may hold the artefact. Without one every label is a point, or a
    length where the messages hold one.
    """
    ns = np.array([mark.ns for mark in each])
    t = (ns - recording.epoch_ns) * 1e-9
    motion = recording.joints
    if t[0] < motion.t[0] - 1e-9 or t[-1] > motion.t[-1] + 1e-9:
        raise DataError(
            f'contacts of {recording.name} lie from {t[0]:.3f} to {t[-1]:.3f} s, its joint states '
            f'from {motion.t[0]:.3f} to {motion.t[-1]:.3f} s; record both together'
        )
    value = np.array([mark.value for mark in each])
    sigma = np.array([mark.sigma for mark in each])
    labels = tuple(mark.label for mark in each)
    entry = made.get('artefact')
    artefact = Artefact.from_mapping(entry) if entry else _plain(labels, value)
    contacts = Contacts(
        artefact, labels, value if value.any() else None, sigma if sigma.all() else None
    )
    stations = JointMotion(t, motion.at(t)[0], static=True)
    return replace(recording, joints=stations, measured=None, contacts=contacts)


def _plain(labels: tuple[str, ...], value: np.ndarray) -> Artefact:
    """Return the artefact of which nothing was said: points, or lengths where they have one."""
    long = {label for label, length in zip(labels, value, strict=True) if length > 0.0}
    names = dict.fromkeys(labels)
    return Artefact(tuple(Contact(n, 'length' if n in long else 'point') for n in names))
