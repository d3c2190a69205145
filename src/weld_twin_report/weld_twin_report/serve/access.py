# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Who may come in: checked before anything of a request is read.

A page of another site must not reach this server through the browser of who sits here. So the name
that the browser asked for must be one of ours, and whatever changes something must come from a page
of ours.

Of one address only so many connections may wait for the head of their request, for a few seconds;
beyond, the one that has waited longest gives way. uvicorn has no limit before the first request, and
no server counts by address.
"""

from __future__ import annotations

import asyncio
import hmac
import os
import resource
import secrets
import time
from collections.abc import Awaitable, Callable
from hashlib import sha256
from http.cookies import CookieError, SimpleCookie
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import parse_qsl, quote, urlencode, urlsplit

from .settings import LOOPBACK, Settings
from .uploads import Bodies, Body, Rates, Receive, TooSlow

HEAD = 10.0
"""Seconds that the head of a request may take; a browser sends it at once, in one piece."""
GRACE = 1.0
"""Seconds in which nobody gives way: many that come at once are read one after the other."""
OF_ADDRESS = 64
"""Connections of one address that may wait for a head; a browser opens six."""
OF_ALL = 4000
"""Connections open at the same time, where the system allows so many files."""
SPARE = 200
"""Files that are left for recordings, databases and processes."""
LATE = b'HTTP/1.1 408 Request Timeout\r\nconnection: close\r\ncontent-length: 0\r\n\r\n'
Client = tuple[str, int]


class Door(NamedTuple):
    """A connection whose head has not come yet."""

    transport: asyncio.Transport
    timer: asyncio.TimerHandle
    since: float


class Doors:
    """All connections of a server: how many may wait for a head, for how long [s], or be open."""

    def __init__(
        self, of_address: int = OF_ADDRESS, of_all: int | None = None, head: float = HEAD
    ) -> None:
        self._of_address, self._head = of_address, head
        self._of_all = _most_open() if of_all is None else of_all
        self._open: dict[Client, asyncio.Transport] = {}
        self._waiting: dict[Client, Door] = {}  # the first has waited longest

    def opened(self, transport: asyncio.Transport) -> None:
        """Take a new connection."""
        client = _client(transport)
        self._open[client] = transport
        self._wait(client)
        mine = [each for each in self._waiting if each[0] == client[0]]
        if len(mine) > self._of_address and self._idle(mine[0]):
            self._give_way(mine[0])
        elif len(self._open) > self._of_all:
            first = next(iter(self._waiting))
            self._give_way(first if self._idle(first) else client)

    def _idle(self, client: Client) -> bool:
        """Return whether a connection had the time to say something."""
        return time.monotonic() - self._waiting[client].since > GRACE

    def closed(self, transport: asyncio.Transport) -> None:
        """Forget a connection."""
        client = _client(transport)
        self._open.pop(client, None)
        self.began(client)

    def began(self, client: Client) -> None:
        """Note that the head of a request has come."""
        door = self._waiting.pop(client, None)
        if door is not None:
            door.timer.cancel()

    def ended(self, client: Client) -> None:
        """Note that a request was answered: the next one has its own time."""
        if client in self._open:
            self._wait(client)

    def _wait(self, client: Client) -> None:
        transport = self._open[client]
        timer = asyncio.get_running_loop().call_later(self._head, self._late, client)
        self._waiting[client] = Door(transport, timer, time.monotonic())

    def _late(self, client: Client) -> None:
        door = self._waiting.pop(client, None)
        if door is not None:
            door.transport.write(LATE)
            door.transport.close()

    def _give_way(self, client: Client) -> None:
        door = self._waiting.pop(client)
        door.timer.cancel()
        door.transport.abort()


def protocol(doors: Doors) -> type[asyncio.Protocol]:
    """Return what uvicorn speaks, with these doors."""
    from uvicorn.protocols.http.h11_impl import H11Protocol

    class Held(H11Protocol):
        def connection_made(self, transport: Any) -> None:
            super().connection_made(transport)
            self._through = transport
            doors.opened(transport)

        def connection_lost(self, exc: Exception | None) -> None:
            doors.closed(self._through)
            super().connection_lost(exc)

    return Held


def _client(transport: asyncio.Transport) -> Client:
    """Return address and port of the other side, as requests have them."""
    peer = transport.get_extra_info('peername') or ('', id(transport))
    return str(peer[0]), int(peer[1])


def _most_open() -> int:
    """Return how many connections may be open, having asked the system for what it allows."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = OF_ALL + SPARE
    most = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
    if soft != resource.RLIM_INFINITY and soft < most:
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
    else:
        most = wanted
    return max(most - SPARE, OF_ADDRESS)


