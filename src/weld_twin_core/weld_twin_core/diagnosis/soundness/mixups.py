# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Is a gap that no plausible arm leaves a mix-up of units, signs, joints, robots or frames?"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ...arm.robot import Robot
from ...arm.rotation import quaternion_from_matrix, rotation_vector
from ...arrays import Array
from ...effects.effect import Effect
from ...effects.frame_errors import BasePose, RootPose, ToolPose
from ...effects.geometry import ChannelError, JointOffset, LinkLength, LinkOffset, LinkTwist
from ...effects.joint_compliance import JointCompliance
from ...effects.plausible import beyond
from ..algebra.prior import effect_precision
from ..algebra.problem import Model, Problem
from .evidence import Case, Finding, mistake
from .lengths import falls, length, listed
from .limits import (
    CLEAR,
    FAR,
    HALVED,
    LARGE,
    MOST,
    SHORTLIST,
    UNDONE,
    UNEXPLAINED,
    WIDER,
    WORTH,
)
from .mending import frames_fitted
from .snapshot import FRAMES, LENGTHS, Arm, Snapshot, bent, gap, rough_models
from .suspicions import doubles, robots, suspicions, turned_bases


def mixups(case: Case) -> Sequence[Finding]:
    """Return what a gap comes from that no plausible arm leaves, if not from the arm."""
    if case.gap < LARGE:
        return ()
    shot = case.snapshot
    arm = shot.arm()
    if arm.off < 1.0:
        return _frames(case, shot.gap(shot.model)) or _links(case, shot, arm)
    result, rest = _unravelled(shot, arm, case.problem.align)
    if result:
        return [_told(each, arm.gap, rest.gap) for each in result]
    return _beyond(case, shot, arm) or _frames(case, shot.gap(shot.model))


# Mix-ups ---------------------------------------------------------------------------------------


class _Tried(NamedTuple):
    """A suspicion, the data with it undone, and the arm that then fits; others that do as well."""

    suspicion: Finding
    undone: Snapshot
    arm: Arm
    alike: tuple[Finding, ...] = ()

    @property
    def off(self) -> float:
        """Return what is still wrong; whatever is shrunk to a point leaves no gap."""
        return self.arm.off * self.undone.collapsed


def _told(tried: _Tried, before: float, after: float) -> Finding:
    """Return the mistake that a suspicion is, with the gap [m] before and after it is undone."""
    one, others = tried.suspicion, tried.alike
    words = f'{one.sentence[0].upper()}{one.sentence[1:]}'
    if after < before:
        words += f'; undone, {falls(before, after)}'
    if others:
        words += f'. As well it may be that {" or that ".join(o.sentence for o in others)}'
    alike = (*one.alike, *((o.kind, o.at) for o in others))
    return one._replace(sentence=f'{words}.', alike=alike)


def _unravelled(shot: Snapshot, start: Arm, align: frozenset[str]) -> tuple[list[_Tried], Arm]:
    """Return the fewest mix-ups that explain the gap, and the arm without them."""
    for first in (suspicions, doubles):
        result: list[_Tried] = []
        arm, trial, look = start, shot, first
        while arm.off > 1.0 and len(result) < MOST:
            best = _best(trial, arm, look(trial.robot), align)
            if best is None:
                break
            result.append(best)
            trial, arm, look = best.undone, best.arm, suspicions
        factor = CLEAR if shot.possible or not trial.possible else HALVED
        reported = arm.off < start.off / factor or _as_given(shot, trial, start, align)
        # What is shrunk leaves less of everything; it must leave less for its size as well.
        size = trial.shrunk(shot)
        reported = reported and arm.gap < UNDONE and not _moves_frames(shot, trial, align)
        if result and reported and (size == 1.0 or arm.gap * size < start.gap / factor):
            return result, arm
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
    remaining = trial.gap_with(align)
    return remaining < WORTH * start.gap and remaining < shot.gap_with(align) / CLEAR


def _best(
    shot: Snapshot, before: Arm, tries: Iterable[Finding], align: frozenset[str]
) -> _Tried | None:
    """
    Return the mix-up whose undoing leaves least, from a rough ranking and a fit of the best.

    Of those that do as well, the one that leaves the frames as they were given: a wrist turned
    round by half a turn of its outer joints is one whose middle joint counts the other way.
    """
    tried = [(each, shot.mended(each.mend)) for each in tries if each.mend is not None]
    if not tried:  # one joint, and nothing that could be swapped with it
        return None
    fitted: dict[int, _Tried] = {}
    shots = [trial for _, trial in tried]
    # Without orientations a quick fit may end beside the tool vector: then from many starts.
    for thorough in (False,) if shot.turned else (False, True):
        models = rough_models(shots, thorough=thorough)
        rough = [s.gap(m) * s.collapsed for s, m in zip(shots, models, strict=True)]
        for k in np.argsort(rough, kind='stable')[:SHORTLIST]:
            if k not in fitted:
                fitted[k] = _Tried(tried[k][0], shots[k], shots[k].arm())
        least = min(each.off for each in fitted.values())
        if least < before.off / CLEAR:
            break
    if least > WORTH * before.off:
        return None
    alike = [each for each in fitted.values() if WORTH * each.off <= least]
    gaps = [each.undone.gap_with(align) for each in alike] if len(alike) > 1 else [0.0]
    best = alike[int(np.argmin(gaps))]
    near = (each for each, gap in zip(alike, gaps, strict=True) if WORTH * gap <= min(gaps))
    others = {each.suspicion.sentence: each.suspicion for each in near}
    others.pop(best.suspicion.sentence, None)
    return best._replace(alike=tuple(others.values()))


