# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Options that several subcommands share, and what they mean."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from weld_twin_core.errors import DataError, ModelError

from .parsing import Options, Parser, add_options, short_help

if TYPE_CHECKING:
    from weld_twin_core.arm.robot import Robot
    from weld_twin_core.cameras import Camera, Target
    from weld_twin_core.twin.twin import Twin
    from weld_twin_msgs_py.files.input_files import InputFile
    from weld_twin_msgs_py.messages.topics import TopicNames
    from weld_twin_msgs_py.robots.urdf_like import GivenUrdf

ROBOT = """
--robot R, required      a robot of 'weld-twin bag --robots', a robot file or a URDF
chain of a URDF:
rare:
--base-link LINK         first link of the chain; the controller's base is there too
--tip-link LINK          last link of the chain
--flange-link LINK       the controller's flange (default: tool0, flange or as it moves)
"""
ANY_ROBOT = ROBOT.replace(', required', '')
"""The same where something else may tell the robot."""
ALIGN = """
--align FRAMES           frames that are not known, and are fitted: base, tool, or base,tool
"""
CAMERAS = """
cameras:
rare:
--camera NAME=FILE       camera_info of a camera, with mount: tool or world; may be given again
--target NAME=FILE       points of a target or numbers of a board [m], with mount: tool or world;
                         may be given again
"""
TOPICS = f"""
topics, for bags recorded elsewhere:
rare:
--namespace NS           namespace of the robot; left stands for /left/...
--joint-topic TOPIC      JointState, DynamicJointState or JointTrajectoryControllerState
                         (TOPIC:feedback)
--pose-topic TOPIC       PoseStamped, PoseWithCovarianceStamped, TransformStamped, /tf:FRAME, or a
                         JointTrajectoryControllerState, of which the pose of the feedback is taken
--point-topic TOPIC      of the point
--image-topic TOPIC      PointCloud2 of target, point, u, v; or AprilTagDetectionArray
--wrench-topic TOPIC     of the wrench
--temperature-topic TOPIC  of the temperature
--joint-prefix TEXT      what the joint states put before the robot's joint names (default: any one
                         prefix)
--joint-map JOINT=NAME ...  joints of the robot and what the joint states call them, such as
                         joint_1=A1
--measured-inverse       the poses are those of something fixed seen from the arm, as of a board by
                         a camera
--use-effort             springs of joints take JointState.effort [N m] for their load, not the
                         model's statics
{CAMERAS}"""
_TOPICS = ('joint', 'pose', 'point', 'image', 'wrench', 'temperature')
OF_TOPICS = (
    *('namespace', 'joint_prefix', 'joint_map', 'measured_inverse', 'use_effort'),
    *('camera', 'target'),
    *(f'{name}_topic' for name in _TOPICS),
)
"""Attributes of the options of `TOPICS`."""
POOL = """
--workers N              processes; 0 takes all cores [default: 0]
rare:
--scheduler ADDRESS      Dask cluster to run on instead; it must see the same directories
"""
FORCE = """
rare:
--force                  write also where files of yours are in the way; they are kept as NAME.kept-1
"""
STORAGE = """
rare:
--storage {mcap,sqlite3}  form of the bag: mcap or sqlite3 [default: mcap]
"""
BAG_OUTPUT = f"""
--out BAG, required      bag to write; it must not exist yet
{STORAGE}"""


def folder_output(text: str, default: str = '') -> str:
    """Return the options of a command that writes a folder of files."""
    return f'--out DIR{"" if default else ", required"}  {text}' + (
        f' [default: {default}]\n{FORCE}' if default else f'\n{FORCE}'
    )


def file_output(text: str) -> str:
    """Return the options of a command that writes one file; ``text`` may say what is done without."""
    required = '' if '(default:' in text else ', required'
    return f'--out FILE{required}  {text}\n{FORCE}'


def robot_of(args: argparse.Namespace) -> Robot:
    """Return the robot the options name."""
    from weld_twin_msgs_py.robots import load_robot

    return load_robot(args.robot, *links_of(args))


def links_of(args: argparse.Namespace) -> list[str | None]:
    """Return the first and last link of the chain and the flange, None for what was not given."""
    return [link or None for link in (args.base_link, args.tip_link, args.flange_link)]


def given_urdf(args: argparse.Namespace) -> GivenUrdf | None:
    """Return the URDF that the robot was read from, None for another robot file."""
    from weld_twin_msgs_py.robots.load import URDF_SUFFIXES
    from weld_twin_msgs_py.robots.urdf_like import GivenUrdf

    path = Path(args.robot)
    if path.suffix.lower() not in URDF_SUFFIXES:
        return None
    return GivenUrdf(path, *links_of(args))


