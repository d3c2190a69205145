# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Is there enough to work on, and motion to see a cause, joint by joint, and tell frames apart?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...errors import DataError
from ..frames.open_directions import shown
from .evidence import Case, Finding, note
from .lengths import listed
from .limits import ENOUGH, MOVED, NOISE

TWO_ARMS = 12
"""Turning joints from which a chain holds two arms: of six each. An arm on a gantry that welds on a
positioner has nine, or ten with seven axes."""
AXES = ('x', 'y', 'z', 'turn about x', 'turn about y', 'turn about z')


def motion(case: Case) -> Sequence[Finding]:
    """Return joints that hardly move or never reverse, and frames that cannot be told apart."""
    return [*_two_arms(case), *_hardly(case), *_one_way(case), *_frames(case)]


def _two_arms(case: Case) -> Iterator[Finding]:
    """Yield that the chain has the joints of two arms."""
    turning = int((~case.model.robot.prismatic).sum())
    if turning >= TWO_ARMS:
        yield note(
            f'The chain of {case.model.robot.name!r} has {turning} turning joints, as two arms '
            'together have; if only one was measured, give its own chain (--base-link, --tip-link): '
            'errors of the other take up its own.'
        )


def _hardly(case: Case) -> Iterator[Finding]:
    ranges = np.max([np.ptp(q, axis=0) for q in case.motions], axis=0)
    robot = case.model.robot
    names = [
        f'{robot.joint_names[i]!r} ({_moved(ranges[i], bool(robot.prismatic[i]))})'
        for i in np.flatnonzero(ranges < MOVED)
    ]
    if names:
        yield note(
            f'{listed(names)} hardly move{"s" if len(names) == 1 else ""}; gear, play, ripple and '
            'spring of such a joint cannot be seen, and its offset looks like one of its '
            'neighbours or of a frame.'
        )


def _moved(distance: float, prismatic: bool) -> str:
    return f'{distance * 1e3:.2g} mm' if prismatic else f'{np.degrees(distance):.2g} deg'


def _one_way(case: Case) -> Iterator[Finding]:
    if any(r.joints.static for r in case.recordings):
        return
    turned = np.zeros(case.model.robot.n, dtype=bool)
    for q in case.motions:
        travel = np.abs(np.diff(q, axis=0)).sum(axis=0)
        turned |= (travel < MOVED) | (travel - np.abs(q[-1] - q[0]) > MOVED)
    names = [
        repr(name) for name, t in zip(case.model.robot.joint_names, turned, strict=True) if not t
    ]
    if names:
        yield note(
            f'{listed(names)} never reverse{"s" if len(names) == 1 else ""}; '
            'play there looks like an offset.'
        )


def _frames(case: Case) -> Iterator[Finding]:
    """Report directions of the frames in which an error would not show."""
    names, _, strength, vectors = shown(case.problem, case.model, moving=True)
    hidden = int((strength < 1.0).sum())
    if hidden:
        strongest = np.argsort(-np.abs(vectors[:, 0]))[:2]
        pair = listed([_named(names[i]) for i in sorted(strongest)])
        yield note(
            f'The motion leaves {hidden} of {len(names)} directions of the aligned frames open '
            f'(first of all {pair}); turn the tool more, about more axes, or align less.'
        )


def _named(name: str) -> str:
    frame, axis = name.split('.')
    return f'{frame.split()[0]} {AXES[int(axis)]}'


def quantity(case: Case) -> Sequence[Finding]:
    """
    Return a note when there are few stations.

    Raises DataError: there are fewer numbers than a frame has, or nothing moves.
    """
    problem = case.problem
    frames = 6 * (len(case.recordings) if 'base' in problem.align else 0)
    frames += (6 if max(problem.rows) == 6 else 3) if 'tool' in problem.align else 0
    if problem.size <= frames or sum(problem.samples) < 3:
        raise DataError(
            f'{sum(problem.samples)} measurements give {problem.size} numbers, but the frames to '
            f'align have {frames}; measure more, or align less'
        )
    spread = max(float(np.ptp(q, axis=0).max()) for q in case.motions)
    seen = max(float(np.ptp(r.seen.position, axis=0).max()) for r in case.recordings)
    if spread < NOISE:
        raise DataError(
            'the joints do not move in any recording; '
            + (
                'there is nothing to compare'
                if seen < NOISE
                else 'the tool does, so these are not its joint states'
            )
        )
    if seen < NOISE and not case.held:
        raise DataError('the joints move, but the measured tool never does; is the topic right?')
    total = sum(problem.samples)
    if problem.at_rest and total < ENOUGH:
        return (note(f'With {total} stations few causes can be told apart.'),)
    return ()
