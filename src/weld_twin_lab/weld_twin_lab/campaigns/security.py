# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The nodes under enforced security: who has no keys, or others, hears and says nothing.

The same is tried without keys first: there every stranger must hear the twin and be recorded, or else
the trial shows nothing. It needs sros2 and a middleware that is built with DDS security; where they are
missing, the result says so and does not pass. With ``--source`` both are built first.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from weld_twin_msgs_py.files import markdown
from weld_twin_msgs_py.messages.topics import DIAGNOSIS

from ..study import options

WAYS = ('open', 'enforced')


OPTIONS = options(
    """
--source DIR  folder with rmw_cyclonedds and sros2 (branch jazzy), to be built and used
--work DIR    where to build it; kept, and used again next time
""",
    out='',
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
    from weld_twin_nodes.harness.process import own_domain

    from .securing.middleware import secured_middleware
    from .securing.scenario import PARTIES, locks, played

    result: dict[str, Any] = {'reason': '', 'parties': list(PARTIES)}
    with ExitStack() as stack:
        for way in WAYS:
            place = folder / way
            place.mkdir()
            try:
                if args.source and way == WAYS[0]:
                    work = Path(args.work) if args.work else folder / 'built'
                    stack.enter_context(secured_middleware(Path(args.source), work))
                result['middleware'] = os.environ.get('RMW_IMPLEMENTATION', '')
                with own_domain():  # keys are for one domain
                    locked = locks(place) if way == 'enforced' else [{} for _ in PARTIES]
                    result[way] = played(place, locked)
            except TwinError as error:
                result['reason'] = f'{way}: {error}'
                break
            tell(f'{way}: {result[way]}')
    return result


def verdict(result: dict[str, Any]) -> bool:
    """
    Return whether strangers get through without keys, and nobody but the driver with them.

    All nodes must have run, and ended with code 0.
    What the nodes made of the driver's joint states without keys, they make with keys too; but for a
    verdict, which may be there in time in the one trial and not in the other.
    """
    if any(way not in result for way in WAYS):
        return False
    if any(not result[way]['alive'] or any(result[way]['codes']) for way in WAYS):
        return False
    free, locked = result['open'], result['enforced']
    shown = all(count > 0 for count in (*free['heard'], *free['recorded']))
    through = locked['heard'][0] > 0 and locked['recorded'][0] > 0
    kept_out = not any((*locked['heard'][1:], *locked['recorded'][1:]))
    made = set(free['topics']) - {DIAGNOSIS.name}
    return bool(shown and through and kept_out and made <= set(locked['topics']))


def table(result: dict[str, Any]) -> str:
    """Return a row of each party without keys and with them."""
    head = ('keys', 'who', "twin's poses it heard", 'joint states of it that were recorded')
    rows = [
        (way, who, result[way]['heard'][k], result[way]['recorded'][k])
        for way in WAYS
        if way in result
        for k, who in enumerate(result['parties'])
    ]
    more = [
        f'{way}: all nodes ran: {"yes" if result[way]["alive"] else "no"}; '
        f'topics recorded: {len(result[way]["topics"])}'
        for way in WAYS
        if way in result
    ]
    remarks = '\n'.join([*more, *([result['reason']] if result['reason'] else [])])
    return f'{markdown.table(head, *rows)}\n{remarks}\n'
