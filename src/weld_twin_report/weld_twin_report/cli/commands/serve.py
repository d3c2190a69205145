# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis in a browser."""

import secrets
from dataclasses import replace
from pathlib import Path

from weld_twin_core.errors import DataError
from weld_twin_nodes.cli.given import Given

from .. import GIGABYTE, limits

LAST_PORT = 65_535
"""A port is a number of sixteen bits."""
TOKEN = 24
"""Bytes of chance in a token."""


def run(given: Given) -> int:
    """Serve until Ctrl-C."""
    if not 0 <= given.port <= LAST_PORT:
        raise DataError(
            f'--port takes 0 to {LAST_PORT}, got {given.port}; 0 takes any that is free'
        )
    more = (given.upload, given.disk, given.minutes)
    if given.workers < 1 or given.memory < 1.0 or not all(0.0 < each < 1e6 for each in more):
        raise DataError(
            '--workers takes 1 or more, --memory 1 GB or more, the others more than none'
        )
    from ...serve import Settings
    from ...serve.running import serve

    settings = Settings(
        Path(given.dir),
        given.host,
        given.port,
        tuple(given.name),
        given.token,
        given.workers,
        limits(given),
        upload=round(given.upload * GIGABYTE),
        disk=round(given.disk * GIGABYTE),
        proxy=given.behind_proxy,
        database=given.db,
        live=given.live,
    )
    if not settings.alone and not settings.token:
        settings = replace(settings, token=secrets.token_urlsafe(TOKEN))
    serve(settings, lambda address: print(f'open {address}', flush=True))
    return 0
