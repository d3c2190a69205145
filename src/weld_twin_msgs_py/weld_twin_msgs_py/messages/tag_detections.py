# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Tags found in an image, as the detector of AprilTags publishes them.

A corner is labelled by its tag and its place on the tag, as `tag_points` of the tables has them:
clockwise from the upper left, which is OpenCV's order. The detector of AprilTags [1]_ counts them
against the clock from the lower left.

References
----------
.. [1] E. Olson, "AprilTag: A robust and flexible visual fiducial system", ICRA 2011.

"""

from __future__ import annotations

from math import isfinite
from typing import Any

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
    """
    Return the corners of all tags in a message.

    Raises DataError: a tag has not four corners, or one of them is no finite number.
    """
    out: Marks = []
    for result in message.detections:
        if len(result.corners) != len(OURS):
            raise DataError(f'tag {result.id} has {len(result.corners)} corners; a tag has four')
        for place, at in zip(OURS, result.corners, strict=True):
            if not (isfinite(at.x) and isfinite(at.y)):
                raise DataError(f'a corner of tag {result.id} is no finite number')
            out.append((label(int(result.id), place), float(at.x), float(at.y)))
    return out
