# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Is a gap that no plausible arm leaves a mix-up of units, signs, joints, robots or frames?

There is one judge. It undoes a suspicion and asks whether frames within reach of those given, and a
plausible arm, then leave much less.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from ...arm.robot import Robot
from ...arm.rotation import quaternion_from_matrix, rotation_vector
from ...arrays import Array
from ...effects.compliance import JointCompliance
from ...effects.effect import Effect
from ...effects.geometry import ChannelError, JointOffset, RootPose
from ..algebra.problem import Model
from ..limits import CLEAR, FEW, HALVED, LARGE, MOST, SHORTLIST, UNDONE, UNEXPLAINED, WIDER, WORTH
from .evidence import Case, Finding, mistake
from .lengths import capital, distance, falls, length, listed
from .mending import frames_fitted
from .slips import Slip
from .snapshot import KINDS, LENGTHS, Arm, Snapshot, of_joints, rough_models
from .suspicions import doubles, robots, suspicions, turned_bases


def mixups(case: Case) -> Sequence[Finding]:
    """Return what a gap comes from that no plausible arm leaves, if not from the arm."""
    torn = _far(case.residuals)[0] > UNEXPLAINED
    if case.gap < LARGE:
        return _torn(case) if torn else ()
    shot = case.snapshot
    arm = shot.arm
    if arm.off > 1.0 and (result := _unravelled(shot, arm)):
        after = result[-1].undone.remaining
        return [_finding(each, shot, after) for each in result]
    if arm.bent > 1.0 and (other := _beyond(case, shot, arm)):
        return other
    return (
        (_frames(shot) if arm.displaced > 1.0 else ())
        or (_links(case, shot, arm) if arm.bent <= 1.0 else ())
        or (_torn(case) if torn else ())
    )


def _far(parts: Sequence[Array]) -> tuple[float, int]:
    """Return how far off samples are [m] but for the few that may be anything, and where most."""
    return max((float(np.quantile(distance(part), 1.0 - FEW)), k) for k, part in enumerate(parts))


def _torn(case: Case) -> Sequence[Finding]:
    """Return that an arm fits most samples, and leaves of many others what no arm does."""
    shot = case.snapshot
    remaining = shot.problem.residuals(shot.arm.model)
    far, k = _far(remaining)
    if far < UNEXPLAINED:
        return ()
    slips = tuple(each.effect for each in case.changes if isinstance(each, Slip))
    if slips:  # what gave way is told as that, if it is all that is wrong
        errors = (*of_joints(shot.robot, KINDS), *slips)
        if _far(shot.problem.residuals(shot.bent(errors, WIDER)))[0] < UNEXPLAINED:
            return ()
    off = distance(remaining[k])
    off = off[off > UNEXPLAINED]
    words = (
        f'A plausible arm fits most of the measurements, but of {remaining[k].shape[1]} that were '
        f'looked at in {case.recordings[k].name} {off.size} are off by '
        f'{length(float(np.median(off)))} (median), more than any arm is.'
    )
    remedy = (
        'Check that measurements and joint positions of one row belong together, and that base and '
        'tool stayed where they are'
    )
    return (mistake(words, 'other', ('instrument',), remedy),)


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


def _finding(tried: _Tried, shot: Snapshot, after: float) -> Finding:
    """Return the mistake that a suspicion is, with the gap [m] before and after it is undone."""
    one, others = tried.suspicion, tried.alike
    words = capital(one.sentence)
    if after < shot.remaining:
        words += f'; undone, {falls(shot.remaining, after)}'
    if others:
        words += f'. As well it may be that {" or that ".join(o.sentence for o in others)}'
    alike = [*one.alike, *((o.kind, o.at) for o in others)]
    if shot.robot.behind and one.at == shot.robot.joint_names[:1] and 'base' not in shot.align:
        # A fixture that is turned about the positioner's last axis is one with its zero.
        alike.append(('wrong_fixture', ('base',)))
    return one._replace(sentence=f'{words}.', alike=tuple(dict.fromkeys(alike)))


