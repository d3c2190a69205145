# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The application: addresses and what answers them."""

from __future__ import annotations

import asyncio
import json
import shutil
from collections.abc import Callable, Mapping
from dataclasses import replace
from urllib.parse import quote

from fastapi import FastAPI, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import FileResponse, HTMLResponse, RedirectResponse, Response
from starlette.datastructures import UploadFile
from starlette.exceptions import HTTPException

from weld_twin_core.errors import TwinError

from ..fleet.cell_page import cell_page
from ..fleet.ranking_page import ranking_page
from ..history.database import Database
from ..report.html import Html
from . import pages
from .access import Access, TooMuch
from .job import FOUND, OPEN, UPLOADS, Asked, Job
from .queue import HISTORY, Queue
from .settings import Settings
from .uploads import asked_of, save

FIELDS = 20
"""Fields of a form at most, besides its files."""
UPLOADING = 4
"""Uploads read at the same time, which bounds what lies half read on the disk; others wait."""
SANDBOX = 'sandbox allow-scripts allow-downloads allow-modals'
"""A sheet draws itself and prints; it is kept off the pages around it, cookies included."""
FIELD = 4096
"""Bytes of a field at most."""
Said = Callable[[], Mapping[str, str] | None]


def make_app(settings: Settings, queue: Queue, live: Said = lambda: None) -> Access:
    """
    Return the application.

    Parameters
    ----------
    settings : Settings
    queue : Queue
    live : callable
        Returns the last verdict of running nodes.

    """
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    site = _Site(settings, queue, live)
    get, post = ['GET'], ['POST']
    for path, answer, methods in (
        ('/', site.start, get),
        ('/recordings', site.drop, post),
        ('/recordings', site.recordings, get),
        ('/recordings/{key}', site.recording, get),
        ('/recordings/{key}/again', site.again, post),
        ('/recordings/{key}/{name}', site.file, get),
        ('/history', site.history, get),
        ('/history/{cell:path}', site.history, get),
        ('/plant', site.plant, get),
        ('/plant/{cell:path}', site.plant, get),
        ('/live', site.live, get),
    ):
        app.add_api_route(path, answer, methods=methods, response_model=None)
    app.add_exception_handler(TooMuch, site.too_much)
    app.add_exception_handler(TwinError, site.refused)
    app.add_exception_handler(HTTPException, site.not_found)
    return Access(app, settings)


class _Site:
    def __init__(self, settings: Settings, queue: Queue, live: Said) -> None:
        self._settings, self._queue, self._live = settings, queue, live
        self._ways = pages.Site(bool(settings.database), settings.live)
        self._uploads = asyncio.Semaphore(UPLOADING)

    def start(self) -> Response:
        return HTMLResponse(pages.start_page(self._ways))

    async def drop(self, request: Request) -> Response:
        user = request.scope['user']
        self._queue.check_room(user)
        job = Job.new(user, (), Asked(''))
        folder = self._queue.folder(job)
        try:
            async with (
                self._uploads,
                request.form(
                    max_files=self._settings.files, max_fields=FIELDS, max_part_size=FIELD
                ) as form,
            ):
                uploads = [f for f in form.getlist('files') if isinstance(f, UploadFile)]
                names = await save(uploads, folder / UPLOADS, self._settings.files)
                job = replace(job, names=names).ask(asked_of(form, names))
            self._queue.add(job)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        return RedirectResponse(f'/recordings/{job.key}', 303)

    def recordings(self, request: Request) -> Response:
        mine = self._queue.of(request.scope['user'])
        return HTMLResponse(pages.recordings_page(mine, self._ways))

    def recording(self, request: Request, key: str) -> Response:
        job = self._job(request, key)
        ahead = self._queue.place(job) if job.state in OPEN else 0
        found = self._queue.folder(job) / FOUND / 'diagnosis.json'
        told = json.loads(found.read_text(encoding='utf-8')) if found.is_file() else None
        return HTMLResponse(pages.job_page(job, ahead, told, self._ways))

    async def again(self, request: Request, key: str) -> Response:
        job = self._job(request, key)
        async with request.form(max_files=0, max_fields=FIELDS, max_part_size=FIELD) as form:
            asked = asked_of(form, job.names)
        if job.state not in OPEN:
            self._queue.add(job.ask(asked))
        return RedirectResponse(f'/recordings/{key}', 303)

    def file(self, request: Request, key: str, name: str) -> Response:
        file = self._queue.folder(self._job(request, key)) / FOUND / name
        if name not in dict(pages.FILES) or not file.is_file():
            raise HTTPException(404)
        return FileResponse(file, headers={'content-security-policy': SANDBOX})

    async def history(self, request: Request, cell: str = '') -> Response:
        file = self._queue.user_folder(request.scope['user']) / HISTORY
        if not file.exists():
            return self._message(
                'my history', 'Nothing yet: name the cell when you drop a recording.'
            )
        return await run_in_threadpool(_cells, str(file), '/history', cell, self._ways.ways())

    async def plant(self, cell: str = '') -> Response:
        if not self._settings.database:
            return self._message('plant', 'This server has no history of the plant (--db URL).')
        return await run_in_threadpool(
            _cells, self._settings.database, '/plant', cell, self._ways.ways()
        )

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

    async def too_much(self, request: Request, error: Exception) -> Response:
        most = self._settings.upload / 1e6
        return self._message('too large', f'An upload has at most {most:.0f} MB.', 413)

    async def refused(self, request: Request, error: Exception) -> Response:
        return HTMLResponse(pages.start_page(self._ways, str(error)), 422)

    async def not_found(self, request: Request, error: Exception) -> Response:
        status = getattr(error, 'status_code', 500)
        text = str(getattr(error, 'detail', '')) if status != 404 else 'There is nothing here.'
        return self._message('not found' if status == 404 else 'refused', text, status)


def _cells(url: str, place: str, cell: str, ways: Html) -> Response:
    """Return the page of all cells of a database, or of one."""
    database = Database(url)
    try:
        if cell:
            return HTMLResponse(cell_page(database, cell, place, ways))
        page = ranking_page(database, lambda name: f'{place}/{quote(name, safe="")}', ways)
        return HTMLResponse(page)
    finally:
        database.close()
