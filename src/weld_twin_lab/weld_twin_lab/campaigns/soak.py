# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""All nodes together for a long time: memory, lost samples, CPU time.

The generator goes along a seam there and back in real time; injector, twin, analyzer, markers,
recorder and live diagnosis work on what it sends.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

from weld_twin_msgs_py.files import markdown

from ..study import options

EVERY = 5.0
"""Seconds between two looks at the processes."""
WARM = 0.2
"""Part of the run that is left out of the slope of the memory: buffers fill, caches grow."""
FLAT = 20.0
"""Largest slope of a node's memory [MiB/h] that passes."""
EFFECTS = """
- {effect: backlash, joint: shoulder_pan_joint, width: 8e-4}
- {effect: joint_offset, joint: elbow_joint, offset: 3e-4}
- {effect: measurement_noise, sigma: 2e-5}
"""


OPTIONS = options(
    """
--minutes M  length of the trial [default: 30]
--rate HZ    joint states a second [default: 500]
--cores N    cores all nodes share [default: 2]
""",
    out='',
)


def run(args: argparse.Namespace, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return memory, CPU share and losses of every node."""
    import os
    import tempfile
    from pathlib import Path

    from .live.soaking import Soak, losses, verdict

    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: args.cores])
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder) / 'bag'
        with Soak(Path(folder) / 'cell', bag, args.rate, args.minutes * 60.0, EFFECTS) as soak:
            soak.run(EVERY, tell)
            health, nodes = soak.health(), soak.usage(WARM)
            soak.finish()
            lost = losses(bag, soak.sent)
    result = {
        'minutes': round(soak.sent / args.rate / 60.0, 2),
        'rate_hz': args.rate,
        'sent': soak.sent,
        'cores': args.cores,
        'nodes': nodes,
        'health': health,
        'recorded': lost,
        'cpu_share_total': round(sum(node['cpu_share'] for node in nodes.values()), 3),
    }
    return {'passed': verdict(result, FLAT), **result}


def table(result: dict[str, Any]) -> str:
    """Return a row for each node; what it missed is over all its inputs."""

    def missed(node: str) -> int:
        return sum(
            row.get('missing', 0)
            for name, row in result['health'].items()
            if name.partition(': ')[0].lstrip('/') == node
        )

    head = ('node', 'share of a core', 'memory', 'its slope', 'messages missed')
    return markdown.table(
        head,
        *(
            (
                name.replace('_', ' '),
                f'{100.0 * row["cpu_share"]:.0f} %',
                f'{row["rss_mib"]:.0f} MiB',
                f'{row["rss_slope_mib_per_h"]:+.1f} MiB/h',
                missed(name),
            )
            for name, row in result['nodes'].items()
        ),
    )