USER, TOKEN = 'weld_twin_user', 'weld_twin_token'
"""Cookies: who it is, and that the token was right."""
YEAR = 366 * 86_400
"""Seconds for which a browser keeps them, counted anew with every visit."""
HEADERS = (
    (b'content-security-policy', b"frame-ancestors 'self'; form-action 'self'; base-uri 'none'"),
    (b'x-content-type-options', b'nosniff'),
    (b'referrer-policy', b'same-origin'),
    (b'cross-origin-resource-policy', b'same-origin'),
    (b'cross-origin-opener-policy', b'same-origin'),
    (b'cache-control', b'no-store'),
)
"""What every answer says besides: it stays in our own pages and in no cache."""
Scope = dict[str, Any]
Send = Callable[[dict[str, Any]], Awaitable[None]]


class Access:
    """
    Lets requests through to an application, or refuses them.

    ``scope['user']`` is the user's key, ``scope['unknown']`` whether it is of this very moment,
    and ``scope['address']`` where the request comes from.
    """

    def __init__(self, app: Any, settings: Settings, people: People, doors: Doors) -> None:
        self._app, self._settings, self._people, self._doors = app, settings, people, doors
        self._bodies, self._rates = Bodies(), Rates()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope['type'] != 'http':
            if scope['type'] == 'lifespan':
                await self._app(scope, receive, send)
            return
        client = (str(scope['client'][0]), int(scope['client'][1])) if scope['client'] else ('', 0)
        headers = {
            name.decode('latin-1'): value.decode('latin-1') for name, value in scope['headers']
        }
        cookies = _cookies(headers.get('cookie', ''))
        user = cookies.get(USER, '')
        scope['address'] = self._address(client[0], headers)
        scope['unknown'] = not self._people.knows(user)
        scope['user'] = self._people.new() if scope['unknown'] else user
        # Who has no key shares everything with the others of his address who have none.
        party = scope['address'] if scope['unknown'] else user
        length = headers.get('content-length', '0')
        announced = int(length) if length.isdecimal() else None
        body = Body(self._bodies, party, receive, self._settings.upload, announced)
        self._doors.began(client)
        try:
            wait = self._rates.wait(party)
            if wait is None:
                await _refuse(send, 503, 'Too many requests come from here; try again soon.')
                return
            if wait:
                await asyncio.sleep(wait)
            await self._let_in(scope, headers, cookies, body, send)
        finally:
            self._bodies.leave(body)
            self._doors.ended(client)

    async def _let_in(
        self,
        scope: Scope,
        headers: dict[str, str],
        cookies: dict[str, str],
        body: Body,
        send: Send,
    ) -> None:
        """Answer a request, or refuse it."""
        why = self._foreign(scope, headers)
        if why:
            await _refuse(send, 403, why)
            return
        query = scope.get('query_string', b'').decode('latin-1')
        tokens = [value for name, value in parse_qsl(query) if name == 'token']
        right = [value for value in tokens if self._is_token(value)]
        if self._settings.token and not (right or self._known(headers, cookies)):
            await _refuse(send, 401, 'This server needs its token: open the address it printed.')
            return
        kept = [_cookie(TOKEN, right[0])] if right and self._settings.token else []
        if tokens and scope['method'] in ('GET', 'HEAD'):
            # The token must not stay where others read it: in the address, and in the history.
            await _send_on(send, _without_token(scope['path'], query), kept)
            return
        kept += [_cookie(USER, scope['user'])]
        await self._app(scope, body.receive, _with_headers(send, kept, scope, body))

    def _address(self, host: str, headers: dict[str, str]) -> str:
        """Return where a request comes from; a proxy on this machine says for whom it asks."""
        if self._settings.proxy and host in LOOPBACK:
            return headers.get('x-forwarded-for', host).rpartition(',')[2].strip() or host
        return host

    def _foreign(self, scope: Scope, headers: dict[str, str]) -> str:
        """Return why a request does not come from here; empty if it does."""
        host = headers.get('host', '')
        if _name(host) not in {*LOOPBACK, self._settings.host, *self._settings.names}:
            return 'This server does not answer to that name; start it with --name NAME.'
        if scope['method'] in ('GET', 'HEAD'):
            return ''
        origin = headers.get('origin', '')
        if origin and urlsplit(origin).netloc != host:
            return 'That page may not change anything here.'
        if not origin and headers.get('sec-fetch-site', 'same-origin') != 'same-origin':
            return 'That page may not change anything here.'
        return ''

    def _known(self, headers: dict[str, str], cookies: dict[str, str]) -> bool:
        bearer = headers.get('authorization', '').removeprefix('Bearer ')
        return self._is_token(bearer) or self._is_token(cookies.get(TOKEN, ''))

    def _is_token(self, token: str) -> bool:
        return hmac.compare_digest(token.encode(), self._settings.token.encode())


def _name(host: str) -> str:
    """Return a host's name without its port."""
    if host.startswith('['):
        return host[1:].partition(']')[0]
    return host.partition(':')[0].lower()


