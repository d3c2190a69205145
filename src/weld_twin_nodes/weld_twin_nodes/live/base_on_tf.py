# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the base is, taken from `/tf` when a node starts, and watched from then on."""

from __future__ import annotations

import numpy as np

from weld_twin_core.arm.rotation import angle_between
from weld_twin_core.arrays import Array
from weld_twin_core.errors import ModelError
from weld_twin_msgs_py.assembly.transforms import NoTransform

from .cell_node import CellNode
from .tf_frames import Frames, frames_of

LOOK_EVERY = 0.5
"""Seconds between two looks at whether the base is still there."""
MOVED = 1e-4
"""Way [m] or turn [rad] of a base that has moved: a tenth of a millimetre, what good trackers see."""


def base_on_tf(node: CellNode) -> Array:
    """
    Return T_measuring_base, shape (4, 4), once `/tf` tells it.

    Raises ModelError: the two frames have no names, `/tf` cannot be read here, or the node is
    stopped before they are told.
    """
    measuring, base = node.setting('measuring_frame'), node.setting('base_frame')
    if not measuring or not base:
        raise ModelError('base_from_tf needs the names measuring_frame and base_frame')
    frames = frames_of(node)
    if frames.lack:
        raise ModelError(f'base_from_tf cannot be done: {frames.lack}')

    def told() -> bool:
        try:
            frames.tree.latest(measuring, base)
        except NoTransform as error:
            node.keep('frames', f'waiting for /tf: {error}', logged=False)
            return False
        return True

    if not told():
        node.serve_until(told, f'/tf to tell where {base!r} is in {measuring!r}')
    node.keep('frames', '')
    T = frames.tree.latest(measuring, base)
    node.remark(f'the base is where /tf has {base!r} in {measuring!r}')
    node.every(LOOK_EVERY, lambda: _watch(node, frames, T))
    return T


def _watch(node: CellNode, frames: Frames, taken: Array) -> None:
    """Tell, as long as it is so, that the base is not where it was when the node started."""
    measuring, base = node.setting('measuring_frame'), node.setting('base_frame')
    try:
        now = frames.tree.latest(measuring, base)
    except NoTransform as error:
        node.keep('frames', str(error))
        return
    way = float(np.linalg.norm(now[:3, 3] - taken[:3, 3]))
    turn = float(np.linalg.norm(angle_between(now[:3, :3], taken[:3, :3])))
    sentence = (
        f'{base!r} has moved in {measuring!r} by {way * 1e3:.3g} mm and {np.degrees(turn):.3g} '
        'degrees since this node started; it goes on with the base where it was then: start it '
        'anew, or say T_measuring_base'
    )
    node.keep('frames', sentence if way >= MOVED or turn >= MOVED else '')
