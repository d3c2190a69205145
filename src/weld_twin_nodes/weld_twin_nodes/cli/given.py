# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What was given to a command: the values of its options, and what they stand for."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from weld_twin_core.errors import DataError, ModelError

from .options import TOPICS
from .parsing import names_of

if TYPE_CHECKING:
    from weld_twin_core.arm.robot import Robot
    from weld_twin_core.arrays import Array
    from weld_twin_core.cameras import Camera, Target
    from weld_twin_core.effects import Effect
    from weld_twin_core.recording import Recording
    from weld_twin_core.twin.twin import Twin
    from weld_twin_msgs_py.files.input_files import InputFile
    from weld_twin_msgs_py.messages.topics import TopicNames
    from weld_twin_msgs_py.programs import Context
    from weld_twin_msgs_py.robots.urdf_write import GivenUrdf
    from weld_twin_msgs_py.tables import Table, TableOptions

_UNITS = {'mm': 1e-3, 'um': 1e-6, 'm': 1.0, 'deg': 0.017453292519943295, 'rad': 1.0}


class Given(argparse.Namespace):
    """
    The options of a command as attributes, and what groups of them stand for.

    A method needs the options of one table of `options`; an error says which cannot be meant so.
    """

    def refuse(self, names: Iterable[str], why: str) -> None:
        """Refuse, with the rest of a sentence, options that do nothing with what else was given."""
        for name in names:
            value = getattr(self, name)
            if value or (value is not None and not isinstance(value, bool | str | list | tuple)):
                raise DataError(f'--{name.replace("_", "-")} {why}')

    @property
    def links(self) -> list[str | None]:
        """The first and last link of the chain and the flange, None for what was not given."""
        return [link or None for link in (self.base_link, self.tip_link, self.flange_link)]

    def load_robot(self) -> Robot:
        from weld_twin_msgs_py.robots import load_robot

        return load_robot(self.robot, *self.links)

    def find_urdf(self) -> GivenUrdf | None:
        """Return the URDF that the robot was read from, None for another robot file."""
        from weld_twin_msgs_py.robots.load import URDF_SUFFIXES
        from weld_twin_msgs_py.robots.urdf_write import GivenUrdf

        path = Path(self.robot)
        return GivenUrdf(path, *self.links) if path.suffix.lower() in URDF_SUFFIXES else None

    def read_cameras(self) -> tuple[tuple[Camera, ...], tuple[Target, ...]]:
        from ..offline.given_twin import given_cameras

        return given_cameras(self.camera, self.target)

    def read_topics(self) -> TopicNames:
        """Return the names of the topics, and what is known of who publishes them."""
        from weld_twin_msgs_py.messages.topics import TopicNames

        ends = {'joint': 'joints', 'image': 'images'}
        topics = [name.removesuffix('_topic') for name in names_of(TOPICS) if '_topic' in name]
        named = {ends.get(name, name): getattr(self, f'{name}_topic') for name in topics}
        cameras, targets = self.read_cameras()
        return replace(
            TopicNames.within(self.namespace),
            **{name: value for name, value in named.items() if value},
            cameras=cameras,
            targets=targets,
            joint_prefix=self.joint_prefix,
            joint_map=tuple(pair(text, '--joint-map', 'JOINT=NAME') for text in self.joint_map),
            measured_inverse=self.measured_inverse,
            use_effort=self.use_effort or self._learned_by_effort(),
        )

    def _learned_by_effort(self) -> bool:
        from ..offline.given_twin import by_effort

        given = (getattr(self, name, None) for name in ('model', 'effects_known'))
        return any(by_effort(path) for path in given if path)

    def read_bag(self, path: str, robot: Robot, **how: Any) -> Recording:
        """Return the recording of a bag; ``how`` is as `read_recording` takes it."""
        from weld_twin_msgs_py.bags import read_recording

        return read_recording(path, robot, self.read_topics(), **how)

    def output(self, mark: str) -> AbstractContextManager[Path]:
        """Return the folder of results, as `output_directory.new_directory` does."""
        from ..offline.output_directory import new_directory

        return new_directory(self.out, mark=mark, force=self.force)

    def write_results(
        self, mark: str, page: str, entry: dict[str, Any], files: Iterable[tuple[str, bytes]] = ()
    ) -> None:
        """Write a page, if there is one, the result it shows, and more files, to the folder."""
        from weld_twin_msgs_py.files.whole_files import write_json, write_text

        with self.output(mark) as place:
            for name, content in files:
                (place / name).write_bytes(content)
            if page:
                write_text(place / PAGE, page)
            write_json(place / mark, entry)

    def say_page(self) -> None:
        print(f'report: {Path(self.out) / PAGE}')

    def output_file(self) -> AbstractContextManager[Path]:
        """Return the file of the result, as `output_directory.new_file` does."""
        from ..offline.output_directory import new_file

        return new_file(self.out, force=self.force)

    def write_or_print(self, text: str, said: str = '') -> int:
        """Write a text to the file of the result, and say so; without one print it."""
        from weld_twin_msgs_py.files.whole_files import write_text

        if not self.out:
            print(text, end='')
            return 0
        with self.output_file() as path:
            write_text(path, text)
        print(said, end='\n' if said else '')
        return 0

    def check_program(self) -> None:
        """Refuse a language that there is not, and an output that no controller has."""
        from weld_twin_msgs_py.programs.writing import WRITERS

        if self.controller not in WRITERS:
            raise DataError(
                f'--controller: there is no language {self.controller!r}; known are '
                + ', '.join(WRITERS)
            )
        if not 0 <= self.trigger <= 9999:
            raise DataError('--trigger must be the number of an output')

    def program_context(self, robot: Robot, language: str, model: str | None = None) -> Context:
        """Return the robot and frames of a program; a model may tell how the controller counts."""
        import numpy as np

        from weld_twin_msgs_py.files.diagnosis_model import counted_of
        from weld_twin_msgs_py.programs import Context, controller_of
        from weld_twin_msgs_py.programs.controllers import Cell

        from ..offline.given_twin import diagnosis_of

        pulses = None
        if self.pulses_per_degree:
            pulses = np.array(_numbers(self.pulses_per_degree, '--pulses-per-degree'))
            if pulses.size != robot.n or not (pulses != 0.0).all():
                raise DataError(f'--pulses-per-degree needs {robot.n} numbers that are not zero')
        tools = _frames(self.tool, '--tool', language)
        bases = _frames(self.base, '--base', language)
        along = None
        if self.on_positioner:
            names = {name.strip().lower() for name in self.on_positioner.split(',')}
            along = frozenset(names - {'none', ''})
        world = _frames([f'world={self.world}'], '--world', language) if self.world else {}
        cell = Cell(self.external, along, world.get('world'))
        counted = None
        if model:
            counted = counted_of(diagnosis_of(model).get('model') or {}, robot)
        return Context(robot, controller_of(robot, language, tools, bases, cell), pulses, counted)

    def read_start(self, context: Context) -> Array | None:
        """Return --start, shape (n,) [rad or m], as the controller shows it if the arm is alone."""
        import numpy as np

        robot = context.robot
        if not self.start:
            return None
        values = np.array(_numbers(self.start, '--start'))
        if values.size != robot.n:
            raise DataError(f'--start needs {robot.n} joint positions, got {values.size}')
        if context.controller.external:
            q = np.where(robot.prismatic, values * 1e-3, np.radians(values))
        else:
            q = context.degrees().value(values.tolist())
        robot.check_positions(q)
        return np.asarray(q)

    def read_table(self, robot: Robot, file: str) -> Table:
        """Return what a table holds, with a sentence for everything that was assumed."""
        from weld_twin_msgs_py import tables
        from weld_twin_msgs_py.files.artefact_file import read_artefact

        names = [field.name for field in fields(tables.TableOptions)]
        given = {name: getattr(self, name) for name in names}
        options = tables.TableOptions(**{name: value for name, value in given.items() if value})
        if self.contacts:
            return tables.read_contacts(file, robot, read_artefact(self.contacts), options)
        if self.clamped:
            return _clamped(file, robot, options)
        if self.camera or self.target:
            return tables.read_pixels(file, robot, *self.read_cameras(), options)
        if not self.measured:
            return tables.read_table(file, robot, options)
        return tables.read_two_tables(file, self.measured, robot, options, self.clock_offset)


