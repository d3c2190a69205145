# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Options that several subcommands share."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any

from .parsing import Adder, Parser, short_help

if TYPE_CHECKING:
    from weld_twin_core.arm.robot import Robot
    from weld_twin_core.cameras import Camera, Target
    from weld_twin_core.twin.twin import Twin
    from weld_twin_msgs_py.messages.topics import TopicNames
    from weld_twin_msgs_py.robots.urdf_like import GivenUrdf

PARTS = {
    'joint': 'JointState, DynamicJointState or JointTrajectoryControllerState (TOPIC:feedback)',
    'pose': 'PoseStamped, PoseWithCovarianceStamped, TransformStamped, /tf:FRAME, or a '
    'JointTrajectoryControllerState, of which the pose of the feedback is taken',
    'image': 'PointCloud2 of target, point, u, v; or AprilTagDetectionArray',
}
"""What the topics may hold besides the usual; after a colon, the part that is meant."""
TOPIC_OPTIONS = ('joint', 'pose', 'point', 'image', 'wrench', 'temperature')
TOPICS = (
    *('namespace', 'joint_prefix', 'joint_map', 'measured_inverse', 'use_effort'),
    *('camera', 'target'),
    *(f'{name}_topic' for name in TOPIC_OPTIONS),
)
"""Attributes of the options of `add_topics`."""


def add_robot(parser: argparse.ArgumentParser, *, required: bool = True) -> None:
    """Add the options that name a robot."""
    add = Adder(parser)
    text = "a robot of 'weld-twin bag --robots', a robot file or a URDF"
    add('--robot', 'R', text, required=required, type=_robot_file)
    add = Adder(parser, 'chain of a URDF', rare=True)
    add('--base-link', 'LINK', "first link of the chain; the controller's base is there too")
    add('--tip-link', 'LINK', 'last link of the chain')
    add('--flange-link', 'LINK', "the controller's flange (default: tool0, flange or as it moves)")


def _robot_file(spec: str) -> str:
    """Return the file of a robot of one's own that is named; what else was given as it is."""
    from weld_twin_msgs_py.robots.own_robots import as_file

    return as_file(spec)


def robot_of(args: argparse.Namespace) -> Robot:
    """Return the robot the options name."""
    from weld_twin_msgs_py.robots import load_robot

    return load_robot(args.robot, args.base_link, args.tip_link, args.flange_link)


def given_urdf(args: argparse.Namespace) -> GivenUrdf | None:
    """Return the URDF that the robot was read from, None for another robot file."""
    from weld_twin_msgs_py.robots.load import URDF_SUFFIXES
    from weld_twin_msgs_py.robots.urdf_like import GivenUrdf

    path = Path(args.robot)
    if path.suffix.lower() not in URDF_SUFFIXES:
        return None
    return GivenUrdf(path, args.base_link, args.tip_link, args.flange_link)


def twin_of(robot: Robot, path: str, *, implausible: bool = False) -> Twin:
    """Return the robot with the effects of a file; say which values no machine has."""
    from ..offline.told_twin import build_twin

    # Recordings that it is for are checked, and mended, by themselves.
    twin = build_twin(robot, path, implausible=implausible, mended=True)
    say_doubts(twin, path)
    return twin


def say_doubts(twin: Twin, path: str) -> None:
    """Say on stderr which values of a model no machine has."""
    from ..offline.told_twin import doubts

    for doubt in doubts(twin):
        print(f'weld-twin: {path}: {doubt}', file=sys.stderr)


def add_topics(parser: argparse.ArgumentParser) -> None:
    """Add the options that say what the topics of a bag are called."""
    add = Adder(parser, 'topics, for bags recorded elsewhere', rare=True)
    add('--namespace', 'NS', 'namespace of the robot; left stands for /left/...', default='')
    for name in TOPIC_OPTIONS:
        add(f'--{name}-topic', 'TOPIC', PARTS.get(name, f'of the {name}'))
    text = "what the joint states put before the robot's joint names (default: any one prefix)"
    add('--joint-prefix', 'TEXT', text, default='')
    text = 'joints of the robot and what the joint states call them, such as joint_1=A1'
    add('--joint-map', 'JOINT=NAME', text, nargs='+', default=[])
    text = 'the poses are those of something fixed seen from the arm, as of a board by a camera'
    add('--measured-inverse', text)
    text = "springs of joints take JointState.effort [N m] for their load, not the model's statics"
    add('--use-effort', text)
    add_cameras(parser)


def add_cameras(parser: argparse.ArgumentParser) -> None:
    """Add the options that describe cameras and what they look at."""
    add = Adder(parser, 'cameras', rare=True)
    text = 'camera_info of a camera, with mount: tool or world; once for each'
    add('--camera', 'NAME=FILE', text, many=True)
    text = 'points of a target or numbers of a board [m], with mount: tool or world'
    add('--target', 'NAME=FILE', text, many=True)


