# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Is the set-up what it was said to be, and did it stay so?

Did it move, or does the tool of one recording stand elsewhere than that of the first? Do measured
orientations turn as the joints say, and does gravity pull down?
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...arm.rotation import rotation_vector
from ...arrays import Array
from ...effects.dated import InstrumentKnock
from ...effects.geometry import ToolPose
from ...twin.compensation import TORCH
from ..algebra.problem import Change, Model
from ..limits import CLEAR, FEW, HALVED, NOISE, PARTED, TILTED, WRONG
from .evidence import Case, Finding, mistake, note, warning
from .lengths import capital, falls, length, listed, middle_of_each
from .mending import differing
from .slips import TAKEN_UP, Settling, Slip
from .snapshot import Arm, Snapshot
from .suspicions import conventions, suspicions


def setup(case: Case) -> Sequence[Finding]:
    """Return steps and settling of the set-up; those that are dated are causes, and reported there."""
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
    if step.time(recording) > recording.seen.t[0]:
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
    least = 2.0 * FEW * sizes[worst]
    names = [case.recordings[k].name for k, size in sizes.items() if size > least]
    way, turn = far[worst]
    angle = f' and turned by {_angle(turn)}' if turn > PARTED else ''
    most = f', {case.recordings[worst].name} most' if len(names) > 1 else ''
    return (
        f'The tool or its reflector of {listed(names)} sits elsewhere than that of '
        f'{case.recordings[0].name}{most}: {length(way)} away{angle}'
    )


def _angle(turn: float) -> str:
    return f'{np.degrees(turn):.3g} degrees'


def orientation(case: Case) -> Sequence[Finding]:
    """Return what is wrong with orientations while positions are right."""
    if _median_angle(case.residuals, case.swept) < WRONG:
        return ()
    shot = case.snapshot
    turned = disagreement(shot, shot.framed)
    if turned < WRONG:
        return ()
    # A joint whose axis goes through the tool turns it, and moves it nowhere.
    names = shot.robot.joint_names
    signs = (one for one in suspicions(shot.robot) if one.kind == 'sign' and one.at[0] in names)
    for suspicion in (*conventions(), *signs):
        assert suspicion.mend is not None
        trial = shot.mended(suspicion.mend)
        if CLEAR * disagreement(trial, trial.framed) < turned:
            words = capital(suspicion.sentence)
            sentence = f'{words}; undone, orientations agree with the joints.'
            return (suspicion._replace(sentence=sentence),)
    return (
        warning(
            f'Measured orientations disagree with the joints by {_angle(turned)} '
            '(median) though positions agree; check their convention, or give positions only.'
        ),
    )


def disagreement(shot: Snapshot, model: Model) -> float:
    """Return the median angle [rad] that a model leaves of orientations; 0 where none are."""
    return _median_angle(shot.problem.residuals(model), shot.swept)


def _median_angle(parts: Sequence[Array], some: Sequence[NDArray[np.bool_]]) -> float:
    angles = [np.linalg.norm(part[3:], axis=0) for part in parts if len(part) > 3]
    whole = len(angles) == len(parts)
    return middle_of_each(angles, some if whole else ()) if angles else 0.0


DOWN = np.array([0.0, 0.0, -1.0])
"""Where gravity pulls in a measuring frame that stands upright."""


def gravity(case: Case) -> Sequence[Finding]:
    """Return that gravity and the way the arm was said to stand contradict each other."""
    robot = case.model.robot
    if robot.behind:
        return ()  # The measuring frame tilts with the workpiece.
    turn, pull = robot.T_world_base[:3, :3], robot.gravity
    if _off_upright(turn @ -DOWN, -DOWN) < TILTED or not np.linalg.norm(pull) > 0.0:
        return ()  # It stands upright, or nothing was said of how it stands.
    off = _off_upright(turn @ pull, DOWN)
    if off < TILTED:
        return ()
    own, right = (
        ', '.join(f'{value:.4g}' for value in vector + 0.0)
        for vector in (pull, np.round(np.linalg.norm(pull) * turn.T @ DOWN, 5))
    )
    return (
        warning(
            f'Gravity ({own}) m/s^2 is in the base frame, and with the base that was given it pulls '
            f'{np.degrees(off):.0f} degrees away from down. If the measuring frame stands upright, '
            f'gravity is ({right}); springs and payload come out wrong with another.'
        ),
    )


def _off_upright(one: Array, other: Array) -> float:
    cosine = float(one @ other) / float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))
