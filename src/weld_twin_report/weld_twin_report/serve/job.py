# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One recording or program that somebody dropped: its folder, what was asked, how far it is."""

from __future__ import annotations

import json
import math
import secrets
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.whole_files import write_text
from weld_twin_msgs_py.programs.languages import LANGUAGES

from .fields import CORRECT, DIAGNOSE, FIELDS, IMPORT, words

FILE, UPLOADS, FOUND, IMPORTED = 'job.json', 'recording', 'found', 'imported'
"""In a job's folder: its state, what was dropped, what was found, and the bag of a table."""
MODEL, DIAGNOSIS = 'model', 'diagnosis.json'
"""In the folder of a program: the diagnosis that it is corrected by, with the file of its robot."""
RECORDING, PROGRAM = 'recording', 'program'
"""What may be dropped."""
WAITING, RUNNING = 'waiting', 'running'
DONE, UNSOUND, REFUSED, FAILED = 'done', 'unsound', 'refused', 'failed'
NO_ROBOT = 'which robot is it? Choose it below, or drop its file with the recording.'
"""Asked where the robot was not chosen: what was dropped stays, and need not come again."""
OPEN = (WAITING, RUNNING)
"""States of a job that is not finished; a server that starts again takes these up."""
STATES = (*OPEN, DONE, UNSOUND, REFUSED, FAILED)
_DAMAGED = (ValueError, TypeError, KeyError, AttributeError, RecursionError, OSError, DataError)
"""What reading a job raises that somebody or something has changed."""
TABLES = ('.csv', '.tsv', '.txt')
OTHERS = ('.yaml', '.yml', '.urdf', '.xml')
"""Suffixes of tables, and of what may be dropped besides: a bag's description, and robot files."""


@dataclass(frozen=True)
class Asked:
    """What was asked with a recording or a program."""

    robot: str
    """A bundled robot, or the name of a robot file among those dropped; empty until it is given."""
    apply: bool = False  # whether a mistake in data or set-up is corrected
    cell: str = ''
    at: str = ''  # into whose history it goes, and when it was recorded; empty for neither
    told: dict[str, str] = field(default_factory=dict)
    """The other fields of the form, by their names in `fields.FIELDS`; checked."""

    @classmethod
    def read(cls, data: Mapping[str, Any]) -> Asked:
        """Return what stands in a job's file, of an older version too."""
        own = {name: data[name] for name in ('robot', 'apply', 'cell', 'at') if name in data}
        older = {name: data[name] for name in data if name in FIELDS and data[name]}
        unknown = data.keys() - own.keys() - FIELDS.keys() - {'told'}
        if unknown:
            raise DataError(f'it asks for {", ".join(sorted(unknown))}, which is not known')
        options = {**older, **data.get('told', {})}
        texts = [own.get(name, '') for name in ('robot', 'cell', 'at')] + list(options.values())
        if not isinstance(own.get('apply', False), bool):
            raise DataError('it applies neither something nor nothing')
        _check_texts(texts)
        return cls(**own, told=options)


