# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What cameras saw in a bag: one message of points for every image of a camera."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from weld_twin_core.bundle import seen_by
from weld_twin_core.cameras import Camera, Sightings, Target, described
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Recording

from ..messages.from_messages import stamp_ns
from ..messages.image_points import FIELDS, TAGS, Marks, corners, points
from ..messages.topics import IMAGE_POINTS, TopicNames
from .reader import BagReader

Image = tuple[int, str, np.ndarray | Marks]
"""Stamp [ns], camera, and rows of target, point, u and v; or corners of tags by their labels."""
READ: Mapping[str, Callable[[Any], np.ndarray | Marks]] = {
    IMAGE_POINTS.type: points,
    TAGS: corners,
}
"""What takes the points out of a message of either type."""


def images(bag: BagReader, names: TopicNames) -> list[Image]:
    """Return the images of a bag, in the order of their stamps; none where it holds none."""
    kind, count = bag.topics.get(names.images, ('', 0))
    if not count:
        return []
    if kind not in READ:
        raise DataError(
            f"topic '{names.images}' has the type {kind}, but points in images are of "
            f'{" or ".join(READ)}'
        )
    out: list[Image] = []
    for topic, _, _, message in bag.messages([names.images]):
        try:
            out.append((stamp_ns(message), message.header.frame_id, READ[kind](message)))
        except DataError as error:
            raise DataError(f"message {len(out)} of '{topic}': {error}") from None
    return sorted(out, key=lambda image: image[0])


def looking(
    recording: Recording, each: Sequence[Image], names: TopicNames, made: Mapping[str, Any]
) -> Recording:
    """Return the recording with poses that its images tell."""
    cameras, targets = _described(names, made)
    stamps = sorted({ns for ns, _, _ in each})
    whole = np.concatenate(_rows(each, stamps, cameras, targets))
    if not len(whole):
        raise DataError(
            'the images show no point of a target that is described; give the target with its '
            'tags: --target NAME=FILE'
        )
    image, camera_, target = (whole[:, k].astype(int) for k in range(3))
    if whole.size and not 0 <= target.min() <= target.max() < len(targets):
        raise DataError(
            f'the images show target {target.max()}, counted from 0, but {len(targets)} are '
            'described; give each with --target NAME=FILE, in that order'
        )
    t = (np.array(stamps) - recording.epoch_ns) * 1e-9
    point = _points(tuple(targets.values()), target, whole[:, 3].astype(int))
    return seen_by(
        recording,
        Sightings(
            tuple(cameras.values()),
            tuple(targets.values()),
            t,
            image,
            camera_,
            target,
            point,
            whole[:, 4:6],
        ),
    )


def _rows(
    each: Sequence[Image],
    stamps: Sequence[int],
    cameras: Mapping[str, Camera],
    targets: Mapping[str, Target],
) -> list[np.ndarray]:
    """Return rows of image, camera, target, point, u and v, an array for every image."""
    number = {ns: float(k) for k, ns in enumerate(stamps)}
    out = []
    for ns, camera, result in each:
        if camera not in cameras:
            raise DataError(
                f"the bag has images of camera '{camera}', which is not described; give it with "
                f'--camera {camera}=FILE'
            )
        rows = _labelled(result, targets) if isinstance(result, list) else result
        before = np.array([number[ns], float(list(cameras).index(camera))])
        out.append(np.column_stack([np.tile(before, (len(rows), 1)), rows]))
    return out


def _labelled(result: Marks, targets: Mapping[str, Target]) -> np.ndarray:
    """Return rows of `FIELDS` of corners by their labels; those of tags elsewhere are left out."""
    known = {
        text: (float(k), float(call))
        for k, one in enumerate(targets.values())
        for text, call in zip(one.labels, numbered(one), strict=True)
    }
    rows = [(*known[text], u, v) for text, u, v in result if text in known]
    return np.array(rows, dtype=float).reshape(-1, len(FIELDS))


def _described(
    names: TopicNames, made: Mapping[str, Any]
) -> tuple[dict[str, Camera], dict[str, Target]]:
    """Return cameras and targets by name; what is given with the command goes first."""
    cameras, targets = described(made['seen']) if 'seen' in made else ((), ())
    return (
        {c.name: c for c in cameras} | {c.name: c for c in names.cameras},
        {one.name: one for one in targets} | {one.name: one for one in names.targets},
    )


def _points(targets: Sequence[Target], target: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Return the places of points: of whole numbers as labels they are labels, else places."""
    out = np.empty(len(point), dtype=int)
    for k, one in enumerate(targets):
        places = {number: at for at, number in enumerate(numbered(one))}
        for row in np.flatnonzero(target == k).tolist():
            if int(point[row]) not in places:
                raise DataError(f'target {one.name!r} has no point {point[row]}')
            out[row] = places[int(point[row])]
    return out


def numbered(target: Target) -> tuple[int, ...]:
    """Return what messages call the points of a target."""
    if all(label.isdecimal() for label in target.labels):
        return tuple(map(int, target.labels))
    return tuple(range(len(target.labels)))


def rows_of(seen: Sightings) -> list[tuple[float, str, np.ndarray]]:
    """Return stamp [s], camera and rows of `FIELDS` of every image."""
    calls = [np.array(numbered(one)) for one in seen.targets]
    point = np.array([calls[t][p] for t, p in zip(seen.target, seen.point, strict=True)])
    rows = np.column_stack([seen.target, point, seen.pixel])
    assert rows.shape[1] == len(FIELDS)
    out = []
    for k, stamp in enumerate(seen.t.tolist()):
        for c, camera in enumerate(seen.cameras):
            own = (seen.image == k) & (seen.camera == c)
            if own.any():
                out.append((stamp, camera.name, rows[own]))
    return out
