# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The application: addresses and what answers them."""

import asyncio
import json
import shutil
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager, closing
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

from fastapi import FastAPI, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import FileResponse, HTMLResponse, RedirectResponse, Response
from starlette.datastructures import FormData, UploadFile
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect

from weld_twin_core.errors import DataError, TwinError
from weld_twin_nodes.wording.words import capital

from ..fleet.cell_page import page_of
from ..fleet.ranking_page import ranking_page
from ..history import Unavailable
from ..history.database import Database
from ..report.html import Html
from . import pages
from .access import Access, Doors, People, be, be_nobody
from .directory import NO_ROOM, NoRoom, is_full, refuse_full
from .fields import sentence
from .job import DIAGNOSIS, DONE, FOUND, MODEL, OPEN, PROGRAM, RECORDING, UPLOADS, Job
from .queue import HISTORY, UNKNOWN, Queue
from .settings import Settings
from .uploads import Busy, TooMuch, TooSlow, asked_of, asked_of_program, save, save_program

FIELDS = 40
"""Fields of a form at most, besides its files."""
SANDBOX = 'sandbox allow-scripts allow-downloads allow-modals'
"""A sheet draws itself and prints; it is kept off the pages around it, cookies included."""
FIELD = 4096
"""Bytes of a field at most."""
READERS = 4
"""Pages of histories made at the same time: a slow database holds no other page."""
FULL = 507
"""Status where the disk is full."""
Said = Callable[[], Mapping[str, str] | None]


def make_app(settings: Settings, queue: Queue, doors: Doors, live: Said = lambda: None) -> Access:
    """Return the application; ``live`` is what running nodes said last."""
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    people = People(settings.directory, queue.has)
    site = _Site(settings, queue, people, live)
    get, post = ['GET'], ['POST']
    for path, answer, methods in (
        ('/', site.start, get),
        ('/recordings', site.drop, post),
        ('/recordings', site.recordings, get),
        ('/recordings/{key}', site.recording, get),
        ('/recordings/{key}/again', site.again, post),
        ('/recordings/{key}/delete', site.delete, post),
        ('/recordings/{key}/history', site.into_history, post),
        ('/recordings/{key}/{name}', site.file, get),
        ('/program', site.program, get),
        ('/program', site.drop_program, post),
        ('/me', site.me, get),
        ('/me', site.enter, post),
        ('/me/leave', site.leave, post),
        ('/me/delete', site.delete_me, post),
        ('/history', site.history, get),
        ('/history/{cell:path}', site.history, get),
        ('/plant', site.plant, get),
        ('/plant/{cell:path}', site.plant, get),
        ('/live', site.live, get),
    ):
        app.add_api_route(path, answer, methods=methods, response_model=None)
    known = (TooMuch, TooSlow, Busy, ClientDisconnect, OSError, TwinError, HTTPException)
    for kind in (*known, Exception):  # the last one is logged on the server's terminal as well
        app.add_exception_handler(kind, site.refused)
    return Access(app, settings, people, doors)


