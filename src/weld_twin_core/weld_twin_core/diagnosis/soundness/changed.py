# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Did the set-up move, or does the tool of one recording stand elsewhere than that of the first?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ...arm.rotation import rotation_vector
from ...arrays import Array
from ...effects.dated import InstrumentKnock
from ...effects.frame_errors import ToolPose
from ..algebra.problem import Change
from .evidence import Case, Finding, mistake, note, warning
from .lengths import falls, length, listed
from .limits import FEW, HALVED, NOISE, PARTED, WRONG
from .mending import differing
from .orientation import disagreement
from .slips import TAKEN_UP, Settling, Slip
from .snapshot import Arm, Snapshot

TORCH = 0.1
"""Distance [m] at which a turn of the tool is compared with a shift: a marker's, a torch's."""


def setup(case: Case) -> Sequence[Finding]:
    """Return steps and settling of the set-up; those that are dated are causes, and told there."""
    out = []
    for each in case.changes:
        if each.size > TAKEN_UP * case.largest:
            continue
        if isinstance(each, Settling):
            out.append(note(_settled(case, each)))
        elif isinstance(each.effect, InstrumentKnock) and not case.slips:
            out.append(warning(_moved(case, each)))
    return out


def _moved(case: Case, step: Slip) -> str:
    recording = case.recordings[step.recording]
    if step.time > recording.seen.t[0]:
        return f'{step.sentence(recording)} {step.remedy}.'
    return (
        f'The set-up moved by {length(step.size)} before {recording.name}; have the base '
        'aligned, so that each recording gets its own.'
    )


def _settled(case: Case, result: Settling) -> str:
    recording = case.recordings[result.recording]
    constant, unit = result.time_constant, 's'
    if recording.joints.static:
        constant, unit = constant / float(np.median(np.diff(recording.seen.t))), 'stations'
    return (
        f'The set-up of {recording.name} settles by {length(result.size)} with a time constant of '
        f'{constant:.3g} {unit}, as in warming up.'
    )


def parted(case: Case) -> Sequence[Finding]:
    """Return which recordings have a tool of their own, where that explains what is left."""
    reported = any(change.effect.traits.fitted_with == 'tool' for change in case.model.changes)
    if len(case.recordings) < 2 or reported:
        return ()
    shot = case.snapshot
    before = shot.arm
    turn = disagreement(shot, before.model)
    if before.gap < NOISE and turn < PARTED:
        return ()
    apart = _with_tools(shot)
    own = apart.arm
    after = disagreement(apart, own.model)
    fallen = []
    if before.gap > NOISE and HALVED * own.gap < before.gap:
        fallen.append(falls(before.gap, own.gap))
    if turn > PARTED and HALVED * after < turn:
        fallen.append(f'that of the turns from {_angle(turn)} to {_angle(after)}')
    if not fallen:
        return ()
    sentence = f'{_words(case, own)}; so told, {listed(fallen)}.'
    remedy = (
        'Tell it (--may-change tool_pose, or --changed BAG tool), or diagnose the recordings one '
        'by one'
    )
    if before.off < 1.0 and turn < WRONG:
        return (warning(f'{sentence} {remedy}.'),)
    mend = partial(differing, families=('tool_pose',))
    return (mistake(sentence, 'reflector_jumped', ('tool',), remedy, mend),)


def _with_tools(shot: Snapshot) -> Snapshot:
    """Return the snapshot with a tool of its own in every recording, each found by itself."""
    tools: list[Array] = []
    bases: list[Array] = []
    for k, recording in enumerate(shot.recordings):
        alone = replace(shot.model, bases=(shot.model.bases[k],), changes=(), common=())
        framed = replace(shot, recordings=(recording,), model=alone).framed
        tools.append(framed.robot.T_flange_tool)
        bases.append(framed.bases[0])
    changes = tuple(Change(k, _step(tools[0], tool)) for k, tool in enumerate(tools) if k)
    robot = shot.robot.with_frames(tool=tools[0])
    model = replace(shot.model, robot=robot, bases=tuple(bases), changes=changes)
    return replace(shot, model=model)


def _step(first: Array, other: Array) -> ToolPose:
    """Return how a tool frame stands against the first one, both shape (4, 4)."""
    turn = rotation_vector(first[:3, :3].T @ other[:3, :3])
    return ToolPose(tuple(other[:3, 3] - first[:3, 3]), tuple(turn))


def _words(case: Case, own: Arm) -> str:
    """Return which tools stand elsewhere than the first, and the farthest by how much."""
    far = {}
    for change in own.model.changes:
        steps = change.effect.fit.coordinates()
        far[change.recording] = float(np.linalg.norm(steps[:3])), float(np.linalg.norm(steps[3:]))
    # A turn counts by what it does at the reach of a torch.
    sizes = {k: way + TORCH * turn for k, (way, turn) in far.items()}
    worst = max(sizes, key=lambda k: sizes[k])
    names = [
        case.recordings[k].name for k, size in sizes.items() if size > 2.0 * FEW * sizes[worst]
    ]
    way, turn = far[worst]
    angle = f' and turned by {_angle(turn)}' if turn > PARTED else ''
    most = f', {case.recordings[worst].name} most' if len(names) > 1 else ''
    return (
        f'The tool or its reflector of {listed(names)} sits elsewhere than that of '
        f'{case.recordings[0].name}{most}: {length(way)} away{angle}'
    )


def _angle(turn: float) -> str:
    return f'{np.degrees(turn):.3g} degrees'
