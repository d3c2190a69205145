# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A stream of poses on its way to a controller: when it is corrected, and that it never jumps."""

from math import sqrt
from typing import NamedTuple

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.twin.goal_correction import SMOOTH_PEAK, SMOOTH_SPEED, GoalLimits
from weld_twin_core.twin.pose_correction import LEVER, Looked, PoseCorrection, between, moved

from .looks_beside import LooksBeside

STILL = 2e-5
"""Poses that stay within this [m, rad] stand still: far below what a seam moves between two of them."""
REST = 0.1
"""Time at standstill [s] after which a stream has come to rest."""
SILENT = 0.5
"""Silence [s] after which a stream begins anew: a hundred periods of a slow one."""
NEAR = (0.01, 0.05)
"""A stream begins where the arm stands, within this [m, rad]; farther off its first pose is a jump."""
LOOK = 0.7
"""Distance, in units of how far an exact look may be, at which the next one is begun."""
FAR = 2.0
"""The same from which the pose waits for it: the error is eight times that at one."""
DOUBT_EVERY = 0.02
"""Way [m] after which it is asked anew how sure the model is; that changes slowly."""
UNHEARD = 'where the arm stands is not known: no joint states are heard'
OPENING = 'the first pose is looked at'
"""Why nothing is added yet to the first poses of a stream."""
SHORT = 1e-6
"""Ramp [m, rad] that is none."""
SHORTEST = 0.01
"""Time [s] that two poses are at least taken to be apart: stamps may be some milliseconds off."""
SPAN = 0.05
"""Shortest time [s] over which speeds of joints are taken from exact looks."""


class Given(NamedTuple):
    """What becomes of a pose."""

    pose: Array | None  # to be sent on, shape (4, 4); None for nothing
    added: Array | None
    """What was, or would be, added, shape (6,) [m, rad]; None where it is not known."""
    why: str = ''  # why it is not corrected; empty where it is


class _Ramp(NamedTuple):
    """A change of what is added while the stream is held at one pose."""

    pose: Array
    start: Array
    end: Array
    begun: float
    span: float
    mode: str

    def at(self, now: float) -> Array:
        """Return what is added at a time [s], shape (6,)."""
        s = min(max((now - self.begun) / self.span, 0.0), 1.0)
        share = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        return np.asarray(self.start + share * (self.end - self.start))


