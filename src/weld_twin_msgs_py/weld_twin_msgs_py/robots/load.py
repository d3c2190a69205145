# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A robot from what the user names: a bundled model, a file, or one of one's own by its name."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from weld_twin_core.arm import catalog
from weld_twin_core.arm.known_arms import with_lent_masses
from weld_twin_core.arm.robot import Robot
from weld_twin_core.errors import ModelError

from ..files.whole_files import write_text
from ..files.yaml_file import read_yaml, yaml_text
from .urdf_read import read_urdf, refuse_wrong_units

_YAML_SUFFIXES = ('.yaml', '.yml')
URDF_SUFFIXES = ('.urdf', '.xml')
_FOLDERS = 'WELD_TWIN_ROBOTS'
"""Variable of the environment: one folder, or several as in PATH."""
_DROPPED = (*_YAML_SUFFIXES, '.urdf')
"""Of the files that are taken for robots."""


def _folders() -> tuple[Path, ...]:
    """Return where robots of one's own lie: what the environment says, else the user's settings."""
    folders = os.environ.get(_FOLDERS, '')
    if folders:
        return tuple(Path(part).expanduser() for part in folders.split(os.pathsep) if part)
    home = os.environ.get('XDG_CONFIG_HOME') or os.path.join(os.path.expanduser('~'), '.config')
    return (Path(home, 'weld_twin', 'robots'),)


def own_files() -> tuple[Path, ...]:
    """Return the files of one's own robots, by their names."""
    return tuple(sorted(_files(), key=lambda file: (file.stem.lower(), file)))


def _files() -> Iterator[Path]:
    for folder in _folders():
        if folder.is_dir():
            yield from (file for file in folder.iterdir() if file.suffix.lower() in _DROPPED)


def robot_names() -> tuple[str, ...]:
    """Return the names of the bundled robots, then of one's own."""
    own = dict.fromkeys(file.stem for file in own_files())
    return (*catalog.names(), *(name for name in own if name.lower() not in catalog.names()))


def as_file(spec: str) -> str:
    """Return the path of a robot's file where a name is that of one's own; else what was given."""
    if Path(spec).is_file():
        return spec
    result = [str(file) for file in own_files() if file.stem.lower() == spec.lower()]
    if result and spec.lower() in catalog.names():
        result.insert(0, 'the bundled one')
    if len(result) > 1:
        raise ModelError(
            f'{spec!r} is the name of several robots: {", ".join(result)}; rename all files but one'
        )
    return result[0] if result else spec


def _looked_in() -> str:
    """Return in which folders was looked, and which are none."""
    return ' and '.join(
        f"'{folder}'" + ('' if folder.is_dir() else ', which is no folder')
        for folder in _folders()
    )


def load_robot(
    spec: str | Path,
    base_link: str | None = None,
    tip_link: str | None = None,
    flange_link: str | None = None,
) -> Robot:
    """
    Return a robot.

    Parameters
    ----------
    spec : str or Path
        Name of a bundled model or of one of your own (`own_files`), or path of a YAML or URDF file.
    base_link, tip_link : str, optional
        Ends of the chain in a URDF; left out, its root and its only leaf (or ``tool0``).
    flange_link : str, optional
        Where the controller has its flange in a URDF; left out, it is found by its name.

    Raises
    ------
    ModelError
        Neither a known name nor a file, a name that several have, or a file that cannot be used.

    """
    spec = as_file(str(spec))
    path = Path(spec)
    suffix = path.suffix.lower()
    if suffix == '.xacro':
        raise ModelError(f"'{spec}' is a xacro file; run 'xacro {spec}' to make the URDF of it")
    if suffix in URDF_SUFFIXES:
        return with_lent_masses(read_urdf(path, base_link, tip_link, flange_link))
    if suffix in _YAML_SUFFIXES or path.is_file():
        robot = read_robot_yaml(path)
    elif spec.lower() in catalog.names():
        robot = catalog.load(spec.lower())
    else:
        raise ModelError(
            f'{spec!r} is neither a bundled robot ({", ".join(catalog.names())}) nor a .yaml or '
            f'.urdf file, nor is there one of that name in {_looked_in()}'
        )
    if any(link is not None for link in (base_link, tip_link, flange_link)):
        raise ModelError(
            f'{spec!r} is no URDF, so it has no base link, tip link or flange link to choose'
        )
    return robot


def read_robot_yaml(path: Path | str) -> Robot:
    """
    Read a robot file.

    Raises
    ------
    ModelError
        The file cannot be read, is malformed, or looks like degrees or millimetres.

    """
    data = read_yaml(path, 'robot file')
    try:
        robot = Robot.from_mapping(data)
        refuse_wrong_units(robot)
    except ModelError as error:
        raise ModelError(f"robot file '{path}': {error}") from None
    return robot


def write_robot_yaml(
    path: Path | str, robot: Robot, *, notes: Sequence[str] = (), overwrite: bool = False
) -> None:
    """
    Write a robot file, notes as comments first; numbers round trip exactly.

    Raises
    ------
    DataError
        The file exists and ``overwrite`` is not set, or the place cannot be written.

    """
    head = ''.join(f'# {note}\n' for note in notes)
    write_text(path, head + yaml_text(robot.to_mapping()), overwrite=overwrite)
