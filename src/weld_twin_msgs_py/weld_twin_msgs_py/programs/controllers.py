# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Where a maker's controller has its frames, joints and external axes, on the model of a robot.

The models of this project stand on the floor and count joint 3 from joint 2, as ROS drivers do.
FANUC's and Yaskawa's controllers have their origin at the height of the second axis, and FANUC
counts joint 3 from the ground. Of a URDF the base and the flange are links.

KUKA has E1 to E6 in every position, ABB the six values of an extjoint, FANUC the extended axes E1 to
E3 of the arm's group and the joints of further groups. No file of a program says which joint of a
robot file is which, so a user says it. All count as the joint does, or the other way round.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, NoReturn

import numpy as np

from weld_twin_core.arm.controller_frames import ControllerFrames
from weld_twin_core.arm.known_arms import bundled_name, controller_frames
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.motion.inverse import CarriedArm
from weld_twin_core.recording import Counted

from .source import Notation, Number, Source, joint_notation

LABELS = {
    'krl': (r'E[1-6]', 'E1=rail,E2=tilt'),
    'rapid': (r'eax_[a-f]', 'eax_a=rail,eax_b=tilt'),
    'fanuc-ls': (r'E[1-3]|GP[2-8]\.J[1-9]', 'E1=rail,GP2.J1=tilt'),
}
"""What external axes are called, and how a user says which is which."""
BY_NAME = ('joint-trajectory', 'csv')
"""Languages that call joints by their names, those of a positioner and a track like all others."""
ARM = 6
"""Joints of an arm; that many are left behind a track, or what slides first is the arm itself."""


class ExternalAxis(NamedTuple):
    label: str  # as the controller calls it
    joint: int  # of the robot, counted from 0
    sign: float = 1.0  # -1 where it counts the other way round


def carrying(robot: Robot) -> int:
    """Return how many first joints of a robot are a positioner's, or a track's that carries an arm."""
    count = robot.behind
    while robot.prismatic[count] and robot.n - count > ARM:
        count += 1
    return count


def external_axes(given: str, robot: Robot, language: str) -> tuple[ExternalAxis, ...]:
    """Return external axes in the order of the joints, given as ``E1=rail,E2=-tilt``."""
    names = robot.joint_names[: carrying(robot)]
    listed = ', '.join(names)
    if language not in LABELS:
        if given:
            raise DataError(f'--external is for {", ".join(LABELS)}, and this is {language}')
        if names and robot.behind and language not in BY_NAME:
            raise DataError(
                f'external axes of {language} are not known here, and robot {robot.name!r} has some '
                f'({listed}); choose {", ".join((*LABELS, *BY_NAME))}, or take the robot alone'
            )
        return tuple(map(ExternalAxis, names, range(len(names)))) if robot.behind else ()
    pattern, example = LABELS[language]
    if not given:
        if names:
            raise DataError(
                f'say which external axes of the controller the joints {listed} are, such as '
                f'--external {example}; a minus before a joint is for one that counts the other way'
            )
        return ()
    axes = [_axis(text.strip(), pattern, robot) for text in given.split(',')]
    joints = sorted(axis.joint for axis in axes)
    if joints != list(range(max(len(names), len(axes)))) or len({a.label for a in axes}) < len(
        axes
    ):
        raise DataError(
            f'--external must tell each of the joints {listed or "before the arm"} once, each under a '
            f'name of its own, and no joint of the arm; got {given!r}'
        )
    return tuple(sorted(axes, key=lambda axis: axis.joint))


def _axis(text: str, pattern: str, robot: Robot) -> ExternalAxis:
    label, sign, joint = (part.strip() for part in text.partition('='))
    result = re.fullmatch(pattern, label, re.I)
    if not sign or result is None:
        raise DataError(f'--external needs NAME=joint with NAME like {pattern}, got {text!r}')
    name = label.lower() if label.lower().startswith('eax') else label.upper()
    back = joint.startswith('-')
    return ExternalAxis(name, robot.index(joint.removeprefix('-')), -1.0 if back else 1.0)


def shown_order(robot: Robot, axes: tuple[ExternalAxis, ...]) -> Array:
    """Return the joints of a robot from those a controller shows, (n, n): the arm's, then others."""
    out, own = np.zeros((robot.n, robot.n)), robot.n - len(axes)
    out[np.arange(len(axes), robot.n), np.arange(own)] = 1.0
    for k, axis in enumerate(axes):
        out[axis.joint, own + k] = axis.sign
    return out


