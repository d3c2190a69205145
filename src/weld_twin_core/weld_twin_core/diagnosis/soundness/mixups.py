# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Is a gap that no plausible arm leaves a mix-up of units, signs, joints, robots or frames?"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ...arm.robot import Robot
from ...arm.rotation import quaternion_from_matrix, rotation_vector
from ...arrays import Array
from ...effects.base_pose import BasePose
from ...effects.effect import Effect
from ...effects.joint_compliance import JointCompliance
from ...effects.joint_offset import JointOffset
from ...effects.link_length import LinkLength
from ...effects.link_offset import LinkOffset
from ...effects.link_twist import LinkTwist
from ...effects.plausible import plausible
from ...effects.root_pose import RootPose
from ...effects.tool_pose import ToolPose
from ..algebra.fit import fit, robust_scale
from ..algebra.prior import effect_precision
from ..algebra.problem import Model, Problem, Scale
from .evidence import Case, Finding, Mistake, length, listed
from .limits import (
    BESIDE,
    EXPLAINED,
    EXPLAINED_IMPOSSIBLE,
    FAR,
    LARGE,
    LINKS_APART,
    LINKS_EXPLAIN,
    MOST,
    SHORTLIST,
    SIBLING,
    TURNED,
    UNDONE,
    UNEXPLAINED,
    WORTH,
)
from .mending import base_turned, frames_fitted
from .snapshot import FRAMES, Arm, Snapshot, gap, rough_models
from .suspicions import AXES, Suspicion, doubles, robots, suspicions

ROUNDS = 3
"""Fits, each with the weights of the last."""
LENGTHS = {'link_length': 'a', 'link_offset': 'd'}
"""The lengths of a link, and what a robot file calls them."""


def mixups(case: Case) -> Sequence[Finding]:
    """Return what a gap comes from that no plausible arm leaves, if not from the arm."""
    if case.gap < LARGE:
        return ()
    shot = case.snapshot
    arm = shot.arm()
    if arm.off < 1.0:
        return _frames(case, shot.gap(shot.model)) or _links(case, shot, arm)
    found, rest = _unravelled(shot, arm, case.problem.align)
    if found:
        return [Finding.of(_mistake(each, arm.gap, rest.gap)) for each in found]
    return _beyond(case, shot, arm) or _frames(case, shot.gap(shot.model))


# Mix-ups ---------------------------------------------------------------------------------------


def _mistake(suspicion: Suspicion, before: float, after: float) -> Mistake:
    words = f'{suspicion.words[0].upper()}{suspicion.words[1:]}'
    if after < before:
        words += f'; undone, the gap falls from {length(before)} to {length(after)}'
    if suspicion.alike:
        words += f'. As well it may be that {" or that ".join(s.words for s in suspicion.alike)}'
    return Mistake(
        suspicion.kind,
        suspicion.at,
        f'{words}.',
        suspicion.remedy,
        suspicion.mend,
        alike=tuple((s.kind, s.at) for s in suspicion.alike),
    )


def _unravelled(shot: Snapshot, start: Arm, align: frozenset[str]) -> tuple[list[Suspicion], Arm]:
    """Return the fewest mix-ups that explain the gap, and the arm without them."""
    for first in (suspicions, doubles):
        found: list[Suspicion] = []
        arm, trial, look = start, shot, first
        while arm.off > 1.0 and len(found) < MOST:
            best, undone, rest = _best(trial, arm, look(trial.robot), align)
            if best is None:
                break
            found.append(best)
            trial, arm, look = undone, rest, suspicions
        factor = EXPLAINED if shot.possible or not trial.possible else EXPLAINED_IMPOSSIBLE
        told = arm.off < start.off / factor or _as_given(shot, trial, start, align)
        # What is shrunk leaves less of everything; it must leave less for its size as well.
        size = trial.shrunk(shot)
        told = told and arm.gap < UNDONE and not _moves_frames(shot, trial, align)
        if found and told and (size == 1.0 or arm.gap * size < start.gap / factor):
            return found, arm
    return [], start


