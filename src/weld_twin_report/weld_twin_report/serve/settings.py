# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a server may do and how much it takes."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ..guarded import Limits

LOOPBACK = ('localhost', '127.0.0.1', '::1')
"""Names under which only this machine reaches the server."""


@dataclass(frozen=True)
class Settings:
    """
    Settings of a server.

    Attributes
    ----------
    directory : Path
        Where uploads and results lie.
    port : int
        0 for any that is free.
    names : tuple of str
        Host names that browsers may use besides those of this machine.
    token : str
        Who comes without it is refused; empty only where this machine alone can come.
    workers : int
        Recordings diagnosed at the same time.
    limits : Limits
        Of each of them.
    upload : int
        Bytes of one upload, all its files together.
    files : int
        Files of one upload.
    own, strangers, waiting : int
        Recordings that may wait: of one user, of the new visitors of one address together, of all.
    kept, kept_of_all : int
        Recordings kept, of one user and of all; the oldest that are finished go first, of all those
        of whoever has most.
    disk : int
        Bytes of everything that is kept.
    proxy : bool
        Whether a proxy on this machine says for whom it asks (``X-Forwarded-For``).
    database : str
        History of the plant that everybody may read; empty for none.
    live : bool
        Whether the verdict of running nodes is shown.

    """

    directory: Path
    host: str = 'localhost'
    port: int = 8765
    names: tuple[str, ...] = ()
    token: str = ''
    workers: int = 1
    limits: Limits = field(default_factory=lambda: Limits(cpu_s=900, wall_s=1200.0))
    upload: int = 1_000_000_000
    files: int = 24
    own: int = 10
    strangers: int = 30
    waiting: int = 100
    kept: int = 50
    kept_of_all: int = 1000
    disk: int = 20_000_000_000
    proxy: bool = False
    database: str = ''
    live: bool = False

    @property
    def alone(self) -> bool:
        """Return whether only this machine reaches the server."""
        return self.host in LOOPBACK