AT_SECOND_AXIS = {'fanuc-ls': ('fanuc', 'FANUC'), 'inform': ('yaskawa', 'Yaskawa')}
"""Languages whose controllers have the origin there, with the names of bundled robots and maker."""
COUPLED = 'fanuc-ls'
"""The language whose controller counts joint 3 from the ground."""


class Cell(NamedTuple):
    """What a user tells of the axes beside an arm."""

    external: str = ''  # which joint is which, as ``E1=rail,E2=-tilt``
    along: frozenset[str] | None = None
    """Names of bases that go along with a positioner, in lower case; None where it was not
    told."""
    world: Array | None = None
    """Where the link that the track stands in is in the world of the controller, shape (4, 4) [m]; of
    a robot file that tells of none, where its rows begin."""


_SAME_TOOL = 1e-4
"""Difference [m, and of axes] up to which numbers are those of one tool: pendants show hundredths of a
millimetre and of a degree."""
_PLAIN = re.compile(r'[A-Za-z_$]\w*|\d+')
"""A name or number of a tool, such as the controller has numbers for."""


class Frame(NamedTuple):
    """A tool or base frame as a program names it."""

    name: str
    value: Array | None = None  # shape (4, 4) [m]; None where the program has no numbers
    moving: bool | None = False
    """A base that goes along with a positioner; None where the program does not say."""
    why: str = ''
    """Why the program does not say where it is at a move; then only numbers that were given
    count."""


@dataclass(frozen=True, eq=False)
class Controller:
    """The frames of a controller on a robot."""

    origin: Array
    """``T_base_origin``: the controller's robot frame in the base frame of the model, shape (4, 4)
    [m]."""
    flange: Array
    """The controller's flange on the last frame of the model, shape (4, 4) [m]."""
    mix: Array  # joints of the model from those of the controller, shape (n, n)
    own_tool: Array  # the tool of the robot's model, shape (4, 4) [m]
    tools: Mapping[str, Array] = field(default_factory=dict)
    bases: Mapping[str, Array] = field(default_factory=dict)
    """Frames that were given, by the names of the program, in lower case."""
    notes: list[str] = field(default_factory=list)  # what was assumed, in sentences
    external: tuple[ExternalAxis, ...] = ()
    """In the order of the robot's first joints, which they are."""
    along: frozenset[str] | None = None
    """Names of bases that go along with a positioner, in lower case; None where nobody said."""
    world_known: bool = True
    """Where bases that stand still count from is known. It is not of an arm on a track, unless
    told."""
    positioner: bool = False  # some of the external axes move the workpiece
    bare: set[str] = field(default_factory=set)
    """Names of the tools of a program that nobody gives numbers for."""
    own_names: set[str] = field(default_factory=set)
    """Names of those whose numbers are those of the robot file's tool."""

    def tool(self, frame: Frame) -> Array:
        """Return ``T_flange_tool`` on the model."""
        given = self.tools.get(frame.name.lower())
        if given is not None or frame.value is not None:
            value = frame.value if given is None else given
            assert value is not None
            return np.asarray(self.flange @ value)
        if frame.why:
            raise DataError(frame.why + _ask(frame, '--tool'))
        if not frame.name:
            return self.own_tool
        if not _PLAIN.fullmatch(frame.name):
            raise DataError(
                f'tool {frame.name} is worked out when the program runs' + _ask(frame, '--tool')
            )
        if np.abs(self.own_tool[:3, 3] - self.flange[:3, 3]).max() < 1e-9:
            raise DataError(
                f'the numbers of tool {frame.name} are not in the program, and the robot file has '
                'no tool' + _ask(frame, '--tool')
            )
        if self.own_names:
            raise DataError(
                f'the numbers of tool {frame.name} are not in the program, and the tool of the robot '
                f'file is tool {min(self.own_names)}' + _ask(frame, '--tool')
            )
        if len(self.bare) > 1:
            listed = ', '.join(sorted(self.bare))
            raise DataError(
                f'the numbers of tools {listed} are not in the program, and only one of them can be '
                'that of the robot file' + _ask(frame, '--tool')
            )
        self._note(
            f'the numbers of tool {frame.name} are not in the program; the tool of the robot file '
            'was taken'
        )
        return self.own_tool

    def name_tools(self, frames: Iterable[Frame]) -> None:
        """Take in all tools of a program: the robot file has the numbers of one."""
        self.bare.clear()
        self.own_names.clear()
        for frame in frames:
            value = self.tools.get(frame.name.lower(), frame.value)
            if not frame.name or (value is None and frame.why):
                continue
            if value is None:
                self.bare.add(frame.name)
            elif np.abs(self.flange @ value - self.own_tool).max() < _SAME_TOOL:
                self.own_names.add(frame.name)

    def goes_along(self, frame: Frame) -> bool:
        """Tell whether a base goes along with a positioner."""
        moving = frame.moving
        if moving and not self.positioner:
            raise DataError(
                'the base goes along with a positioner, and the robot file has none; give it as '
                "'workpiece' (docs/conventions.md)"
            )
        if self.positioner and moving is None:
            if self.along is None:
                raise DataError(
                    f'whether base {frame.name} goes along with the positioner is not in the '
                    f"program; say --on-positioner '{frame.name}', or --on-positioner none"
                )
            moving = frame.name.lower() in self.along
        if not moving and not self.world_known:
            raise DataError(
                'positions in a frame that stands still count from the world of the controller, and '
                'where the track begins in it is not known; say it with --world X,Y,Z,...'
            )
        return bool(moving)

    def base(self, frame: Frame) -> Array:
        """Return ``T_base_frame`` on the model; of one that goes along, on the positioner's flange."""
        given = self.bases.get(frame.name.lower())
        origin = np.eye(4) if self.goes_along(frame) else self.origin
        if given is not None:
            return np.asarray(origin @ given)
        if frame.value is not None:
            return np.asarray(origin @ frame.value)
        if not frame.name and not frame.why:
            return origin
        raise DataError(
            (frame.why or f'the numbers of base {frame.name} are not in the program')
            + _ask(frame, '--base')
        )

    def _note(self, text: str) -> None:
        if text not in self.notes:
            self.notes.append(text)