def _unravelled(shot: Snapshot, start: Arm) -> list[_Tried]:
    """Return the fewest mix-ups that explain what is wrong."""
    if start.bent < 1.0:  # only frames are off the given ones
        free = 'base' in shot.align or shot.robot.behind
        tries = [*(() if free else turned_bases()), *suspicions(shot.robot)]
        best = _best(shot, start, tries)
        return [best] if best and best.off < 1.0 else []
    for first in (suspicions, doubles):
        result: list[_Tried] = []
        arm, trial, look = start, shot, first
        while arm.off > 1.0 and len(result) < MOST:
            best = _best(trial, arm, look(trial.robot))
            if best is None:
                break
            result.append(best)
            trial, arm, look = best.undone, best.arm, suspicions
        if result and _explains(shot, start, trial, arm):
            return result
    return []


def _explains(shot: Snapshot, start: Arm, trial: Snapshot, arm: Arm) -> bool:
    """Return whether a trial leaves much less than the start, and no frame that was as given off."""
    factor = CLEAR if shot.possible or not trial.possible else HALVED
    less = factor * arm.off < start.off or factor * arm.bent < start.bent
    # What is shrunk leaves less of everything; it must leave less for its size as well.
    size = trial.shrunk(shot)
    less = less and (size == 1.0 or factor * arm.gap * size < start.gap)
    return less and arm.gap < UNDONE and arm.displaced < max(1.0, start.displaced)


def _best(shot: Snapshot, before: Arm, tries: Iterable[Finding]) -> _Tried | None:
    """Return the mix-up whose undoing leaves least; of those alike, what leaves the frames."""
    tried = [(each, shot.mended(each.mend)) for each in tries if each.mend is not None]
    if not tried:  # one joint, and nothing that could be swapped with it
        return None
    fitted: dict[int, _Tried] = {}
    shots = [trial for _, trial in tried]
    # Without orientations a quick fit may end beside the tool vector: then from many starts, also
    # where what it found leaves something wrong, for it may have passed over what leaves nothing.
    for thorough in (False,) if shot.turned else (False, True):
        for k in np.argsort(_rough(shots, before, thorough), kind='stable')[:SHORTLIST].tolist():
            if k not in fitted:
                fitted[k] = _Tried(tried[k][0], shots[k], shots[k].arm)
        least = min(each.off for each in fitted.values())
        if least < min(1.0, before.off / CLEAR):
            break
    if least > WORTH * before.off:
        return None
    alike = [each for _, each in sorted(fitted.items()) if WORTH * each.off <= least]
    gaps = [each.undone.remaining for each in alike] if len(alike) > 1 else [0.0]
    best = next(e for e, gap in zip(alike, gaps, strict=True) if (1.0 - FEW) * gap <= min(gaps))
    near = (each for each, gap in zip(alike, gaps, strict=True) if WORTH * gap <= min(gaps))
    others = {each.suspicion.sentence: each.suspicion for each in near}
    others.pop(best.suspicion.sentence, None)
    return best._replace(alike=tuple(others.values()))


def _rough(shots: Sequence[Snapshot], before: Arm, thorough: bool) -> list[float]:
    """Return the gap [m] that is left of trials for their size; as given, where only frames are off."""
    if before.bent < 1.0:
        return [shot.remaining * shot.collapsed for shot in shots]
    models = rough_models(shots, thorough=thorough)
    return [shot.gap(m) * shot.collapsed for shot, m in zip(shots, models, strict=True)]


# Frames ----------------------------------------------------------------------------------------


def _frames(shot: Snapshot) -> Sequence[Finding]:
    """Return that frames were given which are elsewhere, where fitting them leaves little."""
    for more in ({'base'}, {'tool'}, {'base', 'tool'}):
        model = shot.aligned(shot.align | more)
        if more - shot.align and (remaining := shot.gap(model)) < UNEXPLAINED:
            return (_framed(shot, model, more - shot.align, remaining),)
    return ()


def _framed(shot: Snapshot, model: Model, more: set[str], remaining: float) -> Finding:
    if more == {'base'} and shot.robot.behind:
        return _fixture(shot.robot, model.bases, falls(shot.remaining, remaining))
    names = listed(sorted(more))
    return mistake(
        f'The gap of {length(shot.remaining)} is almost only one of frames: with the {names} fitted '
        f'{length(remaining)} remain.',
        'other',
        tuple(sorted(more)),
        f'Have the {names} aligned (--align) if the instrument stands anywhere, or the tool '
        'centre point was never measured',
        partial(frames_fitted, frames=frozenset(more)),
    )