def _without_token(path: str, query: str) -> str:
    """Return an address on this server, its token left out."""
    rest = [pair for pair in parse_qsl(query, keep_blank_values=True) if pair[0] != 'token']
    place = '/' + quote(path.lstrip('/'))  # two strokes would begin another server's name
    return f'{place}?{urlencode(rest)}' if rest else place


def _cookies(text: str) -> dict[str, str]:
    try:
        return {name: morsel.value for name, morsel in SimpleCookie(text).items()}
    except CookieError:
        return {}


def _cookie(name: str, value: str, seconds: int = YEAR) -> bytes:
    jar: SimpleCookie = SimpleCookie()
    jar[name] = value
    # Lax: who follows a link from elsewhere is still himself. What changes something is checked.
    attributes = {'path': '/', 'httponly': 'yes', 'samesite': 'Lax', 'max-age': str(seconds)}
    for key, how in attributes.items():
        jar[name][key] = how
    return jar[name].OutputString().encode('latin-1')


def be(user: str) -> list[bytes]:
    """Return the cookies of a browser that is this user from now on."""
    return [_cookie(USER, user)]


def be_nobody() -> list[bytes]:
    """Return the cookies of a browser that is nobody from now on."""
    return [_cookie(USER, '', 0), _cookie(TOKEN, '', 0)]


def _with_headers(send: Send, cookies: list[bytes], scope: Scope, body: Body) -> Send:
    """Return what sends answers: with cookies, and not before what was refused has been taken."""

    async def sent(message: dict[str, Any]) -> None:
        if message['type'] == 'http.response.start':
            if message['status'] >= 400 and scope['method'] == 'POST':
                await _drained(body)
            own = scope.get('cookies', cookies)  # an answer may say who the browser is
            more = [*HEADERS, *((b'set-cookie', cookie) for cookie in own)]
            message = {**message, 'headers': [*message.get('headers', []), *more]}
        await send(message)

    return sent


async def _drained(body: Body) -> None:
    try:
        await body.drain()
    except TooSlow:
        return


async def _refuse(send: Send, status: int, why: str) -> None:
    headers = [(b'content-type', b'text/plain; charset=utf-8'), *HEADERS]
    await send({'type': 'http.response.start', 'status': status, 'headers': headers})
    await send({'type': 'http.response.body', 'body': why.encode() + b'\n'})


async def _send_on(send: Send, address: str, cookies: list[bytes]) -> None:
    headers = [(b'location', address.encode('latin-1')), *HEADERS]
    headers += [(b'set-cookie', cookie) for cookie in cookies]
    await send({'type': 'http.response.start', 'status': 303, 'headers': headers})
    await send({'type': 'http.response.body', 'body': b''})


LENGTH = 64
"""Hexadecimal digits of a key: those of its date, forty of chance, those of a signature."""
DATE = 8
"""Hexadecimal digits of the seconds since 1970; enough until 2106."""
SIGNATURE = 16
"""Hexadecimal digits; of 2^64 guesses one is right."""
SETTLED = 600.0
"""Seconds after which a new key counts as a user of its own."""
SECRET = 'secret'
"""File that signs keys."""
SECRET_BYTES = 32
"""Bytes of chance in it."""


class People:
    """Gives out keys and knows them again; older versions gave keys without a signature."""

    def __init__(self, directory: Path, has: Callable[[str], bool]) -> None:
        self._secret, self._has = _secret(directory / SECRET), has

    def new(self) -> str:
        chance = secrets.token_hex((LENGTH - DATE - SIGNATURE) // 2)
        head = f'{int(time.time()):0{DATE}x}{chance}'
        return head + self._signature(head)

    def knows(self, key: str) -> bool:
        """Return whether a key is one of this server."""
        if len(key) != LENGTH or not set(key) <= set('0123456789abcdef'):
            return False
        return self._signed(key) or self._has(key)

    def settled(self, key: str) -> bool:
        """Return whether a key was given long enough ago."""
        return not self._signed(key) or time.time() - int(key[:DATE], 16) > SETTLED

    def _signed(self, key: str) -> bool:
        return hmac.compare_digest(self._signature(key[:-SIGNATURE]), key[-SIGNATURE:])

    def _signature(self, head: str) -> str:
        return hmac.new(self._secret, head.encode(), sha256).hexdigest()[:SIGNATURE]


def _secret(file: Path) -> bytes:
    """Return the secret of a server; the first start makes it."""
    try:
        with os.fdopen(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), 'wb') as stream:
            stream.write(secrets.token_bytes(SECRET_BYTES))
    except FileExistsError:
        pass
    made = file.read_bytes()
    if len(made) == SECRET_BYTES:
        return made
    file.unlink()  # a full disk cut it off; keys given meanwhile are known by what is kept of them
    return _secret(file)