def _ask(frame: Frame, option: str) -> str:
    return f"; give them with {option} '{frame.name}=X,Y,Z,...'" if frame.name else ''


def controller_of(
    robot: Robot,
    language: str,
    tools: Mapping[str, Array] | None = None,
    bases: Mapping[str, Array] | None = None,
    cell: Cell | None = None,
) -> Controller:
    """
    Return the frames of the controller that runs a language, with those that were given.

    Each maker's controller runs its own, on its own robots; on others nothing is assumed.
    """
    given = cell or Cell()
    axes = external_axes(given.external, robot, language)
    arm = CarriedArm(robot, len(axes)).arm
    frames = robot.controller or controller_frames(arm)
    origin, notes = np.array(frames.base), _linked(frames)
    if given.world is not None:
        origin = robot.T_base_foot @ np.linalg.inv(given.world)
        notes.append(_track_begins(robot))
    mix = _counting(arm, robot, language, origin, notes)
    if axes and language in LABELS:
        mix = shown_order(robot, axes) @ mix
        notes += _cell_notes(robot, axes)
    return Controller(
        origin,
        np.array(frames.flange),
        mix,
        np.array(robot.T_flange_tool),
        _lower(tools),
        _lower(bases),
        notes,
        axes,
        given.along,
        given.world is not None or len(axes) == robot.behind,
        robot.behind > 0,
    )


def _track_begins(robot: Robot) -> str:
    where = 'the first link of the chain'
    if robot.controller is None:
        where = 'the frame of the first row of the robot file, its z along the first axis,'
    elif not robot.controller.base_link:
        where = "the 'foot' of the robot file"
    return f'--world was taken to be where {where} stands'


def world_of(robot: Robot, language: str) -> tuple[Array, str]:
    """
    Return the world of a controller as delivered, in the frame where the robot's own rows begin.

    It is the arm's own base, or where its track begins, as the second value says.
    """
    count = carrying(robot)
    if count > robot.behind:
        return robot.T_base_foot, 'where the track begins'
    arm = CarriedArm(robot, count).arm
    frames = robot.controller or controller_frames(arm)
    origin, notes = np.array(frames.base), list[str]()
    _counting(arm, robot, language, origin, notes)
    if origin[2, 3] != frames.base[2, 3]:
        return origin, 'on axis 1 at the height of axis 2'
    return origin, f'link {frames.base_link}' if frames.base_link else 'the base of the robot file'