def inputs_of(**files: str | Sequence[str]) -> list[InputFile]:
    """Return the hashes of what a result comes from, by use; a name that is no file has none."""
    from weld_twin_msgs_py.files.input_files import hashed

    return [
        hashed(use.replace('_', ' '), path)
        for use, paths in files.items()
        for path in ([paths] if isinstance(paths, str) else paths)
        if path and (use != 'robot' or Path(path).is_file())
    ]


def twin_of(robot: Robot, path: str, *, implausible: bool = False) -> Twin:
    """Return the robot with the effects of a file; say which values no machine has."""
    from ..offline.given_twin import build_twin

    # Recordings that it is for are checked, and mended, by themselves.
    twin = build_twin(robot, path, implausible=implausible, mended=True)
    say_doubts(twin, path)
    return twin


def say_doubts(twin: Twin, path: str) -> None:
    """Say on stderr which values of a model no machine has."""
    from ..offline.given_twin import doubts

    for doubt in doubts(twin):
        print(f'weld-twin: {path}: {doubt}', file=sys.stderr)


def cameras_of(args: argparse.Namespace) -> tuple[tuple[Camera, ...], tuple[Target, ...]]:
    """Return the cameras and targets that the options describe."""
    from ..offline.given_twin import given_cameras

    return given_cameras(args.camera, args.target)


def pair(text: str, option: str, shown: str, sign: str = '=') -> tuple[str, str]:
    """Return both sides of what is given as ``shown``, such as NAME=FILE; a DataError without them."""
    name, mark, value = text.partition(sign)
    if not (name and mark and value):
        raise DataError(f"{option} takes {shown}, got '{text}'")
    return name, value


def topics_of(args: argparse.Namespace) -> TopicNames:
    """Return the names of the topics."""
    from weld_twin_msgs_py.messages.topics import TopicNames

    given = {name: getattr(args, f'{name}_topic') for name in _TOPICS}
    given['joints'], given['images'] = given.pop('joint'), given.pop('image')
    named = {name: value for name, value in given.items() if value}
    cameras, targets = cameras_of(args)
    return replace(
        TopicNames.within(args.namespace),
        **named,
        cameras=cameras,
        targets=targets,
        joint_prefix=args.joint_prefix,
        joint_map=tuple(pair(text, '--joint-map', 'JOINT=NAME') for text in args.joint_map),
        measured_inverse=args.measured_inverse,
        use_effort=args.use_effort or _learned_by_effort(args),
    )


def _learned_by_effort(args: argparse.Namespace) -> bool:
    from ..offline.given_twin import by_effort

    given = (getattr(args, name, None) for name in ('model', 'effects_known'))
    return any(by_effort(path) for path in given if path)


def output(args: argparse.Namespace, mark: str) -> AbstractContextManager[Path]:
    """Return the folder that the options name, as `output_directory.new_directory` does."""
    from ..offline.output_directory import new_directory

    return new_directory(args.out, mark=mark, force=args.force)


def output_file(args: argparse.Namespace) -> AbstractContextManager[Path]:
    """Return the file that the options name, as `output_directory.new_file` does."""
    from ..offline.output_directory import new_file

    return new_file(args.out, force=args.force)


def write_or_print(args: argparse.Namespace, text: str, said: str = '') -> int:
    """Write a text to the file that the options name, and say so; without one print it."""
    from weld_twin_msgs_py.files.whole_files import write_text

    if not args.out:
        print(text, end='')
        return 0
    with output_file(args) as path:
        write_text(path, text)
    print(said, end='\n' if said else '')
    return 0


def refuse(args: argparse.Namespace, names: Sequence[str], why: str) -> None:
    """Refuse, with the rest of a sentence, options that do nothing with what else was given."""
    for name in names:
        value = getattr(args, name)
        if value or (value is not None and not isinstance(value, bool | str | list | tuple)):
            raise DataError(f'--{name.replace("_", "-")} {why}')


def refuse_unknown_effect(option: str, name: str) -> None:
    """Refuse the name of an effect that there is not; a ModelError lists those there are."""
    from weld_twin_core.effects import REGISTRY

    if name not in REGISTRY:
        listed = ', '.join(sorted(REGISTRY))
        raise ModelError(f'{option}: there is no effect {name!r}; known effects are {listed}')


def add_command(subparsers: Any, name: str, command: Any) -> argparse.ArgumentParser:
    """
    Add a command to what ``add_subparsers`` returned.

    Its docstring is the help, its first line the short one. It has ``OPTIONS``, or a function
    ``add_arguments`` that takes the parser, and maybe an ``EXAMPLE``: a whole command line.
    """
    text = (command.__doc__ or '').strip()
    parser: argparse.ArgumentParser = subparsers.add_parser(
        name, help=short_help(text), description=text
    )
    if isinstance(parser, Parser):
        parser.example = getattr(command, 'EXAMPLE', '')
    options: tuple[Options, ...] = getattr(command, 'OPTIONS', ())
    add_options(parser, *(options or (command.add_arguments,)))
    return parser
