# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis in a browser: drop a recording, answer what is asked, read the sheet.

Only this machine reaches the server, unless --host says otherwise; whoever comes from elsewhere then
needs the token, which is in the address that is printed. Recordings and results stay in --dir, and a
server that is started again goes on with what waits.
"""

from __future__ import annotations

import argparse

GIGABYTE = 1_000_000_000
"""Bytes."""
LAST_PORT = 65_535
"""A port is a number of sixteen bits."""
TOKEN = 24
"""Bytes of chance in a token."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        '--dir', default='weld_twin_served', metavar='DIR', help='where uploads and results lie'
    )
    parser.add_argument('--port', type=int, default=8765, metavar='N', help='0: any that is free')
    parser.add_argument(
        '--host', default='localhost', metavar='HOST', help='0.0.0.0 lets other machines in'
    )
    parser.add_argument(
        '--name',
        action='append',
        default=[],
        metavar='NAME',
        help='a host name or address that browsers use for this machine; may be given again',
    )
    parser.add_argument('--token', default='', help='what visitors need (default: drawn anew)')
    parser.add_argument('--workers', type=int, default=1, metavar='N', help='side by side')
    parser.add_argument('--upload', type=float, default=1.0, metavar='GB', help='of one recording')
    parser.add_argument(
        '--disk', type=float, default=20.0, metavar='GB', help='of everything that is kept'
    )
    parser.add_argument('--memory', type=float, default=6.0, metavar='GB', help='of one diagnosis')
    parser.add_argument(
        '--minutes', type=float, default=15.0, metavar='N', help='of one diagnosis'
    )
    parser.add_argument(
        '--db', default='', metavar='URL', help='history of the plant, shown to everybody'
    )
    parser.add_argument(
        '--behind-proxy',
        action='store_true',
        help='a proxy on this machine tells in X-Forwarded-For whom it asks for',
    )
    parser.add_argument('--live', action='store_true', help='show the verdict of running nodes')


def run(args: argparse.Namespace) -> int:
    """Serve until Ctrl-C."""
    import secrets
    from pathlib import Path

    from weld_twin_core.errors import DataError
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
        from dataclasses import replace

        settings = replace(settings, token=secrets.token_urlsafe(TOKEN))
    serve(settings, lambda address: print(f'open {address}', flush=True))
    return 0