def _counting(arm: Robot, robot: Robot, language: str, origin: Array, notes: list[str]) -> Array:
    """Return joints of the model from those shown, (n, n); note it, and lift the origin there."""
    mix = np.eye(robot.n)
    begin, maker = AT_SECOND_AXIS.get(language, ('none', ''))
    if bundled_name(arm).startswith(begin):
        if robot.controller is None:
            origin[2, 3] = arm.d[0]
            notes.append(
                f'positions count from the origin of {maker}, {arm.d[0]:.4g} m above the floor'
            )
        if language == COUPLED:
            mix[2, 1] = 1.0
            notes.append('J3 counts from the ground, as the teach pendant shows it')
    elif language == COUPLED and (arm is not robot or robot.controller is not None):
        notes.append(
            'J3 is taken as the joint of the robot file; if the teach pendant counts it from the '
            'ground, points in joints are read wrongly'
        )
    return mix


def _cell_notes(robot: Robot, axes: Sequence[ExternalAxis]) -> list[str]:
    listed = ', '.join(
        f'{axis.label} is {"-" if axis.sign < 0.0 else ""}{robot.joint_names[axis.joint]}'
        for axis in axes
    )
    out = [f'{listed} of the robot file, with its zero; compare them with the pendant']
    if robot.behind:
        out.append(
            'frames that go along with the positioner count from the end of its last row in the robot '
            'file, where its flange is taken to be'
        )
    return out


def _lower(frames: Mapping[str, Array] | None) -> dict[str, Array]:
    return {name.lower(): value for name, value in (frames or {}).items()}


def _linked(frames: ControllerFrames) -> list[str]:
    """Return which links of a URDF were taken for the controller's base and flange."""
    if not frames.base_link:
        return []
    return [
        f'positions count from link {frames.base_link!r} of the URDF, and tools from link '
        f'{frames.flange_link!r}; --base-link and --flange-link choose others'
    ]


class Context(NamedTuple):
    """The robot that runs a program."""

    robot: Robot
    controller: Controller
    pulses_per_degree: Array | None = None
    """Of a Yaskawa arm whose points are in pulses, shape (n,)."""
    counted: Counted | None = None
    """How the controller counts the joints, where a recording of it tells."""
    beside: tuple[Source, ...] = ()
    """Other programs of its folder, whose routines it may call."""

    @property
    def axes(self) -> int:
        """Return how many joints the controller has as the arm's own."""
        return self.robot.n - len(self.controller.external)

    def external(self, numbers: Sequence[Number | None]) -> Array | None:
        """Return external axes [deg, mm] as joints of the model; None where one is missing."""
        values = [number.value for number in numbers if number is not None]
        if len(values) < len(numbers):
            return None
        shown = [0.0] * self.axes + values
        return self.degrees().value(shown)[: len(values)]

    def degrees(self, decimals: int = 5) -> Notation:
        """Return joint positions in degrees, of sliding joints in millimetres."""
        slides = np.abs(self.controller.mix.T) @ self.robot.prismatic > 0.0
        unit = np.where(slides, 1e-3, np.pi / 180.0)
        return self.shown(unit, decimals, 'joints in degrees')

    def radians(self, decimals: int = 7) -> Notation:
        """Return joint positions in radians, of sliding joints in metres."""
        return self.shown(np.ones(self.robot.n), decimals, 'joints in radians')

    def shown(self, unit: Array, decimals: int, name: str) -> Notation:
        """
        Return joint positions as the controller shows them, in units of the model's, shape (n,).

        They can be neither read nor written where it is known to count otherwise.
        """
        out = joint_notation(unit, self.controller.mix, decimals, name)
        return out._replace(value=self._refuse, numbers=self._refuse) if self.otherwise() else out

    def otherwise(self) -> str:
        """Return why joint values of the controller are not known; empty where they are."""
        if self.counted is None:
            return ''
        matrix, offset = self.counted
        order = abs(shown_order(self.robot, self.controller.external))
        if not offset.any() and np.allclose(matrix @ order, self.controller.mix):
            return ''
        names = self.robot.joint_names
        off = abs(matrix - np.eye(len(names))).any(axis=1) | (offset != 0.0)
        which = ', '.join(name for name, one in zip(names, off, strict=True) if one)
        return (
            f'the controller counts {which} otherwise, as the table of the recording was read, and '
            'joint values of its programs are not known here; take poses, or a robot file that counts '
            'as the controller does'
        )

    def _refuse(self, *_: object) -> NoReturn:
        raise DataError(self.otherwise())
