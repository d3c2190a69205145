# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a server may do and how much it takes."""

from dataclasses import dataclass, field
from pathlib import Path

from ..guarded import Limits

LOOPBACK = ('localhost', '127.0.0.1', '::1')
"""Names under which only this machine reaches the server."""


@dataclass(frozen=True)
class Settings:
    directory: Path  # where uploads and results lie
    host: str = 'localhost'
    port: int = 8765  # 0 for any that is free
    names: tuple[str, ...] = ()  # host names that browsers may use besides those of this machine
    token: str = ''
    """Who comes without it is refused; empty only where this machine alone can come."""
    workers: int = 1  # recordings diagnosed at the same time
    limits: Limits = field(default_factory=lambda: Limits(cpu_s=900, wall_s=1200.0))
    """Of each of them."""
    upload: int = 1_000_000_000  # bytes of one upload, all its files together
    files: int = 24  # files of one upload
    own: int = 10
    strangers: int = 30
    waiting: int = 100
    """Recordings that may wait: of one user, of the new visitors of one address together, of
    all."""
    kept: int = 50
    kept_of_all: int = 1000
    """Recordings kept, of one user and of all; the oldest that are finished go first, of all those
    of whoever has most."""
    disk: int = 20_000_000_000  # bytes of everything that is kept
    proxy: bool = False
    """Whether a proxy on this machine says for whom it asks (``X-Forwarded-For``)."""
    database: str = ''  # history of the plant that everybody may read; empty for none
    live: bool = False  # whether the verdict of running nodes is shown

    @property
    def alone(self) -> bool:
        """Return whether only this machine reaches the server."""
        return self.host in LOOPBACK