class PoseStream:
    """
    Corrects poses one after the other.

    What is added to them follows the model as long as the stream moves. It is faded in before the
    first pose is followed, and faded in or out where the stream stands still, at no other time.

    passing: what is refused passes as it came; else nothing is sent.
    shadow: nothing is sent; what would be added is reported.
    beside: makes exact looks meanwhile; until it is up, the stream makes them after a pose.
    """

    def __init__(
        self,
        correction: PoseCorrection,
        limits: GoalLimits,
        *,
        passing: bool = False,
        shadow: bool = False,
        beside: LooksBeside | None = None,
    ) -> None:
        self.correction, self._limits, self._beside = correction, limits, beside
        if beside is not None:
            beside.follow(correction)
        self._passing, self._shadow = passing, shadow
        self._fresh: PoseCorrection | None = None
        self._first: tuple[Array, Array] | None = None
        self._opening = False
        self.forget()

    def renew(self, correction: PoseCorrection) -> None:
        """Go on with another correction from the next standstill on, or the next beginning."""
        self._fresh = correction

    def forget(self) -> None:
        """Begin anew with the next pose."""
        self._know_nothing()
        self._mode, self._refused, self._tried = 'none', '', -np.inf
        self._ramp: _Ramp | None = None
        self._added = np.zeros(6)
        self._rest_pose: Array | None = None
        self._at, self._since = np.eye(4), np.inf
        self._rest_since = self._last = -np.inf
        self._next: Array | None = None
        self._asked = -np.inf
        self._sizes = self._doubts = 0.0
        self._doubted: Array | None = None
        self._doubtful = False
        self._speeds: tuple[float, Array, Array | None] | None = None

    @property
    def corrected(self) -> bool:
        """Return whether poses are being corrected, or would be."""
        return self._mode == 'corrected'

    def take(self, pose: Array, now: float, arm: Array | None, withdrawn: str = '') -> Given:
        """
        Return what becomes of a pose of the tool in the robot's base, as the controller counts it.

        withdrawn: why nothing is to be corrected from the next standstill on; empty for nothing.
        """
        if not 0.0 <= now - self._last <= SILENT:
            self.forget()
        self._since, self._last = now - self._last, now
        at = self._rest_pose
        if at is None or np.abs(pose - at).max() > STILL:
            self._rest_pose, self._rest_since = pose, now
        rest = now - self._rest_since
        if self._fresh is not None and (rest >= REST or self._mode != 'corrected'):
            self._exchange(self._fresh)
        added, why = self._wanted(pose, now, rest, arm, withdrawn)
        if self._shadow:
            self._mode = 'none' if added is None else 'corrected'
            return Given(None, added, '' if why == OPENING else why)
        if self._ramp is not None:
            return self._on_ramp(now, why)
        if added is None:
            stays = self._hold_still(pose, arm) if why == OPENING else None
            return stays or self._uncorrected(pose, now, rest, self._refused or why)
        if self._mode == 'corrected':
            self._added = added
            return Given(moved(pose, added), added)
        if self._mode == 'none':
            return self._begun(pose, now, added, arm)
        if rest < REST:
            return Given(moved(pose, self._added), self._added, 'waits for a standstill')
        return self._begin_ramp(pose, now, added, 'corrected')

    def settle(self) -> None:
        """Do what was put off until the pose was sent, one thing after each: the next pose is near."""
        pose, self._next = self._next, None
        known, beside = self.correction.looked, self._beside
        answer = None if beside is None else beside.answer()
        if isinstance(answer, float) and known is not None:
            self._weigh(known, answer)
        elif answer is not None and not isinstance(answer, float):
            self._judge(answer, self._asked)
        elif beside is None or not beside.up:
            self._settle_here(pose)
        elif beside.free and self._first is not None:
            self._asked = self._last
            beside.look(*self._first)
            self._first = None
        elif beside.free and known is not None and pose is not None:
            self._asked = self._last
            beside.look(pose, self.correction.joints(pose))
        elif beside.free and known is not None and self._doubtful and not self._refused:
            beside.doubt(known)

    def _settle_here(self, pose: Array | None) -> None:
        known, self._opening = self.correction.looked, False
        if known is not None and pose is not None:
            self._look(pose, self._last)
        elif known is not None and self._doubtful and not self._refused:
            self._weigh(known, self.correction.doubt(known))

    def _know_nothing(self) -> None:
        """Forget all looks, and what was asked."""
        self.correction.adopt(None)
        self._opening, self._first = False, None
        if self._beside is not None:
            self._beside.drop()

    def _exchange(self, fresh: PoseCorrection) -> None:
        """Take another correction; what was added stays until it is faded over."""
        self.correction, self._fresh = fresh, None
        if self._beside is not None:
            self._beside.follow(fresh)
        self._next = self._speeds = self._doubted = None
        self._refused, self._sizes, self._doubts = '', 0.0, 0.0
        if self._mode == 'corrected':
            self._mode = 'held'

    # What is wanted --------------------------------------------------------------------------

    def _wanted(
        self, pose: Array, now: float, rest: float, arm: Array | None, withdrawn: str
    ) -> tuple[Array | None, str]:
        """Return what is to be added by the model, or why nothing is."""
        if withdrawn and not (self.corrected and rest < REST):
            self._know_nothing()
            return None, withdrawn
        if self._refused:
            if rest < REST or now - self._tried < REST:
                return None, self._refused
            self._refused = ''
            self._know_nothing()
        if self._opening or self.correction.looked is None:
            why = self._open(pose, now, arm)
            if why:
                return None, why
        added, far = self.correction.added(pose)
        if far > FAR:
            before = self.correction.joints(self._at)
            self._look(pose, now)
            self._refused = self._refused or self._leapt(before)
            if self._refused:
                return None, self._refused
            added, far = self.correction.added(pose)
        self._at = pose
        if far > LOOK:
            self._next = pose
        return added, ''

    def _open(self, pose: Array, now: float, arm: Array | None) -> str:
        """Look at the first pose, or have it looked at; return why nothing is added to it."""
        if self._opening:
            return OPENING
        self._tried, self._speeds = now, None
        if arm is None:
            return UNHEARD
        if self._beside is not None and self._beside.up:
            self._first, self._opening = (pose, arm), True
            return OPENING
        self._look(pose, now, arm)
        looked = self.correction.looked
        if looked is not None and not self._refused:
            self._weigh(looked, self.correction.doubt(looked))
        return self._refused

    def _look(self, pose: Array, now: float, arm: Array | None = None) -> None:
        """Look at a pose exactly, from joints near it or from the look before; nothing else counts."""
        if self._beside is not None:
            self._beside.drop()
        result = self.correction
        try:
            looked = result.exact(pose) if arm is None else result.first(pose, arm)
        except DataError as error:
            self._judge(error, now)
        else:
            self._judge(looked, now)

    def _judge(self, looked: Looked | DataError, now: float) -> None:
        """Go on from an exact look at the pose of a time, unless it must not be corrected."""
        if isinstance(looked, DataError):
            self._refused, self._opening = str(looked), False
            return
        pose, result = looked.pose, self.correction
        self._refused = result.refusal(looked, self._limits) or self._too_quick(looked, now)
        self._tried = now
        result.adopt(looked)
        before = self._doubted
        way = np.inf if before is None else np.linalg.norm(pose[:3, 3] - before)
        self._doubtful = bool(way > DOUBT_EVERY)
        self._opening &= not self._refused

    def _weigh(self, looked: Looked, doubt: float) -> None:
        """Hold how sure the model is of the latest look [m] against how large the correction is."""
        self._doubted, self._doubtful, self._opening = looked.pose[:3, 3], False, False
        self._sizes += float(looked.added[:3] @ looked.added[:3])
        self._doubts += doubt**2
        if self._sizes < self._doubts:
            self._refused = (
                f'the model is less sure of these poses ({doubt * 1e3:.3f} mm) than the correction '
                'is large'
            )

    def _too_quick(self, looked: Looked, now: float) -> str:
        """Return that joints, or what is added, change faster than they may."""
        before = self._speeds
        if before is None or now - before[0] > SILENT:
            self._speeds = now, looked.q, None
            return ''
        span = now - before[0]
        if span < SPAN:
            return ''
        speed = (looked.q - before[1]) / span
        robot = self.correction.model.robot
        bend = np.zeros_like(speed) if before[2] is None else (speed - before[2]) / span
        self._speeds = now, looked.q, speed
        most = np.minimum(robot.max_acceleration, self._limits.acceleration)
        return _over(np.abs(speed), robot.max_velocity, 'velocity', robot) or _over(
            np.abs(bend), most, 'acceleration', robot
        )

    def _leapt(self, before: Array) -> str:
        """Return that joints, from where they were at the pose before, cannot follow so far a step."""
        looked, robot = self.correction.looked, self.correction.model.robot
        assert looked is not None
        return _over(
            np.abs(looked.q - before) / max(self._since, SHORTEST),
            robot.max_velocity,
            'velocity',
            robot,
        )

    # What is sent ----------------------------------------------------------------------------

    def _uncorrected(self, pose: Array, now: float, rest: float, why: str) -> Given:
        if not self._passing:
            self._mode = 'none'
            return Given(None, None, why)
        if self._mode in ('corrected', 'held') and np.abs(self._added).max() > SHORT:
            if rest >= REST:
                return self._begin_ramp(pose, now, np.zeros(6), 'passed', why)
            self._mode = 'held'
            return Given(moved(pose, self._added), self._added, why)
        self._mode, self._added = 'passed', np.zeros(6)
        return Given(pose, self._added, why)

    def _begun(self, pose: Array, now: float, added: Array, arm: Array | None) -> Given:
        """Begin with a stream: fade in from where the arm stands, before its first pose is followed."""
        there = self._to_arm(pose, arm)
        if there is None:
            return self._uncorrected(pose, now, 0.0, self._refused)
        self._added = there
        return self._begin_ramp(pose, now, added, 'corrected')

    def _hold_still(self, pose: Array, arm: Array | None) -> Given | None:
        """Return what keeps the arm where it is while the first look is made; None where it is not."""
        there = self._to_arm(pose, arm) if self._mode == 'none' else self._added
        return None if there is None else Given(moved(pose, there), there)

    def _to_arm(self, pose: Array, arm: Array | None) -> Array | None:
        """Return what takes a pose to where the arm stands, shape (6,); None where that is too far."""
        if arm is None:
            self._refused = UNHEARD
            return None
        there = between(pose, self.correction.arm_pose(arm))
        far = [float(np.linalg.norm(part)) for part in np.split(there, 2)]
        if far[0] <= NEAR[0] and far[1] <= NEAR[1]:
            return there
        self._refused = (
            f'the pose is {far[0] * 1e3:.1f} mm and {np.degrees(far[1]):.2f} degrees from where '
            'the arm stands; begin there'
        )
        return None

    def _begin_ramp(self, pose: Array, now: float, end: Array, mode: str, why: str = '') -> Given:
        way = [float(np.linalg.norm(part)) for part in np.split(end - self._added, 2)]
        if max(way) < SHORT:
            self._mode, self._added = mode, end
            return Given(moved(pose, end), end, why)
        most = min(
            self._limits.acceleration, float(self.correction.model.robot.max_acceleration.min())
        )
        span = max(
            SMOOTH_SPEED * way[0] / self._limits.rate,
            SMOOTH_SPEED * way[1] / self._limits.turn_rate,
            sqrt(SMOOTH_PEAK * (way[0] / LEVER + way[1]) / most),
        )
        self._ramp = _Ramp(pose, self._added, end, now, span, mode)
        return self._on_ramp(now, why)

    def _on_ramp(self, now: float, why: str) -> Given:
        assert self._ramp is not None
        ramp, added = self._ramp, self._ramp.at(now)
        self._added = added
        if now - ramp.begun >= ramp.span:
            self._mode, self._ramp = ramp.mode, None
        return Given(moved(ramp.pose, added), added, why)


def _over(values: Array, limits: Array, name: str, robot: Robot) -> str:
    over = values - limits
    if over.max() <= 0.0:
        return ''
    i = int(over.argmax())
    return (
        f'these poses break the limit of {name} of {robot.joint_names[i]}: {values[i]:.3g}, the limit '
        f'is {limits[i]:.3g}'
    )
