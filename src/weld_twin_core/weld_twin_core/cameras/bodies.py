# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where cameras and targets are on their mounts, and where the tool was, from single images."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arm.rotation import rotation_vector
from ..arrays import Array
from ..errors import DataError
from .located import located
from .sightings import Sightings

_LEVER = 0.5
"""Length [m] at which a turn counts against a shift where views are compared: a tool's reach."""
_COMPARED = 60
"""Views that are compared with each other at the most, to find the one that most agree with."""


class _View(NamedTuple):
    """One target in one image: stamp, the bodies on the world and on the tool, and their relation."""

    image: int
    world: int
    tool: int
    pose: Array


@dataclass(frozen=True, eq=False)
class Bodies:
    """A start for everything that is not known."""

    poses: Array
    """Of cameras, then targets, each in the first body on its mount, shape (B, 4, 4)."""
    free: tuple[int, ...]
    """The bodies that are not the first of their mount."""
    tool: Array
    """The first body on the tool in the first of the world, at every stamp, shape (M, 4, 4)."""
    rows: NDArray[np.bool_]
    """Which sightings are of a stamp with a start, shape (N,)."""


def bodies(seen: Sightings) -> Bodies:
    """Return a start from what every image shows by itself; DataError where that is too little."""
    views = _views(seen)
    if not views:
        raise DataError(
            'no image shows four or more points of a target, and not all of them in a line; '
            'that many tell where the target is'
        )
    pairs = [(view.world, view.tool) for view in views]
    first = max(dict.fromkeys(pairs), key=pairs.count)
    known = {body: np.eye(4) for body in first}
    tool: dict[int, Array] = {}
    while True:
        for view in views:
            if view.image not in tool and view.world in known and view.tool in known:
                there = np.linalg.inv(known[view.tool])
                tool[view.image] = known[view.world] @ view.pose @ there
        fresh = _joined(views, known, tool)
        if not fresh:
            break
        known |= fresh
    used = {*seen.camera.tolist(), *(len(seen.cameras) + seen.target).tolist()}
    _all_joined(seen, used - set(known), first)
    poses = np.stack([known.get(k, np.eye(4)) for k in range(_count(seen))])
    free = tuple(sorted(used - set(first)))
    stamps = np.array(sorted(tool))
    return Bodies(poses, free, np.stack([tool[k] for k in stamps]), np.isin(seen.image, stamps))


def _count(seen: Sightings) -> int:
    return len(seen.cameras) + len(seen.targets)


def _views(seen: Sightings) -> list[_View]:
    """Return where every target is in every image of every camera, where the image settles it."""
    key = (seen.image * len(seen.cameras) + seen.camera) * len(seen.targets) + seen.target
    order = np.argsort(key, kind='stable')
    starts = np.flatnonzero(np.diff(key[order], prepend=-1))
    out = []
    for rows in np.split(order, starts[1:]) if order.size else []:
        c, t = int(seen.camera[rows[0]]), int(seen.target[rows[0]])
        points = seen.targets[t].points[seen.point[rows]]
        pose = located(seen.cameras[c].lens, points, seen.pixel[rows])
        if pose is None:
            continue
        image, body = int(seen.image[rows[0]]), len(seen.cameras) + t
        if seen.cameras[c].mount == 'world':
            out.append(_View(image, c, body, pose))
        else:
            out.append(_View(image, body, c, np.asarray(np.linalg.inv(pose), float)))
    return out


def _joined(
    views: Sequence[_View], known: dict[int, Array], tool: dict[int, Array]
) -> dict[int, Array]:
    """Return bodies that were not known, from views at stamps at which the tool is."""
    tried: dict[int, list[Array]] = {}
    for view in views:
        if view.image not in tool or (view.world in known) == (view.tool in known):
            continue
        here = tool[view.image]
        if view.tool in known:
            pose = here @ known[view.tool] @ np.linalg.inv(view.pose)
            tried.setdefault(view.world, []).append(pose)
        else:
            pose = np.linalg.inv(here) @ known[view.world] @ view.pose
            tried.setdefault(view.tool, []).append(pose)
    return {body: _agreed(np.stack(poses)) for body, poses in tried.items()}


def _agreed(poses: Array) -> Array:
    """Return the pose that most others are near to."""
    some = poses[np.linspace(0, len(poses) - 1, min(len(poses), _COMPARED)).astype(int)]
    shift = np.linalg.norm(some[:, None, :3, 3] - some[None, :, :3, 3], axis=-1)
    turn = rotation_vector(some[:, None, :3, :3] @ np.swapaxes(some[None, :, :3, :3], -1, -2))
    away = shift + _LEVER * np.linalg.norm(turn, axis=-1)
    return np.asarray(some[int(np.argmin(np.median(away, axis=1)))])


def _all_joined(seen: Sightings, lost: set[int], first: tuple[int, int]) -> None:
    names = [*(f'camera {c.name!r}' for c in seen.cameras)]
    names += [f'target {t.name!r}' for t in seen.targets]
    for body in sorted(lost):
        raise DataError(
            f'{names[body]} is in no image of a stamp that shows where it is beside '
            f'{names[first[0]]} and {names[first[1]]}; give it in a recording of its own, or take '
            'images at the same stamps'
        )