def _fixture(robot: Robot, bases: Sequence[Array], sentence: str) -> Finding:
    """Return the mistake that poses were measured in another frame of the workpiece than was given."""
    seen = [np.asarray(np.linalg.inv(base)) for base in bases]
    steps = [np.asarray(robot.T_world_base @ pose) for pose in seen]
    far = [float(np.linalg.norm(step[:3, 3])) for step in steps]
    k = int(np.argmax(far))
    angle = np.degrees(np.linalg.norm(rotation_vector(steps[k][:3, :3])))
    at = ', '.join(f'{value:.4f}' for value in seen[k][:3, 3])
    turn = ', '.join(f'{value:.5f}' for value in quaternion_from_matrix(seen[k][:3, :3]))
    which = f' of recording {k + 1}' if len(bases) > 1 else ''
    return mistake(
        f'The poses{which} were measured in the frame of another fixture than was given: on the '
        f'positioner it lies {length(far[k])} from there, turned by {angle:.1f} degrees; with it, '
        f'{sentence}.',
        'wrong_fixture',
        ('base',),
        "Give the frame of the fixture that was measured on (of a robot file 'tool' of the "
        f'workpiece: xyz [{at}], quat_xyzw [{turn}]), or have it aligned (--align base)',
        partial(frames_fitted, frames=('base',)),
    )


# Nothing known ---------------------------------------------------------------------------------


def _links(case: Case, shot: Snapshot, arm: Arm) -> Sequence[Finding]:
    """Return that free frames and a bent arm took up what are the links of another one."""
    finding = _other_links(shot) if case.gap >= UNDONE else None
    if finding is None:
        return ()
    bundled = _best(shot, arm, robots(shot.robot))
    if bundled and bundled.arm.off < 1.0 and _other_links(bundled.undone) is None:
        return (_finding(bundled, shot, bundled.undone.remaining),)
    return (finding,)


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
    if arm.gap > LARGE or CLEAR * arm.gap > shot.gap(shot.framed) or case.slips:
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
    remedy = (
        'Give the model of the arm that was measured (siblings differ by as much); if it is this one, '
        'and less precisely built than industrial arms are, put its own lengths into the robot file'
    )
    return mistake(words, 'other_robot', ('robot',), remedy)


def _other_links(shot: Snapshot) -> Finding | None:
    """Return that the lengths of the links are those of another arm; None where they are not."""
    # What an arm can have leaves less than LARGE: more is no noise that would excuse anything.
    own = [kind for kind in KINDS if kind.name not in LENGTHS]
    remaining = _borne(shot, shot.bent(of_joints(shot.robot, (*own, JointCompliance)), 1.0, LARGE))
    if remaining < LARGE:
        return None
    errors = of_joints(shot.robot, KINDS)
    sizes = [e.fit.coordinates().size for e in errors]
    lengths = np.repeat([e.name in LENGTHS for e in errors], sizes)
    for wider in (WIDER, WIDER**3):  # within a family, and of an arm of another size
        arm = shot.bent(errors, np.where(lengths, wider, 1.0), LARGE)
        after = _borne(shot, arm)
        if HALVED * after < remaining:
            if _moved(shot, arm) <= UNDONE:
                return None
            links = (e for e in arm.found if e.name in LENGTHS)
            worst = max(links, key=lambda e: abs(float(e.vector()[0])))
            why = f'; with other lengths {falls(remaining, after)}'
            return _foreign(arm.robot, worst, why)
    return None


def _borne(shot: Snapshot, model: Model) -> float:
    """Return the gap [m] that a model leaves, as wide as it is where nothing was fitted to."""
    fitted = sum(error.fit.coordinates().size for error in model.found)
    fitted += 6 * len(model.bases) + (6 if shot.turned else 3)
    free = shot.problem.size - fitted
    return float(shot.gap(model) * np.sqrt(shot.problem.size / free)) if free > 0 else float('inf')


def _moved(shot: Snapshot, arm: Model) -> float:
    """Return how far the lengths that were fitted move the tool, RMS [m]."""
    rest = arm.with_found(tuple(e for e in arm.found if e.name not in LENGTHS))
    pairs = zip(shot.problem.residuals(rest), shot.problem.residuals(arm), strict=True)
    way: Array = np.concatenate([(a - b)[:3] for a, b in pairs], axis=1)
    return float(np.sqrt((way**2).sum(axis=0).mean()))
