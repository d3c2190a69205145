# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The nodes under enforced security: who has no keys, or others, hears and says nothing.

The same is tried without keys first: there a stranger must hear the twin and be recorded, or else
the trial shows nothing. It needs `ros2 security` and a middleware that is built with DDS security; where
they are missing, the result says so and does not pass. With ``--source`` both are built first.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from weld_twin_msgs_py.files import markdown

WAYS = ('open', 'enforced')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        '--source',
        metavar='DIR',
        help='folder with rmw_cyclonedds, ros2cli and sros2 (branch jazzy), to be built and used',
    )
    parser.add_argument(
        '--work', metavar='DIR', help='where to build it; kept, and used again next time'
    )


def run(args: argparse.Namespace, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return what strangers heard and what was recorded of them, without keys and with."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        result = _tried(args, Path(folder), tell)
    return {'passed': verdict(result), **result}


def _tried(args: argparse.Namespace, folder: Path, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return what came of each way, as far as it could be tried, and why not further."""
    from contextlib import ExitStack

    from weld_twin_core.errors import TwinError

    from .securing.middleware import secured_middleware
    from .securing.scenario import keystore, played

    result: dict[str, Any] = {'reason': ''}
    with ExitStack() as stack:
        for way in WAYS:
            place = folder / way
            place.mkdir()
            try:
                if args.source and way == WAYS[0]:
                    work = Path(args.work) if args.work else folder / 'built'
                    stack.enter_context(secured_middleware(Path(args.source), work))
                result['middleware'] = os.environ.get('RMW_IMPLEMENTATION', '')
                keys = keystore(place) if way == 'enforced' else None
                result[way] = played(place, keys)
            except TwinError as error:
                result['reason'] = f'{way}: {error}'
                break
            tell(f'{way}: {result[way]}')
    return result


def verdict(result: dict[str, Any]) -> bool:
    """Return whether strangers get through without keys, and nobody but the driver with them."""
    if any(way not in result or not result[way]['alive'] for way in WAYS):
        return False
    free, locked = result['open'], result['enforced']
    shown = free['heard'] > 0 and all(count > 0 for count in free['recorded'])
    driver, *strangers = locked['recorded']
    return bool(shown and driver > 0 and locked['heard'] == 0 and not any(strangers))


def table(result: dict[str, Any]) -> str:
    """Return a row without keys and one with them."""
    head = (
        *('keys', 'all nodes ran', 'poses a stranger heard', 'joint states of the driver'),
        *('of one without keys', 'of one with other keys'),
    )
    rows = [
        (way, 'yes' if made['alive'] else 'no', made['heard'], *made['recorded'])
        for way, made in ((way, result[way]) for way in WAYS if way in result)
    ]
    reason = f'\n{result["reason"]}\n' if result['reason'] else ''
    return markdown.table(head, *rows) + reason