def cameras_of(args: argparse.Namespace) -> tuple[tuple[Camera, ...], tuple[Target, ...]]:
    """Return the cameras and targets that the options describe."""
    from ..offline.told_cameras import told_cameras

    return told_cameras(args.camera, args.target)


def topics_of(args: argparse.Namespace) -> TopicNames:
    """Return the names of the topics."""
    from dataclasses import replace

    from weld_twin_core.errors import DataError
    from weld_twin_msgs_py.messages.topics import TopicNames

    given = {name: getattr(args, f'{name}_topic') for name in TOPIC_OPTIONS}
    given['joints'], given['images'] = given.pop('joint'), given.pop('image')
    named = {name: value for name, value in given.items() if value}
    pairs = []
    for text in args.joint_map:
        joint, mark, name = text.partition('=')
        if not (joint and mark and name):
            raise DataError(f"--joint-map takes JOINT=NAME, got '{text}'")
        pairs.append((joint, name))
    names = replace(TopicNames.within(args.namespace), **named)
    cameras, targets = cameras_of(args)
    return replace(
        names,
        cameras=cameras,
        targets=targets,
        joint_prefix=args.joint_prefix,
        joint_map=tuple(pairs),
        measured_inverse=args.measured_inverse,
        use_effort=args.use_effort or _learned_by_effort(args),
    )


def _learned_by_effort(args: argparse.Namespace) -> bool:
    """Return whether springs of the model that is given take measured efforts."""
    from ..offline.told_twin import by_effort

    given = (getattr(args, name, None) for name in ('model', 'effects_known'))
    return any(by_effort(path) for path in given if path)


def add_pool(parser: argparse.ArgumentParser) -> None:
    """Add the options that say where tasks run."""
    add = Adder(parser)
    add('--workers', 'N', 'processes (default: all cores)', type=int, default=0)
    text = 'Dask cluster to run on instead; it must see the same directories'
    add('--scheduler', 'ADDRESS', text, default='', rare=True)


def add_output(parser: argparse.ArgumentParser, text: str, default: str | None = None) -> None:
    """Add the options of a command that writes a folder of files."""
    Adder(parser)('--out', 'DIR', text, required=default is None, default=default)
    add_force(parser)


def add_force(parser: argparse.ArgumentParser) -> None:
    """Add the option that settles what is in the way."""
    text = 'write also where files of yours are in the way; they are kept as NAME.kept-1'
    Adder(parser, rare=True)('--force', text)


def output(args: argparse.Namespace, mark: str) -> AbstractContextManager[Path]:
    """Return the folder that the options name, as `output_directory.new_directory` does."""
    from ..offline.output_directory import new_directory

    return new_directory(args.out, mark=mark, force=args.force)


def add_file_output(parser: argparse.ArgumentParser, text: str, *, required: bool = False) -> None:
    """Add the options of a command that writes one file."""
    Adder(parser)('--out', 'FILE', text, required=required)
    add_force(parser)


def output_file(args: argparse.Namespace) -> AbstractContextManager[Path]:
    """Return the file that the options name, as `output_directory.new_file` does."""
    from ..offline.output_directory import new_file

    return new_file(args.out, force=args.force)


def add_bag_output(parser: argparse.ArgumentParser) -> None:
    """Add the options of a command that writes a bag."""
    Adder(parser)('--out', 'BAG', 'bag to write; it must not exist yet', required=True)
    add_storage(parser)


def add_storage(parser: argparse.ArgumentParser) -> None:
    """Add the option that says in which form a bag is written."""
    text = 'form of the bag: mcap or sqlite3 (default: mcap)'
    Adder(parser, rare=True)('--storage', text, choices=('mcap', 'sqlite3'), default='mcap')


def refuse(args: argparse.Namespace, names: Sequence[str], why: str) -> None:
    """
    Refuse options that do nothing with what else was given.

    Parameters
    ----------
    names : sequence of str
        Attributes of options that are None, empty or False unless given.
    why : str
        The rest of the sentence that begins with the option.

    Raises
    ------
    DataError
        One of them was given.

    """
    from weld_twin_core.errors import DataError

    for name in names:
        value = getattr(args, name)
        if value or (value is not None and not isinstance(value, bool | str | list | tuple)):
            raise DataError(f'--{name.replace("_", "-")} {why}')


def add_command(
    subparsers: Any, name: str, module: ModuleType | SimpleNamespace
) -> argparse.ArgumentParser:
    """
    Add a subcommand whose help is the module's docstring, with the module's own options.

    Parameters
    ----------
    subparsers : what ``add_subparsers`` returned
    name : str
        As the user types it.
    module : module
        With ``add_arguments(parser)`` and maybe ``EXAMPLE``, a whole command line; the first line
        of its docstring is the short help.

    """
    text = (module.__doc__ or '').strip()
    parser: argparse.ArgumentParser = subparsers.add_parser(
        name, help=short_help(text), description=text
    )
    if isinstance(parser, Parser):
        parser.example = getattr(module, 'EXAMPLE', '')
    module.add_arguments(parser)
    return parser
