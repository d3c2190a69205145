# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Joint states of whatever controller: any order, further joints, spread over publishers."""

from collections.abc import Callable, Collection, Mapping, Sequence
from math import inf, isfinite
from operator import ge, itemgetter, le, sub
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError, ModelError

from ..messages import from_messages

MOVED = 2e-3
"""Way [rad or m] of a joint that has moved: more than an encoder's noise, less than a weld shows."""


class Beside:
    """
    Keeps the joints of messages that are none of the robot's, and which of them move.

    Where all of its own come behind another prefix, too, these are another robot's; one alone is
    not: controllers call the track of a robot `rail_joint_1`, or `group_2/joint_1`.
    """

    def __init__(self, robot: str, own: Sequence[str]) -> None:
        self._robot, self._own = robot, tuple(own)
        self._first: dict[str, float] = {}
        self._others: set[str] = set()
        self.moving: list[str] = []

    def take(self, names: Sequence[str], positions: Sequence[float]) -> None:
        """Take joints and where they are [rad or m]."""
        for name, at in zip(names, positions, strict=False):
            first = self._first.get(name)
            if first is None:
                if name in self._others or not isfinite(at):
                    continue
                # All of the robot's joints behind a prefix are another robot's.
                last = self._own[-1]
                prefixes = {name.removesuffix(last) for name in names if name.endswith(last)}
                sets = ({prefix + own for own in self._own} for prefix in prefixes)
                self._others |= {name for each in sets if each <= set(names) for name in each}
                if name not in self._others:
                    self._first[name] = at
            elif abs(at - first) > MOVED and name not in self.moving:
                self.moving.append(name)

    @property
    def remark(self) -> str:
        """Return which there are, in a sentence; empty where there are none."""
        if not self._first:
            return ''
        return f'joints that are none of robot {self._robot!r} are left out: ' + ', '.join(
            sorted(self._first)
        )

    def warning(self, known: Collection[str] = ()) -> str:
        """Return which of them move and do not carry the arm, in a sentence; empty for none."""
        moving = sorted(set(self.moving).difference(known))
        if not moving:
            return ''
        return (
            f'{" and ".join(moving)} moved and {"is" if len(moving) == 1 else "are"} none of the '
            f'joints of robot {self._robot!r}: where one carries the arm, its travel is missing in '
            'every pose; give a robot that has it, or name it in joints_beside if it carries nothing'
        )


TRAVEL = 0.02
"""
Way [rad or m] of a joint after which velocities that were zero all along are none: one degree, more
than an arm at rest creeps, and half a second of the slowest seam.
"""
_SLACK = 1e-6
"""What `Robot.check_positions` allows beyond a limit [rad or m]."""


def names_called(
    robot: Robot, prefix: str = '', called: Mapping[str, str] | None = None
) -> tuple[str, ...] | None:
    """Return what joint states call the joints of a robot; None where nothing is said of it."""
    given = called or {}
    if not prefix and not given:
        return None
    strange = [name for name in given if name not in robot.joint_names]
    if strange:
        raise ModelError(
            f'{strange[0]!r} is given another name, but is no joint of robot {robot.name!r}: '
            + ', '.join(robot.joint_names)
        )
    names = tuple(prefix + given.get(name, name) for name in robot.joint_names)
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise ModelError(f'two joints are given the name {twice!r}')
    return names


def _picker(index: Sequence[int]) -> Callable[[Any], tuple[float, ...]]:
    if len(index) > 1:
        return itemgetter(*index)
    only = index[0]
    return lambda row: (row[only],)


class JointSample(NamedTuple):
    """Stamp [ns], positions and velocities (n,), None without; efforts (n,) where asked for."""

    stamp: int
    q: Array
    qd: Array | None
    effort: Array | None = None


class Incomplete(DataError):
    """Joints of the robot are missing at a stamp that has passed."""


class Missing(Incomplete):
    """Joints of the robot are missing, and no message so far held them."""