def _moves_frames(shot: Snapshot, trial: Snapshot, align: frozenset[str]) -> bool:
    """
    Return whether a trial throws out frames that were as given.

    What is right within centimetres in the frames given leaves no room for a mix-up that has them
    elsewhere. Few stations bear one: frames and a bent arm take up whatever it does.
    """
    return shot.gap_with(align) < FAR <= trial.gap_with(align)


def _as_given(shot: Snapshot, trial: Snapshot, start: Arm, align: frozenset[str]) -> bool:
    """
    Return whether a trial leaves less in the frames as given than all freedom does without it.

    On short motions free frames and a bent arm take up much of any mistake.
    """
    left = trial.gap_with(align)
    return left < WORTH * start.gap and left < shot.gap_with(align) / EXPLAINED


def _best(
    shot: Snapshot, before: Arm, tries: Iterable[Suspicion], align: frozenset[str]
) -> tuple[Suspicion | None, Snapshot, Arm]:
    """
    Return the mix-up whose undoing leaves least, from a rough ranking and a fit of the best.

    Of those that do as well, the one that leaves the frames as they were given: a wrist turned
    round by half a turn of its outer joints is one whose middle joint counts the other way.
    """
    tried = [(suspicion, shot.mended(suspicion.mend)) for suspicion in tries]
    if not tried:  # one joint, and nothing that could be swapped with it
        return None, shot, before
    fitted: dict[int, tuple[Suspicion, Snapshot, Arm]] = {}
    shots = [trial for _, trial in tried]
    # Without orientations a quick fit may end beside the tool vector: then from many starts.
    for thorough in (False,) if shot.turned else (False, True):
        models = rough_models(shots, thorough=thorough)
        rough = [s.gap(m) * s.collapsed for s, m in zip(shots, models, strict=True)]
        for k in np.argsort(rough, kind='stable')[:SHORTLIST]:
            if k not in fitted:
                fitted[k] = (*tried[k], shots[k].arm())
        least = min(arm.off * trial.collapsed for _, trial, arm in fitted.values())
        if least < before.off / EXPLAINED:
            break
    if least > WORTH * before.off:
        return None, shot, before
    alike = [each for each in fitted.values() if WORTH * each[2].off * each[1].collapsed <= least]
    gaps = [each[1].gap_with(align) for each in alike] if len(alike) > 1 else [0.0]
    first = int(np.argmin(gaps))
    others = [
        each[0]
        for each, left in zip(alike, gaps, strict=True)
        if WORTH * left <= gaps[first] and each is not alike[first]
    ]
    best, trial, arm = alike[first]
    unlike = {other.words: other for other in others if other.words != best.words}
    return replace(best, alike=tuple(unlike.values())), trial, arm


# Frames ----------------------------------------------------------------------------------------


def _frames(case: Case, before: float) -> Sequence[Finding]:
    """Frames that were not to be fitted may be to blame; name them."""
    if before < FAR:
        return ()
    given = case.problem.align
    shot = case.snapshot
    for more in ({'base'}, {'tool'}, {'base', 'tool'}):
        if not more - given:
            continue
        model = shot.aligned(given | more)
        left = shot.gap(model)
        if left < UNEXPLAINED:
            if _plausible(shot.robot, model):
                return ()
            framed = _framed(shot, model, frozenset(more - given), before, left)
            own = None if framed.kind == 'base_turned' else _within(shot, before, left, given)
            if own and framed.kind == 'wrong_fixture' and own.at == shot.robot.joint_names[:1]:
                # A fixture that is turned about the positioner's last axis is one with its zero.
                own = own._replace(alike=(*own.alike, (framed.kind, framed.at)))
            return [Finding.of(own or framed)]
    return ()


def _within(shot: Snapshot, before: float, left: float, align: frozenset[str]) -> Mistake | None:
    """Return the mix-up that explains as much with no more frames fitted than were to be."""
    most = min(max(LARGE, 2.0 * left), UNDONE)
    for suspicion in suspicions(shot.robot):
        undone = shot.mended(suspicion.mend).gap_with(align)
        if undone < min(most, before / EXPLAINED):
            return _mistake(suspicion, before, undone)
    return None


