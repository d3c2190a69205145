# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Cameras and targets as people name them: NAME=FILE."""

from __future__ import annotations

from collections.abc import Iterable

from weld_twin_core.cameras import Camera, Target
from weld_twin_core.errors import DataError


def told_cameras(
    cameras: Iterable[str], targets: Iterable[str]
) -> tuple[tuple[Camera, ...], tuple[Target, ...]]:
    """
    Return the cameras and targets of texts such as ``left=left.yaml``.

    Raises
    ------
    DataError, ModelError
        A text is no NAME=FILE, or a file cannot be read.

    """
    # Tables load much that a node without cameras has no use for.
    from weld_twin_msgs_py.tables import read_camera, read_target

    lenses = tuple(read_camera(*_named(text, 'camera')) for text in cameras)
    # What a camera on the tool looks at stands still, where nothing else is said.
    other = 'world' if {camera.mount for camera in lenses} == {'tool'} else 'tool'
    return lenses, tuple(read_target(*_named(text, 'target'), other) for text in targets)


def _named(text: str, what: str) -> tuple[str, str]:
    name, mark, path = text.partition('=')
    if not (name and mark and path):
        raise DataError(f"a {what} is given as NAME=FILE, got '{text}'")
    return name, path