class JointStates:
    """
    Takes joint states; gives samples of one robot.

    Messages about other joints are passed over. Joints spread over several publishers are put
    together where their stamps are equal, as those of one controller manager are; to hold one
    joint at its last position while another moves on would be a pose the arm never had.

    limits: whether positions beyond the joints' limits are refused. A running node does; a
    recording is read with them, for they tell of swapped joints and of degrees taken for radians.
    joint_names: what the joint states call the joints of the robot, in its order; left out, as the
    robot does, or with one prefix.
    mend: whether velocities are left out that stay zero while joints move. A running node does; of
    a recording it is reported as such.

    Counted are messages with no joint of the robot (`others`, their joints `strangers`), and with
    some, which wait for the rest (`parts`).
    """

    def __init__(
        self,
        robot: Robot,
        *,
        limits: bool = True,
        joint_names: Sequence[str] | None = None,
        mend: bool = False,
        efforts: bool = False,
    ) -> None:
        self._robot = robot
        self.efforts = efforts
        self._given = joint_names is not None
        self._names = robot.joint_names if joint_names is None else tuple(joint_names)
        self._mend = mend
        self._resting: list[float] | None = None
        self._zeros = False
        slack = _SLACK if limits else inf
        self._ranges = [
            (low - slack, high + slack)
            for low, high in zip(robot.lower.tolist(), robot.upper.tolist(), strict=True)
        ]
        self._usual: Any = None
        self._low, self._high = zip(*self._ranges, strict=True)
        self._pick = _picker(range(robot.n))
        self._apart: tuple[int, ...] = ()
        columns = enumerate(zip(*self._names, strict=False)) if self._given else ()
        start = next((k for k, column in columns if len(set(column)) > 1), 0)
        self.beside = Beside(robot.name, tuple(name[start:] for name in self._names))
        self._spread: set[str] = set()
        self._stamp = 0
        self._parts: dict[str, tuple[float, float]] = {}
        self.others = self.parts = 0
        self.strangers: dict[str, None] = {}
        self.remark = ''
        self.velocity_remark = ''

    @property
    def names(self) -> tuple[str, ...]:
        """Return the robot's joints as the messages name them."""
        return self._names

    def take(self, message: Any) -> JointSample | None:
        """
        Return the sample that a message completes, None if it completes none.

        Raises Incomplete: joints are missing and will not come any more.
        """
        sample = self._taken(message)
        if sample is not None and self.efforts:
            sample = sample._replace(effort=from_messages.joint_efforts(message, self._names))
        if sample is None or not self._mend or sample.qd is None:
            return sample
        if self._only_zeros(sample.q.tolist(), sample.qd.tolist()):
            return JointSample(sample.stamp, sample.q, None, sample.effort)
        return sample

    def _only_zeros(self, q: list[float], qd: list[float]) -> bool:
        """Return whether velocities stay zero while joints move, as some drivers have them."""
        if any(qd):
            self._resting, self._zeros = None, False
        elif self._resting is None:
            self._resting = q
        elif not self._zeros and max(map(abs, map(sub, q, self._resting))) > TRAVEL:
            self._zeros = True
            self.velocity_remark = (
                'velocities are zero while the joints move; they are taken from the positions'
            )
        return self._zeros

    def _taken(self, message: Any) -> JointSample | None:
        """Return the sample as the message has it; raise Incomplete as `take` does."""
        stamp = from_messages.stamp_ns(message)
        # A node's decoder repeats the very object, which is quicker than to compare the names.
        if message.name is self._usual or message.name == self._usual:
            quick = self._quick(stamp, message)
            if quick is not None:
                return quick
        present = from_messages.joints_present(message, self._names)
        if not present:
            if not message.name:
                raise Missing('the joint state names no joint')
            if not (self._take_own_names(message) or self._take_prefix(message.name)):
                self.others += 1
                if len(message.name) < len(
                    self._names
                ):  # what carries an arm has fewer axes than it
                    self.beside.take(message.name, message.position)
                self.strangers.update(dict.fromkeys(message.name))
                return None
            present = self._names
        if 0 < len(present) < len(self._names):
            return self._part(stamp, message, present)
        q = from_messages.joint_positions(message, self._names)
        self._check(q)
        self._usual = message.name
        self._pick = _picker([list(message.name).index(name) for name in self._names])
        own = set(self._names)
        self._apart = tuple(k for k, name in enumerate(message.name) if name not in own)
        self._take_beside(message, self._apart)
        return JointSample(stamp, q, from_messages.joint_velocities(message, self._names))

    def _take_own_names(self, message: Any) -> bool:
        """Go back to the robot's own names where they come: the prefix was another robot's."""
        own = self._robot.joint_names
        if not self._mend or self._given or self._names == own:
            return False
        if from_messages.joints_present(message, own) != own:
            return False
        self._names, self._usual = own, None
        self.remark = (
            'the joints come under their own names now; what came with a prefix before was '
            'of another robot'
        )
        return True

    def _take_prefix(self, names: Sequence[str]) -> bool:
        """Take the names of a message for the robot's own with one prefix, if they are."""
        if self._given or self._usual is not None or self._spread:
            return False  # the names are known: these are the joints of another robot
        prefixes = set.intersection(
            *(
                {each.removesuffix(own) for each in names if each.endswith(own)}
                for own in self._names
            )
        )
        if len(prefixes) > 1:
            listed = ', '.join(repr(each) for each in sorted(prefixes))
            raise DataError(
                f'the joint state holds the joints of several robots, with the prefixes {listed}; '
                "say which with joint_prefix, publish each robot's on a topic of its own, or name the "
                'joints in the robot file as the joint state does'
            )
        if not prefixes:
            return False
        prefix = prefixes.pop()
        self._names = tuple(prefix + own for own in self._names)
        self.remark = f'the joints are named with the prefix {prefix!r}; they are taken without it'
        return True

    def _quick(self, stamp: int, message: Any) -> JointSample | None:
        """Return the sample of a message with the names of the last one, None if in doubt."""
        position, velocity, count = message.position, message.velocity, len(message.name)
        if len(position) != count or len(velocity) not in (0, count):
            return None
        # What runs in C runs as fast after two idle milliseconds; bytecode takes five times as long.
        if self._apart:
            self._take_beside(message, self._apart)
        q = self._pick(position)
        qd = self._pick(velocity) if len(velocity) else ()
        if not (all(map(ge, q, self._low)) and all(map(le, q, self._high))):
            return None
        if not (isfinite(sum(q)) and isfinite(sum(qd))):
            return None
        return JointSample(stamp, np.array(q), np.array(qd) if qd else None)

    def _take_beside(self, message: Any, apart: Sequence[int]) -> None:
        """Take what a message with joints of the robot has beside them, at these places."""
        name, position = message.name, message.position
        self.beside.take([name[k] for k in apart], [position[k] for k in apart])

    def _check(self, q: Array) -> None:
        """Refuse what lies beyond the limits; the robot has the sentence."""
        for value, (low, high) in zip(q.tolist(), self._ranges, strict=True):
            if not low <= value <= high:
                self._robot.check_positions(q)

    def _part(self, stamp: int, message: Any, present: tuple[str, ...]) -> JointSample | None:
        if self.efforts:
            raise DataError(
                'several publishers tell the joints, and their efforts are not put together; '
                'publish all joints in one message, or leave --use-effort out'
            )
        q = from_messages.joint_positions(message, present)
        qd = from_messages.joint_velocities(message, present)
        remaining, before = self._missing(self._parts), self._stamp
        if stamp != before:
            self._parts, self._stamp = {}, stamp
        unknown = np.full(len(present), np.nan)
        self._parts |= {
            name: (float(a), float(b))
            for name, a, b in zip(present, q, unknown if qd is None else qd, strict=True)
        }
        self._spread.update(present)
        if len(self._spread) < len(self._names):
            missing = next(name for name in self._names if name not in self._spread)
            listed = ', '.join(message.name)
            raise Missing(f'the joint state has no joint {missing!r}; it has {listed}')
        self._take_beside(message, [k for k, x in enumerate(message.name) if x not in present])
        if stamp != before and 0 < len(remaining) < len(self._names):
            raise Incomplete(
                f'joint {remaining[0]!r} never came with the stamp {before * 1e-9:.6f} s; publish all '
                'joints in one message, or with equal stamps'
            )
        if self._missing(self._parts):
            self.parts += 1
            return None
        return self._whole()

    def _missing(self, parts: Mapping[str, Any]) -> list[str]:
        return [name for name in self._names if name not in parts]

    def _whole(self) -> JointSample:
        values = np.array([self._parts[name] for name in self._names])
        self._check(values[:, 0])
        qd = None if np.isnan(values[:, 1]).any() else values[:, 1]
        return JointSample(self._stamp, values[:, 0], qd)
