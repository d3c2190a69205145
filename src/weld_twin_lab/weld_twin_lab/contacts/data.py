# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Published postures of three arms whose ball rests in one of two sockets, at several places.

Each arm is a directory with a directory per place, which holds ``hole_0.csv`` and ``hole_1.csv``:
a row of joint angles [rad] per posture. The sockets are 50 mm apart, by a calliper.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.contacts import Artefact, Contact, Contacts, Tie
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_msgs_py.robots import load_robot

SOCKETS = 0.05
"""Distance of the sockets [m], as their drawing has it."""
CALLIPER = 1e-4
"""Its uncertainty [m]: what a calliper tells of a printed part."""
ARMS = {
    'panda_1': ('panda_nominal.urdf', 'panda_link0', 'ball_link'),
    'panda_2': ('panda_nominal.urdf', 'panda_link0', 'ball_link'),
    'kuka_14': ('kuka_iiwa14', None, None),
}
"""Robot file in the data's directory, or bundled robot, and its ends."""


def robot_of(data: Path, arm: str) -> Robot:
    """Return the nominal robot of one of `ARMS`."""
    spec, base, tip = ARMS[arm]
    return load_robot(data / spec if spec.endswith('.urdf') else spec, base, tip)


def places_of(data: Path, arm: str) -> tuple[str, ...]:
    """
    Return the places at which an arm was measured, in order of their names.

    Raises DataError: there are none.
    """
    folder = data / arm
    found = sorted(item.name for item in folder.glob('*') if (item / 'hole_0.csv').is_file())
    if not found:
        raise DataError(f"'{folder}' holds no place with hole_0.csv; --data names its parent")
    return tuple(found)


def touches(data: Path, arm: str, places: Sequence[str]) -> Recording:
    """
    Return the contacts of an arm at some places, as one recording.

    arm: one of `ARMS`.
    """
    postures, labels = [], []
    contacts, ties = [], []
    for place in places:
        names = [f'{place}/{socket}' for socket in (0, 1)]
        for socket, name in enumerate(names):
            path = data / arm / place / f'hole_{socket}.csv'
            rows = np.loadtxt(path, delimiter=',', ndmin=2)
            postures.append(rows)
            labels += [name] * len(rows)
            contacts.append(Contact(name))
        ties.append(Tie((names[0], names[1]), SOCKETS, CALLIPER))
    q = np.concatenate(postures)
    touched = Contacts(Artefact(tuple(contacts), tuple(ties)), tuple(labels))
    motion = JointMotion(np.arange(float(len(q))), q, static=True)
    return Recording(arm, motion, contacts=touched)