def _plausible(robot: Robot, model: Model) -> bool:
    """Return whether fitted frames are off the given ones by no more than a cause may be."""
    pairs = [('base_pose', np.linalg.inv(robot.T_world_base) @ base) for base in model.bases] + [
        ('tool_pose', np.linalg.inv(robot.T_flange_tool) @ model.robot.T_flange_tool)
    ]
    for effect, off in pairs:
        turn = float(np.arccos(np.clip(0.5 * (np.trace(off[:3, :3]) - 1.0), -1.0, 1.0)))
        if np.linalg.norm(off[:3, 3]) > plausible(robot, effect, 'xyz').high:
            return False
        if turn > plausible(robot, effect, 'rotvec').high:
            return False
    return True


def _framed(
    shot: Snapshot, model: Model, more: frozenset[str], before: float, left: float
) -> Mistake:
    falls = f'the gap falls from {length(before)} to {length(left)}'
    if more == {'base'}:
        if shot.robot.behind:
            return _fixture(shot.robot, model.bases, falls)
        turn = _turned(shot.robot.T_world_base, model.bases[0])
        if turn is not None:
            return _base(shot.robot, turn, falls)
    names = listed(sorted(more))
    return Mistake(
        'other',
        tuple(sorted(more)),
        f'The gap of {length(before)} is almost only one of frames: with the {names} fitted '
        f'{length(left)} remain.',
        f'Have the {names} aligned (--align) if the instrument stands anywhere, or the tool '
        'centre point was never measured',
        partial(frames_fitted, frames=more),
    )


def _base(robot: Robot, turn: Array, falls: str) -> Mistake:
    """Return the mistake that a base is that stands turned, shape (3, 3)."""
    vector = np.degrees(rotation_vector(turn))
    k, angle = int(np.abs(vector).argmax()), float(np.linalg.norm(vector))
    if abs(abs(vector[k]) - angle) < 1.0:
        about, size = f'{AXES[k]} axis', float(vector[k])
    else:
        parts = ', '.join(f'{part:+.0f}' for part in vector / np.abs(vector).max())
        about, size = f'axis ({parts})', angle
    size = abs(size) if angle > 179.0 else size
    first = robot.joint_names[0]
    alike: tuple[tuple[str, tuple[str, ...]], ...] = ()
    words = ''
    # About its own first axis an arm cannot tell its base from the zero of its first joint.
    if k == 2 and about.startswith('z') and not robot.prismatic[0]:
        alike = (('constant_angle', (first,)),)
        words = f'; a joint {first} whose zero is off by as much would look the same'
    return Mistake(
        'base_turned',
        ('base',),
        f'The base of the robot stands turned by {size:.0f} degrees about its {about} against '
        f'the frame that was given; turned back, {falls}.',
        'Use the axes of the robot base that the controller counts in (for a UR: base or '
        f'base_link), or add the turn to the base frame{words}',
        partial(base_turned, turn=turn),
        alike=alike,
    )


def _fixture(robot: Robot, bases: Sequence[Array], falls: str) -> Mistake:
    """Return the mistake that poses were measured in another frame of the workpiece than was given."""
    seen = [np.asarray(np.linalg.inv(base)) for base in bases]
    steps = [np.asarray(robot.T_world_base @ pose) for pose in seen]
    far = [float(np.linalg.norm(step[:3, 3])) for step in steps]
    k = int(np.argmax(far))
    angle = np.degrees(np.linalg.norm(rotation_vector(steps[k][:3, :3])))
    at = ', '.join(f'{value:.4f}' for value in seen[k][:3, 3])
    turn = ', '.join(f'{value:.5f}' for value in quaternion_from_matrix(seen[k][:3, :3]))
    which = f' of recording {k + 1}' if len(bases) > 1 else ''
    words = (
        f'The poses{which} were measured in the frame of another fixture than was given: on the '
        f'positioner it lies {length(far[k])} from there, turned by {angle:.1f} degrees; with it, '
        f'{falls}.'
    )
    remedy = (
        "Give the frame of the fixture that was measured on (of a robot file 'tool' of the "
        f'workpiece: xyz [{at}], quat_xyzw [{turn}]), or have it aligned (--align base)'
    )
    mend = partial(frames_fitted, frames=('base',))
    return Mistake('wrong_fixture', ('base',), words, remedy, mend)


