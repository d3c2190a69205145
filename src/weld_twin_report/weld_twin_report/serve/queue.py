# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What waits, whose turn it is, and the workers that take it.

Everything is in the folders of the jobs: a server that was killed finds there what was finished and
what was not, and goes on. No job and no full disk ends a worker.
"""

import shutil
import sys
import threading
from collections import Counter
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from weld_twin_core.errors import DataError, TwinError

from ..guarded import Guarded, Outcome
from ..history import entry_of
from ..history.database import Database
from ..history.entry import instant
from ..history.runs import Runs
from . import job as jobs
from .directory import NO_ROOM, Directory, giving_way, is_full, size_of
from .settings import Settings

STATES = {0: jobs.DONE, 2: jobs.REFUSED, 3: jobs.UNSOUND}
"""By the exit code of a command; any other is a failure."""
HISTORY = 'history.db'
NOT_ADDED = 'not in the history: '
"""Begins what is reported about a diagnosis that its history did not take."""
UNKNOWN = 'unknown at '
"""Begins the party of who comes without a key: all of an address are like one user."""
LOOK = 5.0
"""Seconds after which a worker that has nothing to do writes what a full disk did not take."""


class Full(DataError):
    """Too many recordings wait."""


class Queue:
    """All jobs of a server."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._directory = Directory(settings.directory)
        self._news = threading.Condition()
        self._stopped = False
        self._jobs = {job.key: job for job in self._kept()}
        self._sizes = {job.key: size_of(self.folder(job)) for job in self._jobs.values()}
        self._unwritten: set[str] = set()
        self._workers = [
            threading.Thread(target=self._work, daemon=True) for _ in range(settings.workers)
        ]
        for worker in self._workers:
            worker.start()

    def _kept(self) -> list[jobs.Job]:
        """Return the jobs of the folders; what was running waits again."""
        out = []
        for folder in self._directory.kept():
            try:
                job = jobs.Job.read(folder)
            except DataError as error:
                print(f'weld-twin: {error}; it is left as it is', file=sys.stderr, flush=True)
                continue
            if job.state in jobs.OPEN:
                job = replace(job, state=jobs.WAITING, said='')
            out.append(job)
        return out

    def folder(self, job: jobs.Job) -> Path:
        return self._directory.jobs / job.key

    def user_folder(self, user: str) -> Path:
        """Return the folder of a user; it is there once something was kept in it."""
        return self._directory.users / user

    def has(self, user: str) -> bool:
        """Return whether something is kept of a user."""
        with self._news:
            mine = any(job.user == user for job in self._jobs.values())
        return mine or self.user_folder(user).is_dir()

    def check_room(self, job: jobs.Job) -> None:
        """Refuse, by Full, a job more of a user, or new ones of his address, or of all."""
        with self._news:
            self._check_room(job)

    def _check_room(self, job: jobs.Job) -> None:
        waiting = [each for each in self._jobs.values() if each.state in jobs.OPEN]
        if sum(each.user == job.user for each in waiting) >= self._settings.own:
            raise Full(
                f'{self._settings.own} of your recordings wait already; let them finish first'
            )
        stranger = job.party.startswith(UNKNOWN)
        most = self._settings.own if stranger else self._settings.strangers
        if sum(each.party == job.party for each in waiting) >= most:
            raise Full(
                'many recordings of new visitors from your address wait already; try again in a '
                'few minutes'
            )
        if len(waiting) >= self._settings.waiting:
            raise Full('too many recordings wait; try again later')

    def add(self, job: jobs.Job) -> None:
        """Take a new job whose files are in its folder; raise Full, NoRoom or OSError."""
        size, allowed = size_of(self.folder(job)), self._settings.disk
        with self._news:
            self._check_room(job)
            others = list(self._jobs.values())
            going = giving_way(
                others, {**self._sizes, job.key: size}, job, allowed, self._settings.kept_of_all
            )
            finished = [each for each in others if each.state not in jobs.OPEN]
            mine = sorted((j for j in finished if j.user == job.user), key=lambda j: -j.since)
            job.write(self.folder(job))
            self._jobs[job.key], self._sizes[job.key] = job, size
            self._news.notify()
        for each in (*going, *mine[self._settings.kept :]):
            self.remove(each)

    def again(self, job: jobs.Job, asked: jobs.Asked) -> None:
        """Ask for the same files in another way, now or after what is in work."""
        with self._news:
            if job.key not in self._jobs:
                return  # it was deleted
            job = self._jobs[job.key]
            if job.state == jobs.RUNNING:
                self._put(replace(job, later=asked))
                return
            if job.state != jobs.WAITING:
                self._check_room(job)
            self._put(job.ask(asked))
            self._news.notify()

    def remove(self, job: jobs.Job) -> None:
        """Forget a job and delete its files; what it computes ends with nothing."""
        with self._news:
            self._jobs.pop(job.key, None)
            self._sizes.pop(job.key, None)
            self._unwritten.discard(job.key)
        folder = self.folder(job)
        # Its state goes last: what is cut off on the way can be deleted again.
        for place in (jobs.UPLOADS, jobs.IMPORTED, jobs.FOUND, jobs.MODEL):
            shutil.rmtree(folder / place, ignore_errors=True)
        shutil.rmtree(folder, ignore_errors=True)

    def remove_user(self, user: str) -> None:
        """Forget a user: recordings, programs and history."""
        for job in self.of(user):
            self.remove(job)
        shutil.rmtree(self.user_folder(user), ignore_errors=True)

    def of(self, user: str) -> list[jobs.Job]:
        """Return the jobs of a user, the newest first."""
        with self._news:
            mine = [job for job in self._jobs.values() if job.user == user]
        return sorted(mine, key=lambda job: -job.since)

    def get(self, key: str, user: str) -> jobs.Job | None:
        """Return a job of a user; None where there is none, or it is of another."""
        with self._news:
            job = self._jobs.get(key)
        return job if job is not None and job.user == user else None

    def place(self, job: jobs.Job) -> int:
        """Return how many come before a job that waits."""
        with self._news:
            running = sum(each.state == jobs.RUNNING for each in self._jobs.values())
            order = [each.key for each in self._in_turn()]
        return running + order.index(job.key) if job.key in order else 0

    def _in_turn(self) -> list[jobs.Job]:
        """Return what waits: first one of each party, then the next one of each."""
        rank: Counter[str] = Counter()
        order = []
        for job in sorted(self._jobs.values(), key=lambda job: job.since):
            if job.state in jobs.OPEN:
                if job.state == jobs.WAITING:
                    order.append((rank[job.party], job.since, job))
                rank[job.party] += 1
        return [job for _, _, job in sorted(order, key=lambda each: each[:2])]

    def stop(self) -> None:
        """End the workers and what they run; it waits for the next start."""
        with self._news:
            self._stopped = True
            self._news.notify_all()
        Guarded.end_all()
        for worker in self._workers:
            worker.join(timeout=5.0)
        self._directory.close()

    def _put(self, job: jobs.Job) -> None:
        """Keep a job; where the disk is full it is kept here, and written as soon as that goes."""
        self._jobs[job.key] = job
        try:
            job.write(self.folder(job))
            self._unwritten.discard(job.key)
        except OSError:
            self._unwritten.add(job.key)

    def _work(self) -> None:
        with Guarded(self._settings.limits) as guarded:
            while (job := self._next()) is not None:
                try:
                    done = self._run(job, guarded)
                except Exception as error:  # of one job; the next one has its own
                    done = Outcome(-1, _why(error), 0.0)
                if self._stopped:
                    return  # what was ended with the server is not finished
                self._finish(job, done)

    def _next(self) -> jobs.Job | None:
        """Wait for a job and take it; None when the server stops."""
        with self._news:
            while not self._stopped:
                if waiting := self._in_turn():
                    job = replace(waiting[0], state=jobs.RUNNING, said='')
                    self._jobs[job.key] = job
                    return job
                self._news.wait(LOOK)
                for key in list(self._unwritten):
                    self._put(self._jobs[key])
        return None

    def _run(self, job: jobs.Job, guarded: Guarded) -> Outcome:
        folder = self.folder(job)
        shutil.rmtree(folder / jobs.IMPORTED, ignore_errors=True)
        if job.kind == jobs.PROGRAM:
            shutil.rmtree(folder / jobs.FOUND, ignore_errors=True)

        def tell(text: str) -> None:
            with self._news:
                if job.key in self._jobs:
                    self._jobs[job.key] = replace(self._jobs[job.key], said=_plain(text, job))

        seconds = 0.0
        for words in job.commands():
            done = guarded.run(words, tell, folder)
            seconds += done.seconds
            if done.code:
                break
        return replace(done, seconds=seconds)

    def _finish(self, job: jobs.Job, done: Outcome) -> None:
        """Note how a job ended, and what comes of it."""
        state = STATES.get(done.code, jobs.FAILED)
        said = _plain(done.said.removeprefix('weld-twin: '), job)
        if done.disk_full:
            state, said = jobs.FAILED, NO_ROOM
        if state == jobs.UNSOUND:
            said = 'data or set-up are wrong: it asks what to do'
        if state == jobs.DONE:
            said = self._into_history(job) if job.asked.cell else ''
        size = size_of(self.folder(job))
        with self._news:
            now = self._jobs.get(job.key)
            if now is None:  # it was deleted meanwhile
                shutil.rmtree(self.folder(job), ignore_errors=True)
                return
            self._sizes[job.key] = size
            ended = replace(now, state=state, said=said, seconds=done.seconds)
            self._put(ended.ask(now.later) if now.later is not None else ended)

    def into_history(self, job: jobs.Job) -> None:
        """Add a diagnosis to its history once more, where it could not be added."""
        said = self._into_history(job)
        with self._news:
            if job.key in self._jobs:
                self._put(replace(self._jobs[job.key], said=said))

    def _into_history(self, job: jobs.Job) -> str:
        """Add a diagnosis to the history of its user; return what came of it."""
        asked = job.asked
        try:
            entry = entry_of(
                self.folder(job) / jobs.FOUND, instant(asked.at) if asked.at else None
            )
            place = self.user_folder(job.user)
            with self._news:
                if job.key not in self._jobs:
                    return ''
                place.mkdir(parents=True, exist_ok=True)
            database = Database(str(place / HISTORY), patience=LOOK)
            try:
                new = database.add(asked.cell, entry)
                with suppress(TwinError):  # only what pages would work out anew
                    Runs(database).look(asked.cell)
            finally:
                database.close()
        except Exception as error:  # the diagnosis is there all the same
            why = NO_ROOM if is_full(error) or 'is full' in str(error) else _why(error)
            why = why.replace(str(self.folder(job) / jobs.FOUND), '').replace(
                f'sqlite:///{self.user_folder(job.user).absolute()}/', ''
            )
            return f'{NOT_ADDED}{_plain(why, job)}'
        return 'added to the history' if new else 'it was in the history already'


def _why(error: Exception) -> str:
    """Return what went wrong, in a sentence without places of this machine."""
    if is_full(error):
        return NO_ROOM
    if isinstance(error, TwinError):
        return str(error)
    if isinstance(error, OSError):
        return f'the server could not do it: {error.strerror or error}'
    return f'the server could not do it: {type(error).__name__}: {error}'


def _plain(text: str, job: jobs.Job) -> str:
    """Return a sentence without the places in a job's folder."""
    for place in (
        job.uploads(Path()),
        *map(Path, ('recording', jobs.IMPORTED, jobs.FOUND, 'model')),
    ):
        text = text.replace(f'{place}/', '')
    return text