PAGE = 'report.html'


def _clamped(file: str, robot: Robot, options: TableOptions) -> Table:
    """
    Return postures in which the tool was one thing with where the chain begins.

    The pose between them is the same in all, and is that of the tool, which is fitted: measured is
    none at all.
    """
    import numpy as np

    from weld_twin_core.contacts import Artefact, Contact
    from weld_twin_core.recording import Measurements
    from weld_twin_msgs_py.tables import Table, read_contacts

    touches, said = read_contacts(file, robot, Artefact((Contact('bar'),)), options)
    count = touches.joints.t.size
    clamped = Measurements(
        touches.joints.t, np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1))
    )
    note = f'{count} postures with one bar clamped at both ends; diagnose with --align tool'
    said = (*(one for one in said if 'touch' not in one), note)
    return Table(replace(touches, contacts=None, measured=clamped, notes=said), said)


SHORTEST = 1e-3
"""Length [m] below which a tool is one of metres that were taken for millimetres."""


def _frames(given: Sequence[str], option: str, language: str) -> dict[str, Array]:
    import numpy as np

    from weld_twin_msgs_py.programs.languages import LANGUAGES

    notation = LANGUAGES[language].pose
    count = len(notation.name.split())
    out = {}
    for text in given:
        name, sign, numbers = text.partition('=')
        values = _numbers(numbers, option)
        if not sign or not name or len(values) != count:
            raise DataError(f'{option} needs NAME={",".join(notation.name.split())}, got {text!r}')
        out[name] = notation.value(values)
        length = float(np.linalg.norm(out[name][:3, 3]))
        if option == '--tool' and 0.0 < length < SHORTEST:
            raise DataError(
                f'{option} {text!r} is {length * 1e3:g} mm long; give the numbers as the controller '
                'shows them, lengths in mm'
            )
    return out


