# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis in a browser: drop a recording, read on.

Only this machine reaches the server, unless --host says otherwise; whoever comes from elsewhere then
needs the token, which is in the address that is printed. Recordings and results stay in --dir, and a
server that is started again goes on with what waits.
"""

from __future__ import annotations

import argparse
import secrets
from dataclasses import replace
from pathlib import Path

from weld_twin_core.errors import DataError

EXAMPLE = 'weld-twin serve --dir served'
GIGABYTE = 1_000_000_000
"""Bytes."""
LAST_PORT = 65_535
"""A port is a number of sixteen bits."""
TOKEN = 24
"""Bytes of chance in a token."""


OPTIONS = (
    """
--dir DIR                where uploads and results lie [default: weld_twin_served]
--port N                 0: any that is free [default: 8765]
--host HOST              0.0.0.0 lets other machines in [default: localhost]
--token TEXT             what visitors need (default: drawn anew)
--db URL                 history of the plant, shown to everybody
--live                   show the verdict of running nodes
rare:
--name NAME              a host name or address that browsers use for this machine; may be given again
--behind-proxy           a proxy here tells in X-Forwarded-For whom it asks for
limits:
rare:
--workers N              side by side [default: 1]
--upload GB              of one recording [default: 1]
--disk GB                of everything that is kept [default: 20]
--memory GB              of one diagnosis [default: 6]
--minutes MIN            of one diagnosis [default: 15]
""",
)


def run(args: argparse.Namespace) -> int:
    """Serve until Ctrl-C."""
    from weld_twin_report.guarded import Limits
    from weld_twin_report.serve import Settings
    from weld_twin_report.serve.running import serve

    if not 0 <= args.port <= LAST_PORT:
        raise DataError(
            f'--port takes 0 to {LAST_PORT}, got {args.port}; 0 takes any that is free'
        )
    more = (args.upload, args.disk, args.minutes)
    if args.workers < 1 or args.memory < 1.0 or not all(0.0 < each < 1e6 for each in more):
        raise DataError(
            '--workers takes 1 or more, --memory 1 GB or more, the others more than none'
        )
    wall = max(round(60.0 * args.minutes), 1)
    settings = Settings(
        Path(args.dir),
        args.host,
        args.port,
        tuple(args.name),
        args.token,
        args.workers,
        Limits(memory=round(args.memory * GIGABYTE), cpu_s=wall, wall_s=wall),
        upload=round(args.upload * GIGABYTE),
        disk=round(args.disk * GIGABYTE),
        proxy=args.behind_proxy,
        database=args.db,
        live=args.live,
    )
    if not settings.alone and not settings.token:
        settings = replace(settings, token=secrets.token_urlsafe(TOKEN))
    serve(settings, lambda address: print(f'open {address}', flush=True))
    return 0