@dataclass(frozen=True)
class Job:
    """One recording or program."""

    key: str  # its name in addresses: chance, so that nobody guesses it
    user: str  # whose it is
    names: tuple[str, ...]  # of the files dropped
    asked: Asked
    state: str = WAITING
    said: str = ''  # how far it is, or what was reported last
    since: float = field(default_factory=time.time)  # when it was dropped, seconds since 1970
    seconds: float = 0.0  # what the work took
    kind: str = RECORDING  # 'recording' or 'program'
    party: str = ''
    """With whom it shares what may wait: its user, or other new ones of the same address."""
    later: Asked | None = None  # what was asked while it was in work; it is taken up afterwards

    @classmethod
    def new(cls, user: str, party: str = '', kind: str = RECORDING) -> Job:
        """Return a job that waits for its files."""
        return cls(secrets.token_hex(16), user, (), Asked(''), kind=kind, party=party or user)

    @classmethod
    def read(cls, folder: Path) -> Job:
        try:
            if not (folder / FILE).is_file():  # a pipe would be waited for
                raise ValueError('it is no file')
            data: Mapping[str, Any] = json.loads((folder / FILE).read_text(encoding='utf-8'))
            later = data.get('later')
            values = {
                **data,
                'names': tuple(data['names']),
                'asked': Asked.read(data['asked']),
                'later': Asked.read(later) if later else None,
                'party': data.get('party') or data['user'],
            }
            job = cls(**values)
            job._check(folder)
        except _DAMAGED as error:
            raise DataError(f"'{folder / FILE}' cannot be read: {error}") from None
        return job

    def _check(self, folder: Path) -> None:
        """Refuse values that no server writes."""
        _check_texts((self.user, self.said, self.party, *self.names))
        known = self.state in STATES and self.kind in (RECORDING, PROGRAM)
        if self.key != folder.name or not known or not self.names:
            raise ValueError('it is of another job, or of a state that is not known')
        if not all(Path(name).parts == (name,) != ('..',) for name in (self.user, *self.names)):
            raise ValueError('it names files outside its folder')
        if not (math.isfinite(self.since) and self.since + self.seconds >= 0.0):
            raise ValueError('its times are impossible')

    def write(self, folder: Path) -> None:
        """Write it into its folder, whole."""
        try:
            write_text(folder / FILE, json.dumps(asdict(self)) + '\n', overwrite=True)
        except DataError as error:
            if isinstance(error.__context__, OSError):
                raise error.__context__ from None
            raise

    def ask(self, asked: Asked) -> Job:
        """Return the same files, asked for in another way: they wait, or a question does."""
        state, said = (WAITING, '') if asked.robot else (REFUSED, NO_ROBOT)
        return replace(self, asked=asked, state=state, said=said, since=time.time(), later=None)

    @property
    def command(self) -> str:
        """Return the command that says most of what the user gave."""
        return CORRECT if self.kind == PROGRAM else DIAGNOSE

    def uploads(self, folder: Path) -> Path:
        """Return where the files lie that were dropped; pages call the recording by its name."""
        return folder / UPLOADS / title(self.names)

    def commands(self) -> list[list[str]]:
        """Return the words of the commands that do the work, one after the other, in its folder."""
        place = Path(UPLOADS) / title(self.names)
        if self.kind == PROGRAM:
            return [self._correct(place)]
        robot = self.asked.robot
        robot = str(place / robot) if robot in self.names else robot
        rest = [name for name in self.names if name != self.asked.robot]
        recording = place / rest[0] if len(rest) == 1 else place
        first = []
        if recording.suffix.lower() in TABLES:
            bag = Path(IMPORTED) / title(self.names)
            more = words(self.asked.told, IMPORT)
            first = [['import', str(recording), '--robot', robot, '--out', str(bag), *more]]
            recording = bag
        # Nobody but the server writes there, and an earlier version kept no list.
        last = ['diagnose', str(recording), '--robot', robot, '--out', FOUND, '--force']
        last += words(self.asked.told, DIAGNOSE)
        return [*first, last + ['--apply'] * self.asked.apply]

    def _correct(self, place: Path) -> list[str]:
        robot = self.asked.robot
        robot = f'{MODEL}/{robot}' if robot.lower().endswith(OTHERS) else robot
        out = [CORRECT, str(place / main_file(self.names)), '--robot', robot]
        out += ['--model', f'{MODEL}/{DIAGNOSIS}', '--out', FOUND]
        return out + words(self.asked.told, CORRECT)


def _check_texts(values: Iterable[object]) -> None:
    if not all(isinstance(each, str) for each in values):
        raise DataError('it has values of another kind')


def title(names: Sequence[str]) -> str:
    """Return what a recording is called: its file of data without the suffix."""
    data = [name for name in names if not name.lower().endswith(OTHERS)]
    return Path((data or list(names))[0]).stem


def main_file(names: Sequence[str]) -> str:
    """Return which file of a program is given to the command; the others lie beside it."""
    beside = {suffix for one in LANGUAGES.values() for suffix in one.beside}
    main = [name for name in names if Path(name).suffix.lower() not in beside]
    return (main or list(names))[0]
