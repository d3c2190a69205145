# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Does the tool of one recording stand elsewhere than that of the first, without a word of it?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ...arm.rotation import rotation_vector
from ...arrays import Array
from ...effects.frame_errors import ToolPose
from ..algebra.problem import Change, Model
from .evidence import Case, Finding, length, listed, mistake
from .limits import PARTED, PARTED_LEAST, PARTED_TURN
from .mending import differing
from .orientation import WRONG, disagreement
from .snapshot import Arm, Snapshot

MUCH = 0.2
"""Share of the largest difference from which a recording is named."""
TORCH = 0.1
"""Distance [m] at which a turn of the tool is compared with a shift: a marker's, a torch's."""
TURN_TOLD = 1e-3
"""Turn [rad] from which it is told: a twentieth of a degree."""


def parted(case: Case) -> Sequence[Finding]:
    """Return which recordings have a tool of their own, where that explains what is left."""
    told = any(change.effect.fitted_with == 'tool' for change in case.model.changes)
    if len(case.recordings) < 2 or told:
        return ()
    shot = case.snapshot
    before = shot.arm()
    turn = disagreement(shot, before.model)
    if before.gap < PARTED_LEAST and turn < TURN_TOLD:
        return ()
    apart = _with_tools(shot)
    own = apart.arm()
    after = disagreement(apart, own.model)
    shifted = PARTED * own.gap < before.gap and before.gap > PARTED_LEAST
    turned = PARTED * after < turn and turn > PARTED_TURN
    if not (shifted or turned):
        return ()
    falls = [f'the gap falls from {length(before.gap)} to {length(own.gap)}'] * shifted
    falls += [f'that of the turns from {_angle(turn)} to {_angle(after)}'] * turned
    sentence = f'{_words(case, own)}; so told, {listed(falls)}.'
    remedy = (
        'Tell it (--may-change tool_pose, or --changed BAG tool), or diagnose the recordings one '
        'by one'
    )
    if before.off < 1.0 and turn < WRONG:
        return (Finding('warning', f'{sentence} {remedy}.'),)
    mend = partial(differing, families=('tool_pose',))
    return (mistake(sentence, 'reflector_jumped', ('tool',), remedy, mend),)


def _with_tools(shot: Snapshot) -> Snapshot:
    """Return the snapshot with a tool of its own in every recording, each found by itself."""
    tools: list[Array] = []
    bases: list[Array] = []
    for k, recording in enumerate(shot.recordings):
        alone = replace(shot.model, bases=(shot.model.bases[k],), changes=(), common=())
        framed = Snapshot((recording,), alone).framed()
        tools.append(framed.robot.T_flange_tool)
        bases.append(framed.bases[0])
    changes = tuple(Change(k, _step(tools[0], tool)) for k, tool in enumerate(tools) if k)
    robot = shot.robot.with_frames(tool=tools[0])
    model: Model = replace(shot.model, robot=robot, bases=tuple(bases), changes=changes)
    return Snapshot(shot.recordings, model)


def _step(first: Array, other: Array) -> ToolPose:
    """Return how a tool frame stands against the first one, both shape (4, 4)."""
    turn = rotation_vector(first[:3, :3].T @ other[:3, :3])
    return ToolPose(tuple(other[:3, 3] - first[:3, 3]), tuple(turn))


def _words(case: Case, own: Arm) -> str:
    """Return which tools stand elsewhere than the first, and the farthest by how much."""
    far = {}
    for change in own.model.changes:
        steps = change.effect.coordinates()
        far[change.recording] = float(np.linalg.norm(steps[:3])), float(np.linalg.norm(steps[3:]))
    # A turn counts by what it does at the reach of a torch.
    sizes = {k: way + TORCH * turn for k, (way, turn) in far.items()}
    worst = max(sizes, key=lambda k: sizes[k])
    names = [case.recordings[k].name for k, size in sizes.items() if size > MUCH * sizes[worst]]
    way, turn = far[worst]
    angle = f' and turned by {_angle(turn)}' if turn > TURN_TOLD else ''
    most = f', {case.recordings[worst].name} most' if len(names) > 1 else ''
    return (
        f'The tool or its reflector of {listed(names)} sits elsewhere than that of '
        f'{case.recordings[0].name}{most}: {length(way)} away{angle}'
    )


def _angle(turn: float) -> str:
    return f'{np.degrees(turn):.3g} degrees'
