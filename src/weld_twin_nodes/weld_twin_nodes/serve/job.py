# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One recording that somebody dropped: its folder, what was asked, how far it is."""

from __future__ import annotations

import json
import secrets
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from weld_twin_msgs_py.files.whole_files import write_text

FILE, UPLOADS, FOUND, IMPORTED = 'job.json', 'recording', 'found', 'imported'
"""In a job's folder: its state, what was dropped, what was found, and the bag of a table."""
WAITING, RUNNING = 'waiting', 'running'
DONE, UNSOUND, REFUSED, FAILED = 'done', 'unsound', 'refused', 'failed'
NO_ROBOT = 'which robot is it? Choose it below, or drop its file with the recording.'
"""Asked where the robot was not chosen: what was dropped stays, and need not come again."""
OPEN = (WAITING, RUNNING)
"""States of a job that is not finished; a server that starts again takes these up."""
TABLES = ('.csv', '.tsv', '.txt')
OTHERS = ('.yaml', '.yml', '.urdf', '.xml')
"""Suffixes of tables, and of what may be dropped besides: a bag's description, and robot files."""


@dataclass(frozen=True)
class Asked:
    """
    What was asked with a recording; every attribute is a field of the form.

    Attributes
    ----------
    robot : str
        A bundled robot, or the name of a robot file among those dropped; empty until it is told.
    align : str
        Frames that are fitted: '', 'base', 'tool' or 'base,tool'.
    length_unit, angle_unit : str
        Of a table; empty to read them from it.
    apply : bool
        Whether a mistake in data or set-up is corrected.
    cell, at : str
        Into whose history it goes, and when it was recorded; empty for neither.

    """

    robot: str
    align: str = ''
    length_unit: str = ''
    angle_unit: str = ''
    apply: bool = False
    cell: str = ''
    at: str = ''


@dataclass(frozen=True)
class Job:
    """
    One recording.

    Attributes
    ----------
    key : str
        Its name in addresses: chance, so that nobody guesses it.
    user : str
        Whose it is.
    names : tuple of str
        Of the files dropped.
    asked : Asked
    state : str
    said : str
        How far it is, or what was told last.
    since : float
        When it was dropped, seconds since 1970.
    seconds : float
        What the work took.

    """

    key: str
    user: str
    names: tuple[str, ...]
    asked: Asked
    state: str = WAITING
    said: str = ''
    since: float = field(default_factory=time.time)
    seconds: float = 0.0

    @classmethod
    def new(cls, user: str, names: tuple[str, ...], asked: Asked) -> Job:
        """Return a job that waits."""
        return cls(secrets.token_hex(16), user, names, asked)

    @classmethod
    def read(cls, folder: Path) -> Job:
        """Return the job of a folder."""
        data: Mapping[str, Any] = json.loads((folder / FILE).read_text(encoding='utf-8'))
        asked = Asked(**data['asked'])
        return cls(**{**data, 'names': tuple(data['names']), 'asked': asked})

    def write(self, folder: Path) -> None:
        """Write it into its folder, whole."""
        write_text(folder / FILE, json.dumps(asdict(self)) + '\n', overwrite=True)

    def ask(self, asked: Asked) -> Job:
        """Return the same recording, asked for in another way: it waits, or a question does."""
        state, said = (WAITING, '') if asked.robot else (REFUSED, NO_ROBOT)
        return replace(self, asked=asked, state=state, said=said, since=time.time())

    def uploads(self, folder: Path) -> Path:
        """Return where the files lie that were dropped; pages call the recording by its name."""
        return folder / UPLOADS / title(self.names)

    def commands(self, folder: Path) -> list[list[str]]:
        """Return the words of the commands that do the work, one after the other."""
        recording, robot = self._recording(folder), self._robot(folder)
        first = []
        if recording.suffix.lower() in TABLES:
            words = [
                'import',
                str(recording),
                '--robot',
                robot,
                '--out',
                str(folder / IMPORTED / title(self.names)),
            ]
            for name in ('length_unit', 'angle_unit'):
                if value := getattr(self.asked, name):
                    words += [f'--{name.replace("_", "-")}', value]
            first, recording = [words], folder / IMPORTED / title(self.names)
        # Nobody but the server writes there, and an earlier version kept no list.
        words = ['diagnose', str(recording), '--robot', robot, '--force']
        words += ['--out', str(folder / FOUND)]
        words += ['--align', self.asked.align] if self.asked.align else []
        return [*first, words + ['--apply'] * self.asked.apply]

    def _robot(self, folder: Path) -> str:
        own = self.uploads(folder) / self.asked.robot
        return str(own) if self.asked.robot in self.names else self.asked.robot

    def _recording(self, folder: Path) -> Path:
        """Return the bag's folder, or the single file, among what was dropped."""
        uploads = self.uploads(folder)
        rest = [name for name in self.names if name != self.asked.robot]
        return uploads / rest[0] if len(rest) == 1 else uploads


def title(names: Sequence[str]) -> str:
    """Return what a recording is called: its file of data without the suffix."""
    data = [name for name in names if not name.lower().endswith(OTHERS)]
    return Path((data or list(names))[0]).stem