def _turned(given: Array, fitted: Array) -> Array | None:
    """Return by which turn a base stands that has axes along those given, where it is nearby."""
    off = np.linalg.inv(given) @ fitted
    if np.linalg.norm(off[:3, 3]) > BESIDE:
        return None
    # Of all turns that lead axes onto axes the nearest has ones where the turn is largest.
    turn = np.zeros((3, 3))
    rows = np.abs(off[:3, :3]).argmax(axis=1)
    turn[np.arange(3), rows] = np.sign(off[np.arange(3), rows])
    if len(set(rows.tolist())) < 3 or np.linalg.det(turn) < 0.0 or np.array_equal(turn, np.eye(3)):
        return None
    cosine = 0.5 * (np.trace(turn.T @ off[:3, :3]) - 1.0)
    return turn if np.arccos(np.clip(cosine, -1.0, 1.0)) < TURNED else None


# Nothing known ---------------------------------------------------------------------------------


def _links(case: Case, shot: Snapshot, arm: Arm) -> Sequence[Finding]:
    """Return that free frames and a bent arm took up what are the links of another one."""
    align = case.problem.align
    found = other_links(shot, align) if case.gap >= SIBLING else None
    if found is None:
        return ()
    mistake, left = found
    bundled, undone, rest = _best(shot, arm, robots(shot.robot), align)
    if bundled is not None and rest.off < 1.0 and other_links(undone, align) is None:
        mistake = _mistake(bundled, left, rest.gap)
    return [Finding.of(mistake)]


def _beyond(case: Case, shot: Snapshot, arm: Arm) -> Sequence[Finding]:
    """No mix-up explains it: another robot, a zero that is far off, or something else."""
    links = _links(case, shot, arm)
    if links:
        return links
    if arm.gap > UNEXPLAINED:
        words = (
            f'No base and tool frame and no plausible arm brings the gap below '
            f'{length(arm.gap)} (median), and no mix-up of units, signs, joint order, zero '
            'positions or bundled robots explains it.'
        )
        remedy = (
            f'Check that {case.model.robot.name!r} is the robot that was measured, and that '
            'measurements and joint positions of one row belong together'
        )
        return [Finding.of(Mistake('other', (), words, remedy, None))]
    # Links and zeros bend to whatever else is wrong; only what explains the gap is believed.
    if arm.gap > LARGE or arm.gap > shot.gap(shot.framed()) / EXPLAINED or case.slips:
        return ()
    worst = int(arm.strain.argmax())
    effect = arm.model.found[worst]
    if isinstance(effect, RootPose):
        words = (
            'The positioner stands elsewhere beside the robot than it was given, farther than any '
            f'root frame is off by. {effect.remedy(shot.robot)}'
        )
        remedy = 'Measure where it stands, or give the robot file of this cell'
        return [Finding.of(Mistake('other', ('base',), words, remedy, None))]
    joint, value = str(effect.site), float(effect.vector()[0])
    if isinstance(effect, JointOffset):
        words = (
            f'The zero of joint {joint!r} lies {np.degrees(value):+.1f} degrees from that of the '
            'model, which no mastering leaves.'
        )
        remedy = f'Master {joint} again, or correct its theta_offset'
        return [Finding.of(Mistake('constant_angle', (joint,), words, remedy, None))]
    what = {'link_length': 'a', 'link_offset': 'd', 'link_twist': 'alpha'}[effect.name]
    size = f'{np.degrees(value):+.1f} degrees' if what == 'alpha' else f'{value * 1e3:+.1f} mm'
    words = (
        f'The links are not those of {case.model.robot.name!r} as the model has it: {what} of '
        f'{joint!r} differs by {size}, more than industrial arms are off by.'
    )
    return [Finding.of(Mistake('other_robot', ('robot',), words, GIVE_ITS_MODEL, None))]