def _numbers(text: str, option: str) -> list[float]:
    try:
        values = [float(part) for part in text.split(',')]
    except ValueError:
        raise DataError(f'{option} needs numbers with commas between, got {text!r}') from None
    if not all(abs(value) < 1e9 for value in values):
        raise DataError(f'{option} needs finite numbers, got {text!r}')
    return values


def quantity(text: str, units: Sequence[str], option: str) -> float:
    """Return a size, such as ``2mm`` or ``0.5deg``, in SI; without a unit in the first of them."""
    result = re.fullmatch(r'\s*(\d+\.?\d*|\.\d+)(e[-+]?\d+)?\s*([a-z]*)\s*', text, re.I)
    unit = result[3] or units[0] if result else ''
    value = float(result[1] + (result[2] or '')) if result else -1.0
    if unit not in units or not 0.0 <= value < 1e9:
        raise DataError(f'{option} needs a size in {" or ".join(units)}, got {text!r}')
    return value * _UNITS[unit]


def inputs_of(**files: str | Sequence[str]) -> list[InputFile]:
    """
    Return the hashes of what a result comes from, by use, to be taken before it is read.

    A name that is no file has none, and what is not there is refused by whoever reads it.
    """
    from weld_twin_msgs_py.files.input_files import hashed

    return [
        hashed(use.replace('_', ' '), path)
        for use, paths in files.items()
        for path in ([paths] if isinstance(paths, str) else paths)
        if path and (Path(path).is_file() or (use != 'robot' and Path(path).exists()))
    ]


def refuse_changed(inputs: Sequence[InputFile]) -> None:
    """Refuse inputs that were replaced while they were read: a result must name what it is of."""
    from weld_twin_msgs_py.files.input_files import hashed

    for one in inputs:
        if hashed(one.use, one.path) != one:
            raise DataError(f"'{one.path}' was changed while it was read; run the command again")


def twin_of(robot: Robot, path: str, *, implausible: bool = False) -> Twin:
    """Return the robot with the effects of a file; say which values no machine has."""
    from ..offline.given_twin import build_twin

    # Recordings that it is for are checked, and mended, by themselves.
    twin = build_twin(robot, path, implausible=implausible, mended=True)
    say_doubts(twin.robot, twin.effects, path)
    return twin


def say_doubts(robot: Robot, effects: Sequence[Effect], path: str, robot_file: str = '') -> None:
    """Say on stderr what in a model may be a slip of its file, and that the robot's was changed."""
    from ..offline.given_twin import changed_robot, diagnosis_of, doubts, since_recorded

    content = diagnosis_of(path)
    said = changed_robot(content, robot_file) + since_recorded(content, effects)
    for doubt in said + doubts(robot, effects):
        print(f'weld-twin: {path}: {doubt}', file=sys.stderr)


def pair(text: str, option: str, shown: str, sign: str = '=') -> tuple[str, str]:
    """Return both sides of what is given as ``shown``, such as NAME=FILE; a DataError without them."""
    name, mark, value = text.partition(sign)
    if not (name and mark and value):
        raise DataError(f"{option} takes {shown}, got '{text}'")
    return name, value


def refuse_unknown_effect(option: str, name: str) -> None:
    """Refuse the name of an effect that there is not; a ModelError lists those there are."""
    from weld_twin_core.effects import REGISTRY

    if name not in REGISTRY:
        listed = ', '.join(sorted(REGISTRY))
        raise ModelError(f'{option}: there is no effect {name!r}; known effects are {listed}')