class _Site:
    def __init__(self, settings: Settings, queue: Queue, people: People, live: Said) -> None:
        self._settings, self._queue, self._people, self._live = settings, queue, people, live
        self._ways = pages.Site(bool(settings.database), settings.live)
        self._readers = asyncio.Semaphore(READERS)

    def start(self) -> Response:
        return HTMLResponse(pages.start_page(self._ways))

    async def drop(self, request: Request) -> Response:
        async with self._dropped(request, RECORDING) as (form, job):
            place = self._queue.folder(job) / UPLOADS
            names = await save(_files(form, 'files'), place, self._settings.files)
            job = replace(job, names=names)
            await run_in_threadpool(self._queue.add, job.ask(asked_of(form, names)))
        return RedirectResponse(f'/recordings/{job.key}', 303)

    async def drop_program(self, request: Request) -> Response:
        async with self._dropped(request, PROGRAM) as (form, job):
            folder = self._queue.folder(job)
            beside = folder / MODEL
            names = await save_program(
                _files(form, 'files'), _files(form, 'model'), folder / UPLOADS, beside
            )
            robot = self._model_of(request, form, beside)
            if not (beside / DIAGNOSIS).is_file():
                raise DataError('choose the diagnosis that it is to be corrected by, or drop one')
            job = replace(job, names=names)
            asked_form = {**form, 'robot': robot or form.get('robot', '')}
            asked = asked_of_program(asked_form, sorted(file.name for file in beside.iterdir()))
            await run_in_threadpool(self._queue.add, job.ask(asked))
        return RedirectResponse(f'/recordings/{job.key}', 303)

    @asynccontextmanager
    async def _dropped(self, request: Request, kind: str) -> AsyncIterator[tuple[FormData, Job]]:
        """Yield the form of a request, and a new job; its folder goes where it is not taken."""
        job = Job.new(request.scope['user'], self._party(request), kind)
        self._queue.check_room(job)
        length = request.headers.get('content-length', '')
        refuse_full(self._settings.directory, int(length) if length.isdecimal() else 0)
        try:
            async with request.form(
                max_files=self._settings.files, max_fields=FIELDS, max_part_size=FIELD
            ) as form:
                yield form, job
        except BaseException:
            shutil.rmtree(self._queue.folder(job), ignore_errors=True)
            raise

    def _party(self, request: Request) -> str:
        """Return with whom somebody shares what may wait; empty for nobody."""
        if request.scope['unknown']:
            return UNKNOWN + str(request.scope['address'])
        if self._people.settled(request.scope['user']):
            return ''
        return f'new at {request.scope["address"]}'

    def _model_of(self, request: Request, form: FormData, beside: Path) -> str:
        """Copy the diagnosis of a recording that was chosen; return its robot, empty for none."""
        key = str(form.get('of', ''))
        if not key:
            return ''
        if (beside / DIAGNOSIS).is_file():
            raise DataError('a diagnosis was chosen and another one dropped; keep one of them')
        job = self._job(request, key)
        result = self._queue.folder(job) / FOUND / DIAGNOSIS
        if job.state != DONE or not result.is_file():
            raise DataError('that recording has no diagnosis that corrects a program')
        beside.mkdir(parents=True, exist_ok=True)
        shutil.copy(result, beside / DIAGNOSIS)
        for name in job.names:
            if name == job.asked.robot:
                shutil.copy(job.uploads(self._queue.folder(job)) / name, beside / name)
        return job.asked.robot

    def recordings(self, request: Request) -> Response:
        mine = self._queue.of(request.scope['user'])
        return HTMLResponse(pages.recordings_page(mine, self._ways))

    def recording(self, request: Request, key: str) -> Response:
        job = self._job(request, key)
        ahead = self._queue.place(job) if job.state in OPEN else 0
        result = self._queue.folder(job) / FOUND
        return HTMLResponse(
            pages.job_page(
                job, ahead, _diagnosis_in(result / DIAGNOSIS), _written(job, result), self._ways
            )
        )

    async def again(self, request: Request, key: str) -> Response:
        job = self._job(request, key)
        async with request.form(max_files=0, max_fields=FIELDS, max_part_size=FIELD) as form:
            if job.kind == PROGRAM:
                place = self._queue.folder(job) / MODEL
                asked = asked_of_program(form, [file.name for file in place.iterdir()])
            else:
                asked = asked_of(form, job.names)
        self._queue.again(job, asked)
        return RedirectResponse(f'/recordings/{key}', 303)

    def delete(self, request: Request, key: str) -> Response:
        self._queue.remove(self._job(request, key))
        return RedirectResponse('/recordings', 303)

    def into_history(self, request: Request, key: str) -> Response:
        job = self._job(request, key)
        if job.state == DONE and job.asked.cell:
            self._queue.into_history(job)
        return RedirectResponse(f'/recordings/{key}', 303)

    def file(self, request: Request, key: str, name: str) -> Response:
        job = self._job(request, key)
        result = self._queue.folder(job) / FOUND
        if name not in _written(job, result):
            raise HTTPException(404)
        headers = {'content-security-policy': SANDBOX}
        if name.lower().endswith('.html'):
            return FileResponse(result / name, headers=headers)
        return FileResponse(
            result / name, headers=headers, filename=name, media_type='application/octet-stream'
        )

    def program(self, request: Request, of: str = '') -> Response:
        mine = self._queue.of(request.scope['user'])
        return HTMLResponse(pages.program_page(mine, of, self._ways))

    def me(self, request: Request) -> Response:
        return HTMLResponse(pages.me_page(request.scope['user'], self._ways))

    async def enter(self, request: Request) -> Response:
        async with request.form(max_files=0, max_fields=FIELDS, max_part_size=FIELD) as form:
            key = str(form.get('key', '')).strip().lower()
        if not self._people.knows(key):
            raise DataError('that is no key of this server; copy the whole of it')
        request.scope['cookies'] = be(key)
        return RedirectResponse('/recordings', 303)

    def leave(self, request: Request) -> Response:
        request.scope['cookies'] = be_nobody()
        return self._message('logged out', 'This browser knows nothing of you any more.')

    async def delete_me(self, request: Request) -> Response:
        async with request.form(max_files=0, max_fields=FIELDS, max_part_size=FIELD) as form:
            if form.get('sure') != 'yes':
                raise DataError('say that you are sure: it cannot be undone')
        await run_in_threadpool(self._queue.remove_user, request.scope['user'])
        return self._message('deleted', 'All your recordings and your history are deleted.')

    async def history(self, request: Request, cell: str = '') -> Response:
        file = self._queue.user_folder(request.scope['user']) / HISTORY
        if not file.exists():
            return self._message(
                'my history', 'Nothing yet: name the cell when you drop a recording.'
            )
        return await self._read(str(file), '/history', cell)

    async def plant(self, cell: str = '') -> Response:
        if not self._settings.database:
            return self._message('plant', 'This server has no history of the plant (--db URL).')
        return await self._read(self._settings.database, '/plant', cell)

    async def _read(self, url: str, place: str, cell: str) -> Response:
        """Return a page of a database, or that it cannot be had now."""
        if self._readers.locked():
            return self._message(
                'busy',
                'Others are looking at histories, and the database is slow; try again.',
                503,
            )
        async with self._readers:
            try:
                return await run_in_threadpool(_cells, url, place, cell, self._ways.ways())
            except (Unavailable, OSError):
                text = 'The history cannot be read now. Nothing of it is lost; try again later.'
                return self._message('history', text, 503)

    def live(self) -> Response:
        return HTMLResponse(pages.live_page(self._live(), self._ways))

    def _job(self, request: Request, key: str) -> Job:
        job = self._queue.get(key, request.scope['user'])
        if job is None:
            raise HTTPException(404)
        return job

    def _message(self, title: str, text: str, status: int = 200) -> Response:
        page = pages.message_page(title, text, self._ways)
        return HTMLResponse(page, status)

    async def refused(self, request: Request, error: Exception) -> Response:
        """Answer what went wrong in a sentence."""
        if isinstance(error, TooMuch):
            most = self._settings.upload / 1e6
            return self._message('too large', f'An upload has at most {most:.0f} MB.', 413)
        if isinstance(error, TooSlow | ClientDisconnect):
            return self._message('too slow', 'The upload came too slowly; try it again.', 408)
        if isinstance(error, Busy):
            text = 'Many uploads come from your address; try again in a minute.'
            return self._message('busy', text, 503)
        if isinstance(error, NoRoom) or is_full(error):
            text = str(error) if isinstance(error, NoRoom) else NO_ROOM
            return self._message('no room', f'{capital(text)}.', FULL)
        if isinstance(error, TwinError):
            return self._asked_anew(request, str(error))
        status = getattr(error, 'status_code', 500)
        if status == 404:
            return self._message('not found', 'There is nothing here.', 404)
        text = str(getattr(error, 'detail', 'That did not work, and it is not your fault.'))
        return self._message('refused', text, status)

    def _asked_anew(self, request: Request, why: str) -> Response:
        """Return the page on which something was asked that is refused, and why."""
        path = request.url.path
        if path == '/program':
            mine = self._queue.of(request.scope['user'])
            page = pages.program_page(mine, '', self._ways, why)
        elif path.startswith('/me'):
            page = pages.me_page(request.scope['user'], self._ways, why)
        elif path.startswith(('/history', '/plant')):
            return self._message('refused', sentence(why), 422)
        else:
            page = pages.start_page(self._ways, why)
        return HTMLResponse(page, 422)


def _files(form: FormData, name: str) -> list[UploadFile]:
    return [each for each in form.getlist(name) if isinstance(each, UploadFile)]


def _diagnosis_in(file: Path) -> dict[str, Any] | None:
    """Return a diagnosis; None where there is none that can be read."""
    try:
        content = json.loads(file.read_text(encoding='utf-8'))
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) else None


def _written(job: Job, result: Path) -> list[str]:
    """Return the names of the files that somebody may fetch."""
    if not result.is_dir():
        return []
    known: dict[str, str | None] = dict(pages.FILES)
    if job.kind == PROGRAM:
        known = {**dict(pages.PROGRAM_FILES), **dict.fromkeys(job.names)}
    return [name for name in known if (result / name).is_file()]


def _cells(url: str, place: str, cell: str, ways: Html) -> Response:
    """Return the page of all cells of a database, or of one."""
    with closing(Database(url, make=False)) as database:
        if cell:
            return HTMLResponse(page_of(database, cell, place, ways))
        page = ranking_page(database, lambda name: f'{place}/{quote(name, safe="")}', ways)
    return HTMLResponse(page)