def other_links(shot: Snapshot, align: frozenset[str]) -> tuple[Mistake, float] | None:
    """
    Return that the lengths of the links are those of another arm; None where they are not.

    With it comes the median gap [m] that every other error of an arm leaves.

    Frames that are not aligned stay within what they can be off by, as all errors do.

    Parameters
    ----------
    shot : Snapshot
    align : frozenset of str
        Frames that are fitted.

    """
    problem = replace(shot.problem, align=align)
    start = _linked(shot, problem)
    given = [
        kind() for frame, kind in (('base', BasePose), ('tool', ToolPose)) if frame not in align
    ]
    own = [*given, *_of_joints(shot, (JointOffset, LinkTwist))]
    own += [RootPose()] if shot.robot.behind else []
    fitted = partial(_fitted, problem, start, shot.soft)
    without = fitted([*own, *_of_joints(shot, (JointCompliance,))])
    left = gap(problem, without)
    if left < LARGE:
        return None
    for spread in LINKS_APART:
        errors = [*own, *_of_joints(shot, (LinkLength, LinkOffset))]
        arm = fitted(errors, spread)
        if LINKS_EXPLAIN * gap(problem, arm) < left:
            far = _moved(problem, arm) > SIBLING
            return (_links_swapped(arm, left, gap(problem, arm)), left) if far else None
    return None


def _linked(shot: Snapshot, problem: Problem) -> Model:
    return shot.framed() if problem.align == FRAMES else shot.aligned(problem.align)


def _of_joints(shot: Snapshot, kinds: Sequence[type[Effect]]) -> list[Effect]:
    return [kind(name) for kind in kinds for name in shot.robot.joint_names]  # type: ignore[call-arg]


def _fitted(
    problem: Problem, start: Model, least: Scale, errors: Sequence[Effect], spread: float = 0.0
) -> Model:
    """Return the fit of errors, each with its own prior but lengths with a spread [m]."""
    model = start.with_found(tuple(errors))
    precision = effect_precision(model)
    if spread > 0.0:
        names = np.concatenate([np.repeat(e.name, e.coordinates().size) for e in errors])
        precision = np.where(np.isin(names, list(LENGTHS)), spread**-2.0, precision)
    for _ in range(ROUNDS):
        scale = robust_scale(problem, problem.residuals(model), least)
        # What an arm can have leaves less: more is no noise that would excuse anything.
        scale = replace(scale, position=min(scale.position, LARGE))
        model = fit(problem, model, scale, precision, iterations=6).model
    return model


def _moved(problem: Problem, arm: Model) -> float:
    """Return how far the lengths that were fitted move the tool, RMS [m]."""
    rest = arm.with_found(tuple(e for e in arm.found if e.name not in LENGTHS))
    pairs = zip(problem.residuals(rest), problem.residuals(arm), strict=True)
    way: Array = np.concatenate([(a - b)[:3] for a, b in pairs], axis=1)
    return float(np.sqrt((way**2).sum(axis=0).mean()))


def _links_swapped(arm: Model, before: float, after: float) -> Mistake:
    lengths = [e for e in arm.found if e.name in LENGTHS]
    worst = max(lengths, key=lambda e: abs(float(e.vector()[0])))
    words = (
        f'The links are not those of {arm.robot.name!r} as the model has it: {LENGTHS[worst.name]} of '
        f'{str(worst.site)!r} differs by {float(worst.vector()[0]) * 1e3:+.1f} mm; with other '
        f'lengths the gap falls from {length(before)} to {length(after)}.'
    )
    return Mistake('other_robot', ('robot',), words, GIVE_ITS_MODEL, None)


GIVE_ITS_MODEL = (
    'Give the model of the arm that was measured (siblings differ by as much); if it is this one, '
    'and less precisely built than industrial arms are, put its own lengths into the robot file'
)
