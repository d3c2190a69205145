# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How fast the twin is, beside its peers.

A workload is one job given to several contenders. They must agree before any of them is timed;
then they take turns in one process, on one thread, so that what disturbs one disturbs all.
"""

from __future__ import annotations

import os

from weld_twin_nodes.offline.environment import THREADS

from ..study import Study


def run(study: Study) -> None:
    os.environ.update(dict.fromkeys(THREADS, '1'))  # read by libraries when they are imported

    from .all_races import FULL, QUICK, benchmark

    sizes = QUICK if study.args.quick else FULL
    with study.args.output('benchmark.json') as folder:
        benchmark(folder, sizes, lambda line: print(line, flush=True))
