# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The recordings that wait, in the order in which they came, and the workers that take them.

Everything is in the folders of the jobs: a server that was killed finds there what was finished and
what was not, and goes on.
"""

from __future__ import annotations

import shutil
import threading
from dataclasses import replace
from datetime import datetime, timezone
from pathlib import Path

from weld_twin_core.errors import DataError, TwinError

from ..guarded import Guarded, Outcome
from ..history import entry_of
from ..history.database import Database
from ..history.runs import Runs
from .directory import Directory
from .job import (
    DONE,
    FAILED,
    FOUND,
    IMPORTED,
    OPEN,
    REFUSED,
    RUNNING,
    UNSOUND,
    UPLOADS,
    WAITING,
    Job,
)
from .settings import Settings

STATES = {0: DONE, 2: REFUSED, 3: UNSOUND}
"""By the exit code of ``diagnose``; any other is a failure."""
HISTORY = 'history.db'


class Full(DataError):
    """Too many recordings wait."""


class Queue:
    """
    All jobs of a server.

    Parameters
    ----------
    settings : Settings

    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._directory = Directory(settings.directory)
        self._news = threading.Condition()
        self._stopped = False
        self._jobs = {job.key: job for job in self._kept()}
        self._workers = [
            threading.Thread(target=self._work, daemon=True) for _ in range(settings.workers)
        ]
        for worker in self._workers:
            worker.start()

    def _kept(self) -> list[Job]:
        """Return the jobs of the folders; what was running waits again."""
        out = []
        for folder in self._directory.kept():
            job = Job.read(folder)
            if job.state in OPEN:
                job = replace(job, state=WAITING, said='')
            out.append(job)
        return out

    def folder(self, job: Job) -> Path:
        """Return the folder of a job."""
        return self._directory.jobs / job.key

    def user_folder(self, user: str) -> Path:
        """Return the folder of a user; it is there once something was kept in it."""
        return self._directory.users / user

    def check_room(self, user: str) -> None:
        """
        Refuse a recording more where too many wait.

        Raises
        ------
        Full
            Too many of this user, or of all.

        """
        with self._news:
            waiting = [job for job in self._jobs.values() if job.state in OPEN]
        if len(waiting) >= self._settings.waiting:
            raise Full('too many recordings wait; try again later')
        if sum(job.user == user for job in waiting) >= self._settings.own:
            raise Full(
                f'{self._settings.own} of your recordings wait already; let them finish first'
            )

    def add(self, job: Job) -> None:
        """Take a job whose files are in its folder; it waits from now on."""
        self.check_room(job.user)
        self._set(job)
        self._forget(job.user)

    def of(self, user: str) -> list[Job]:
        """Return the jobs of a user, the newest first."""
        with self._news:
            mine = [job for job in self._jobs.values() if job.user == user]
        return sorted(mine, key=lambda job: -job.since)

    def get(self, key: str, user: str) -> Job | None:
        """Return a job of a user; None where there is none, or it is of another."""
        with self._news:
            job = self._jobs.get(key)
        return job if job is not None and job.user == user else None

    def place(self, job: Job) -> int:
        """Return how many come before a job that waits."""
        with self._news:
            return sum(
                other.state in OPEN and other.since < job.since for other in self._jobs.values()
            )

    def stop(self) -> None:
        """End the workers and what they run; it waits for the next start."""
        with self._news:
            self._stopped = True
            self._news.notify_all()
        Guarded.end_all()
        for worker in self._workers:
            worker.join(timeout=5.0)
        self._directory.close()

    def _set(self, job: Job) -> None:
        with self._news:
            job.write(self.folder(job))
            self._jobs[job.key] = job
            self._news.notify()

    def _forget(self, user: str) -> None:
        """Take away the oldest finished jobs beyond what is kept, of a user and of all."""
        with self._news:
            every = sorted(self._jobs.values(), key=lambda job: -job.since)
        finished = [job for job in every if job.state not in OPEN]
        mine = [job for job in finished if job.user == user]
        for job in {*mine[self._settings.kept :], *finished[self._settings.kept_of_all :]}:
            with self._news:
                del self._jobs[job.key]
            shutil.rmtree(self.folder(job), ignore_errors=True)

    def _work(self) -> None:
        with Guarded(self._settings.limits) as guarded:
            while (job := self._next()) is not None:
                done = self._run(job, guarded)
                if self._stopped:
                    return  # what was ended with the server is not finished
                self._finish(job, done)

    def _next(self) -> Job | None:
        """Wait for a job and take it; None when the server stops."""
        with self._news:
            while not self._stopped:
                waiting = [job for job in self._jobs.values() if job.state == WAITING]
                if waiting:
                    job = replace(min(waiting, key=lambda job: job.since), state=RUNNING)
                    self._jobs[job.key] = job
                    return job
                self._news.wait()
        return None

    def _run(self, job: Job, guarded: Guarded) -> Outcome:
        folder = self.folder(job)
        shutil.rmtree(folder / IMPORTED, ignore_errors=True)

        def tell(text: str) -> None:
            with self._news:
                self._jobs[job.key] = replace(self._jobs[job.key], said=_plain(text, job, folder))

        seconds = 0.0
        for words in job.commands(folder):
            done = guarded.run(words, tell)
            seconds += done.seconds
            if done.code:
                break
        return replace(done, seconds=seconds)

    def _finish(self, job: Job, done: Outcome) -> None:
        state = STATES.get(done.code, FAILED)
        said = _plain(done.said.removeprefix('weld-twin: '), job, self.folder(job))
        if state == UNSOUND:
            said = 'data or set-up are wrong: it asks what to do'
        if state == DONE:
            said = self._into_history(job) if job.asked.cell else ''
        self._set(replace(job, state=state, said=said, seconds=done.seconds))

    def _into_history(self, job: Job) -> str:
        """Add a diagnosis to the history of its user; return what came of it."""
        asked = job.asked
        try:
            at = (
                datetime.fromisoformat(asked.at).replace(tzinfo=timezone.utc) if asked.at else None
            )
            entry = entry_of(self.folder(job) / FOUND, at)
            place = self.user_folder(job.user)
            place.mkdir(parents=True, exist_ok=True)
            database = Database(str(place / HISTORY))
            try:
                new = database.add(asked.cell, entry)
                Runs(database).look(asked.cell)
            finally:
                database.close()
        except TwinError as error:
            return f'not in the history: {_plain(str(error), job, self.folder(job))}'
        return 'added to the history' if new else 'it was in the history already'


def _plain(text: str, job: Job, folder: Path) -> str:
    """Return a sentence without the places of this machine."""
    for place in (job.uploads(folder), folder / UPLOADS, folder / IMPORTED, folder):
        text = text.replace(f'{place}/', '')
    return text.replace(str(folder), '')