# Frames ----------------------------------------------------------------------------------------


def _frames(case: Case, before: float) -> Sequence[Finding]:
    """Frames that were not to be fitted may be to blame, or what looks like it; name them."""
    if before < FAR:
        return ()
    given, shot = case.problem.align, case.snapshot
    for more in ({'base'}, {'tool'}, {'base', 'tool'}):
        if not more - given:
            continue
        model = shot.aligned(given | more)
        remaining = shot.gap(model)
        if remaining < UNEXPLAINED:
            if _plausible(shot.robot, model):
                return ()
            own = _within(shot, before, remaining, given, more - given)
            return [own or _framed(shot, model, more - given, before, remaining)]
    return ()


def _within(
    shot: Snapshot, before: float, remaining: float, align: frozenset[str], more: set[str]
) -> Finding | None:
    """Return the mix-up that explains as much as more frames would, with those that are aligned."""
    # Beside a turn a base may stand elsewhere as well, within what nobody looks at.
    fixture = shot.robot.behind and more == {'base'}
    turned = turned_bases(shot.robot) if more == {'base'} and not fixture else ()
    most = min(max(LARGE, 2.0 * remaining), UNDONE)
    every = [*((each, FAR) for each in turned), *((each, most) for each in suspicions(shot.robot))]
    for suspicion, limit in every:
        assert suspicion.mend is not None
        undone = shot.mended(suspicion.mend)
        gap = undone.gap_with(align)
        if gap < min(limit, before / CLEAR):
            if fixture and suspicion.at == shot.robot.joint_names[:1]:
                # A fixture that is turned about the positioner's last axis is one with its zero.
                suspicion = suspicion._replace(alike=(('wrong_fixture', ('base',)),))
            return _told(_Tried(suspicion, undone, Arm(shot.model, gap, np.zeros(0))), before, gap)
    return None


def _plausible(robot: Robot, model: Model) -> bool:
    """Return whether fitted frames are off the given ones by no more than a cause may be."""
    bases = [np.linalg.inv(robot.T_world_base) @ base for base in model.bases]
    tool = np.linalg.inv(robot.T_flange_tool) @ model.robot.T_flange_tool
    pairs = [(BasePose, off) for off in bases] + [(ToolPose, tool)]
    errors = (kind(tuple(off[:3, 3]), tuple(rotation_vector(off[:3, :3]))) for kind, off in pairs)
    return not any(beyond(robot, error) for error in errors)


def _framed(
    shot: Snapshot, model: Model, more: set[str], before: float, remaining: float
) -> Finding:
    if more == {'base'} and shot.robot.behind:
        return _fixture(shot.robot, model.bases, falls(before, remaining))
    names = listed(sorted(more))
    return mistake(
        f'The gap of {length(before)} is almost only one of frames: with the {names} fitted '
        f'{length(remaining)} remain.',
        'other',
        tuple(sorted(more)),
        f'Have the {names} aligned (--align) if the instrument stands anywhere, or the tool '
        'centre point was never measured',
        partial(frames_fitted, frames=frozenset(more)),
    )


def _fixture(robot: Robot, bases: Sequence[Array], reported: str) -> Finding:
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
        f'{reported}.'
    )
    remedy = (
        "Give the frame of the fixture that was measured on (of a robot file 'tool' of the "
        f'workpiece: xyz [{at}], quat_xyzw [{turn}]), or have it aligned (--align base)'
    )
    mend = partial(frames_fitted, frames=('base',))
    return mistake(words, 'wrong_fixture', ('base',), remedy, mend)


# Nothing known ---------------------------------------------------------------------------------


