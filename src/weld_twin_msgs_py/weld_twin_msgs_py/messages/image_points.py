# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Points found in an image: a PointCloud2 with the fields target, point, u and v, or tags.

A corner of a tag is labelled by its tag and its place on the tag, as `tag_points` of the tables has
them: clockwise from the upper left, as OpenCV does. The detector of AprilTags (Olson, ICRA 2011)
counts them against the clock from the lower left.
"""

from math import isfinite
from typing import Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

TAGS = 'apriltag_msgs/msg/AprilTagDetectionArray'
"""Type of its messages."""
OURS = (3, 2, 1, 0)
"""Place on the tag, clockwise from the upper left, of every corner in the order of a message."""
Marks = list[tuple[str, float, float]]
"""Label, u and v [px] of corners."""


def label(tag: int, corner: int) -> str:
    """Return the label of a corner of a tag, counted clockwise from the upper left."""
    return f'{tag}.{corner}'


def corners(message: Any) -> Marks:
    out: Marks = []
    for result in message.detections:
        if len(result.corners) != len(OURS):
            raise DataError(f'tag {result.id} has {len(result.corners)} corners; a tag has four')
        for place, at in zip(OURS, result.corners, strict=True):
            if not (isfinite(at.x) and isfinite(at.y)):
                raise DataError(f'a corner of tag {result.id} is no finite number')
            out.append((label(int(result.id), place), float(at.x), float(at.y)))
    return out


FIELDS = ('target', 'point', 'u', 'v')
"""Which target, counted from 0; which of its points; where in the image [px]."""
KINDS = {1: 'i1', 2: 'u1', 3: 'i2', 4: 'u2', 5: 'i4', 6: 'u4', 7: 'f4', 8: 'f8'}
"""Types of numbers by the constants of sensor_msgs/PointField."""
DOUBLE = 8
"""The constant of FLOAT64."""


def points(message: Any) -> Array:
    """Return the rows of a PointCloud2, shape (N, 4): target, point, u and v [px]."""
    fields = {field.name: field for field in message.fields}
    for name in FIELDS:
        if name not in fields or fields[name].datatype not in KINDS:
            listed = ', '.join(fields) or 'none'
            raise DataError(
                f'the points have no field {name!r}; they need {", ".join(FIELDS)}, and have '
                f'{listed}'
            )
    order = '>' if message.is_bigendian else '<'
    count, step = message.width * message.height, message.point_step
    data = np.asarray(message.data, dtype=np.uint8)
    if data.size < count * step:
        raise DataError(f'{count} points of {step} bytes are declared, but {data.size} bytes came')
    kind = np.dtype(
        {
            'names': list(FIELDS),
            'formats': [order + KINDS[fields[name].datatype] for name in FIELDS],
            'offsets': [fields[name].offset for name in FIELDS],
            'itemsize': step,
        }
    )
    rows = np.frombuffer(data[: count * step].tobytes(), kind)
    out = np.column_stack([rows[name].astype(float) for name in FIELDS])
    if not np.isfinite(out).all():
        raise DataError('a point of the image is no finite number')
    return out
