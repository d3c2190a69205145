# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Who somebody is: a key that this server gave to a browser, and that no one can make up.

A key says when it was given. For its first minutes it shares what may wait with the other new ones of
its address: so nobody becomes a hundred users by asking a hundred times.
"""

from __future__ import annotations

import hmac
import os
import secrets
import time
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

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
    """
    Gives out keys and knows them again.

    Parameters
    ----------
    directory : Path
        Of the server; the secret lies there.
    has : callable
        Tells whether something is kept of a key: older versions gave keys without a signature.

    """

    def __init__(self, directory: Path, has: Callable[[str], bool]) -> None:
        self._secret, self._has = _secret(directory / SECRET), has

    def new(self) -> str:
        """Return a new key."""
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