def _links(case: Case, shot: Snapshot, arm: Arm) -> Sequence[Finding]:
    """Return that free frames and a bent arm took up what are the links of another one."""
    align = case.problem.align
    result = _other_links(shot, align) if case.gap >= UNDONE else None
    if result is None:
        return ()
    reported, remaining = result
    bundled = _best(shot, arm, robots(shot.robot), align)
    if bundled and bundled.arm.off < 1.0 and _other_links(bundled.undone, align) is None:
        return (_told(bundled, remaining, bundled.arm.gap),)
    return (reported,)


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
        return (mistake(words, 'other', (), remedy),)
    # Links and zeros bend to whatever else is wrong; only what explains the gap is believed.
    if arm.gap > LARGE or arm.gap > shot.gap(shot.framed()) / CLEAR or case.slips:
        return ()
    worst = arm.model.found[int(arm.strain.argmax())]
    if isinstance(worst, RootPose):
        words = (
            'The positioner stands elsewhere beside the robot than it was given, farther than any '
            f'root frame is off by. {worst.remedy(shot.robot)}'
        )
        remedy = 'Measure where it stands, or give the robot file of this cell'
        return (mistake(words, 'other', ('base',), remedy),)
    if not isinstance(worst, JointOffset):
        return (_foreign(case.model.robot, worst, ', more than industrial arms are off by'),)
    joint, value = str(worst.site), np.degrees(float(worst.number('offset')))
    words = (
        f'The zero of joint {joint!r} lies {value:+.1f} degrees from that of the model, which no '
        'mastering leaves.'
    )
    remedy = f'Master {joint} again, or correct its theta_offset'
    return (mistake(words, 'constant_angle', (joint,), remedy),)


def _foreign(robot: Robot, worst: Effect, why: str) -> Finding:
    """Return that the links are those of another arm, by the one that differs most."""
    assert isinstance(worst, ChannelError)
    value = float(worst.vector()[0])
    turns = worst.channel == 'alpha'
    size = f'{np.degrees(value):+.1f} degrees' if turns else f'{value * 1e3:+.1f} mm'
    words = (
        f'The links are not those of {robot.name!r} as the model has it: {worst.channel} of '
        f'{str(worst.site)!r} differs by {size}{why}.'
    )
    return mistake(words, 'other_robot', ('robot',), GIVE_ITS_MODEL)


def _other_links(shot: Snapshot, align: frozenset[str]) -> tuple[Finding, float] | None:
    """
    Return that the lengths of the links are those of another arm; None where they are not.

    With it comes the median gap [m] that every other error of an arm leaves. Frames that are not
    aligned stay within what they can be off by, as all errors do.
    """
    problem = replace(shot.problem, align=align)
    start = shot.framed() if align == FRAMES else shot.aligned(align)
    given = [
        kind() for frame, kind in (('base', BasePose), ('tool', ToolPose)) if frame not in align
    ]
    own = [*given, *_of_joints(shot, (JointOffset, LinkTwist))]
    own += [RootPose()] if shot.robot.behind else []

    def fitted(errors: Sequence[Effect], wider: float = 1.0) -> tuple[Model, float]:
        """Return the fit of errors by their priors, those of lengths so much wider, and its gap."""
        model = start.with_found(tuple(errors))
        own = [np.full(e.fit.coordinates().size, e.name in LENGTHS) for e in errors]
        precision = effect_precision(model) / np.where(np.concatenate(own), wider**2, 1.0)
        # What an arm can have leaves less: more is no noise that would excuse anything.
        model = bent(problem, model, precision, LARGE)
        return model, gap(problem, model)

    remaining = fitted([*own, *_of_joints(shot, (JointCompliance,))])[1]
    if remaining < LARGE:
        return None
    for wider in (WIDER, WIDER**3):  # within a family, and of an arm of another size
        arm, after = fitted([*own, *_of_joints(shot, (LinkLength, LinkOffset))], wider)
        if HALVED * after < remaining:
            if _moved(problem, arm) <= UNDONE:
                return None
            lengths = [e for e in arm.found if e.name in LENGTHS]
            worst = max(lengths, key=lambda e: abs(float(e.vector()[0])))
            why = f'; with other lengths {falls(remaining, after)}'
            return _foreign(arm.robot, worst, why), remaining
    return None


def _of_joints(shot: Snapshot, kinds: Sequence[type[Effect]]) -> list[Effect]:
    return [kind(name) for kind in kinds for name in shot.robot.joint_names]  # type: ignore[call-arg]


def _moved(problem: Problem, arm: Model) -> float:
    """Return how far the lengths that were fitted move the tool, RMS [m]."""
    rest = arm.with_found(tuple(e for e in arm.found if e.name not in LENGTHS))
    pairs = zip(problem.residuals(rest), problem.residuals(arm), strict=True)
    way: Array = np.concatenate([(a - b)[:3] for a, b in pairs], axis=1)
    return float(np.sqrt((way**2).sum(axis=0).mean()))


GIVE_ITS_MODEL = (
    'Give the model of the arm that was measured (siblings differ by as much); if it is this one, '
    'and less precisely built than industrial arms are, put its own lengths into the robot file'
)
