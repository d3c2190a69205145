# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Options that several subcommands share."""

from __future__ import annotations

import argparse
import sys
from contextlib import AbstractContextManager
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

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
}
"""What the topics may hold besides the usual; after a colon, the part that is meant."""
TOPIC_OPTIONS = ('joint', 'pose', 'point', 'wrench', 'temperature')


def add_robot(parser: argparse.ArgumentParser, *, required: bool = True) -> None:
    """Add the options that name a robot."""
    parser.add_argument(
        '--robot',
        required=required,
        type=_robot_file,
        metavar='R',
        help='a bundled robot or one of your own (weld-twin info --robots lists them), a robot file '
        'or a URDF',
    )
    parser.add_argument(
        '--base-link',
        metavar='LINK',
        help="first link of a chain in a URDF; the controller's base is there too",
    )
    parser.add_argument('--tip-link', metavar='LINK', help='last link of a chain in a URDF')
    parser.add_argument(
        '--flange-link',
        metavar='LINK',
        help='link of a URDF where the controller has its flange; left out, tool0, flange or the '
        'last one that moves, as the file has it',
    )


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
    group = parser.add_argument_group('topics, for bags recorded elsewhere')
    group.add_argument(
        '--namespace',
        default='',
        metavar='NS',
        help='namespace of the robot; left stands for /left/...',
    )
    for name in TOPIC_OPTIONS:
        group.add_argument(f'--{name}-topic', metavar='TOPIC', help=PARTS.get(name))
    group.add_argument(
        '--joint-prefix',
        default='',
        metavar='TEXT',
        help="what the joint states put before the robot's joint names (default: any one prefix)",
    )
    group.add_argument(
        '--joint-map',
        nargs='+',
        default=[],
        metavar='JOINT=NAME',
        help='joints of the robot and what the joint states call them, such as joint_1=A1',
    )
    group.add_argument(
        '--measured-inverse',
        action='store_true',
        help='the measured poses are those of something fixed seen from the arm, such as of a board '
        'by a camera on the arm; they are inverted',
    )
    group.add_argument(
        '--use-effort',
        action='store_true',
        help='springs of joints take JointState.effort [N m] for their load, in the place of the '
        "model's statics; a model that was learned so has it read without this",
    )
    add_cameras(group)


def add_cameras(group: argparse._ActionsContainer) -> None:
    """Add the options that describe cameras and what they look at."""
    group.add_argument(
        '--camera',
        action='append',
        default=[],
        metavar='NAME=FILE',
        help='camera_info of a camera, with mount: tool or world; once for each',
    )
    group.add_argument(
        '--target',
        action='append',
        default=[],
        metavar='NAME=FILE',
        help='points of a target in its own frame [m], with mount: tool or world; once for each',
    )


def cameras_of(args: argparse.Namespace) -> tuple[tuple[Camera, ...], tuple[Target, ...]]:
    """Return the cameras and targets that the options describe."""
    from weld_twin_msgs_py.tables import read_camera, read_target

    cameras = tuple(read_camera(*_named(text, '--camera')) for text in args.camera)
    # What a camera on the tool looks at stands still, where nothing else is said.
    mounts = {camera.mount for camera in cameras}
    other = 'world' if mounts == {'tool'} else 'tool'
    return cameras, tuple(read_target(*_named(text, '--target'), other) for text in args.target)


def _named(text: str, option: str) -> tuple[str, str]:
    from weld_twin_core.errors import DataError

    name, mark, path = text.partition('=')
    if not (name and mark and path):
        raise DataError(f"{option} takes NAME=FILE, got '{text}'")
    return name, path


def topics_of(args: argparse.Namespace) -> TopicNames:
    """Return the names of the topics."""
    from dataclasses import replace

    from weld_twin_core.errors import DataError
    from weld_twin_msgs_py.messages.topics import TopicNames

    given = {name: getattr(args, f'{name}_topic') for name in TOPIC_OPTIONS}
    given['joints'] = given.pop('joint')
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
    parser.add_argument(
        '--workers', type=int, default=0, metavar='N', help='processes (default: all cores)'
    )
    parser.add_argument(
        '--scheduler',
        default='',
        metavar='ADDRESS',
        help='Dask cluster to run on instead; it must see the same directories',
    )


def add_output(parser: argparse.ArgumentParser, text: str, default: str | None = None) -> None:
    """Add the options of a command that writes a folder of files."""
    parser.add_argument(
        '--out', required=default is None, default=default, metavar='DIR', help=text
    )
    add_force(parser)


def add_force(parser: argparse.ArgumentParser) -> None:
    """Add the option that settles what is in the way."""
    parser.add_argument(
        '--force',
        action='store_true',
        help='write also where files are in the way that weld-twin has not written, or that were '
        'changed since; they are kept as NAME.kept-1',
    )


def output(args: argparse.Namespace, mark: str) -> AbstractContextManager[Path]:
    """Return the folder that the options name, as `output_directory.new_directory` does."""
    from ..offline.output_directory import new_directory

    return new_directory(args.out, mark=mark, force=args.force)


def add_file_output(parser: argparse.ArgumentParser, text: str, *, required: bool = False) -> None:
    """Add the options of a command that writes one file."""
    parser.add_argument('--out', required=required, metavar='FILE', help=text)
    add_force(parser)


def output_file(args: argparse.Namespace) -> AbstractContextManager[Path]:
    """Return the file that the options name, as `output_directory.new_file` does."""
    from ..offline.output_directory import new_file

    return new_file(args.out, force=args.force)


def add_bag_output(parser: argparse.ArgumentParser) -> None:
    """Add the options of a command that writes a bag."""
    parser.add_argument(
        '--out', required=True, metavar='BAG', help='bag to write; it must not exist yet'
    )
    parser.add_argument('--storage', choices=('mcap', 'sqlite3'), default='mcap')


def short_help(docstring: str) -> str:
    """Return the first line of a docstring, as a list of subcommands shows it."""
    return docstring.strip().partition('\n')[0].replace('%', '%%')


def add_command(subparsers: Any, name: str, module: ModuleType) -> argparse.ArgumentParser:
    """
    Add a subcommand whose help is the module's docstring, with the module's own options.

    Parameters
    ----------
    subparsers : what ``add_subparsers`` returned
    name : str
        As the user types it.
    module : module
        With ``add_arguments(parser)``; the first line of its docstring is the short help.

    """
    text = (module.__doc__ or '').strip()
    parser: argparse.ArgumentParser = subparsers.add_parser(
        name,
        help=short_help(text),
        description=text,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    module.add_arguments(parser)
    return parser
