# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Who may come in: checked before anything of a request is read.

A page of another site must not reach this server through the browser of who sits here. So the name
that the browser asked for must be one of ours, and whatever changes something must come from a page
of ours.
"""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Awaitable, Callable
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

from .settings import LOOPBACK, Settings

USER, TOKEN = 'weld_twin_user', 'weld_twin_token'
"""Cookies: who it is, and that the token was right."""
KEY = 32
"""Bytes of chance in the name of a user."""
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
Receive = Callable[[], Awaitable[dict[str, Any]]]


class TooMuch(Exception):
    """The body of a request is larger than is allowed."""


class Access:
    """
    Lets requests through to an application, or refuses them.

    The user's name comes to the application as ``scope['user']``.
    """

    def __init__(self, app: Any, settings: Settings) -> None:
        self._app, self._settings = app, settings

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope['type'] != 'http':
            if scope['type'] == 'lifespan':
                await self._app(scope, receive, send)
            return
        headers = {
            name.decode('latin-1'): value.decode('latin-1') for name, value in scope['headers']
        }
        cookies = _cookies(headers.get('cookie', ''))
        why = self._foreign(scope, headers)
        if why:
            await _refuse(send, 403, why)
            return
        told = parse_qs(scope.get('query_string', b'').decode('latin-1')).get('token', [''])[0]
        if self._settings.token and not self._known(headers, cookies, told):
            await _refuse(send, 401, 'This server needs its token: open the address it printed.')
            return
        fresh = []
        user = cookies.get(USER, '')
        if not _is_key(user):
            user = secrets.token_hex(KEY)
            fresh.append(_cookie(USER, user))
        if told:
            fresh.append(_cookie(TOKEN, told))
        scope['user'] = user
        await self._app(scope, self._bounded(headers, receive), _with_headers(send, fresh))

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

    def _known(self, headers: dict[str, str], cookies: dict[str, str], told: str) -> bool:
        bearer = headers.get('authorization', '').removeprefix('Bearer ')
        token = self._settings.token.encode()
        given = (told, bearer, cookies.get(TOKEN, ''))
        return any(hmac.compare_digest(each.encode(), token) for each in given)

    def _bounded(self, headers: dict[str, str], receive: Receive) -> Receive:
        """Return a receiver that reads no more than is allowed."""
        left = self._settings.upload
        length = headers.get('content-length', '0')
        too_long = not length.isdigit() or int(length) > left

        async def counted() -> dict[str, Any]:
            nonlocal left
            if too_long:
                raise TooMuch
            message = await receive()
            left -= len(message.get('body', b''))
            if left < 0:
                raise TooMuch
            return message

        return counted


def _name(host: str) -> str:
    """Return a host's name without its port."""
    if host.startswith('['):
        return host[1:].partition(']')[0]
    return host.partition(':')[0].lower()


def _is_key(text: str) -> bool:
    return len(text) == 2 * KEY and all(c in '0123456789abcdef' for c in text)


def _cookies(text: str) -> dict[str, str]:
    try:
        return {name: morsel.value for name, morsel in SimpleCookie(text).items()}
    except CookieError:
        return {}


def _cookie(name: str, value: str) -> bytes:
    jar: SimpleCookie = SimpleCookie()
    jar[name] = value
    for key, told in (('path', '/'), ('httponly', 'yes'), ('samesite', 'Strict')):
        jar[name][key] = told
    return jar[name].OutputString().encode('latin-1')


def _with_headers(send: Send, cookies: list[bytes]) -> Send:
    async def sent(message: dict[str, Any]) -> None:
        if message['type'] == 'http.response.start':
            more = [*HEADERS, *((b'set-cookie', cookie) for cookie in cookies)]
            message = {**message, 'headers': [*message.get('headers', []), *more]}
        await send(message)

    return sent


async def _refuse(send: Send, status: int, why: str) -> None:
    headers = [(b'content-type', b'text/plain; charset=utf-8'), *HEADERS]
    await send({'type': 'http.response.start', 'status': status, 'headers': headers})
    await send({'type': 'http.response.body', 'body': why.encode() + b'\n'})
