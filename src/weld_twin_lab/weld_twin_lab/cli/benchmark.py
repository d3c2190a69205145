# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Time the twin beside its peers, after checking that they agree.

Peers that are not installed are left out. One thread; contenders take turns, so that the ratios
hold on a busy machine too. Writes benchmark.json, a table (benchmark.md) and how the cost grows
(growth.png) to the directory.
"""

from __future__ import annotations

import argparse
import os

from weld_twin_nodes.cli.options import add_output, output
from weld_twin_nodes.offline.environment import THREADS

ONE_THREAD = {
    **dict.fromkeys(THREADS, '1'),
    'XLA_FLAGS': '--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1',
    'JAX_PLATFORMS': 'cpu',
}
"""Read by the libraries when they are imported."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add_output(parser, 'where results go')
    parser.add_argument('--quick', action='store_true', help='small sizes, to see that it runs')


def run(args: argparse.Namespace) -> int:
    """Run the benchmark; print results as they come."""
    os.environ.update(ONE_THREAD)

    from ..benchmark.all_races import FULL, QUICK, benchmark

    with output(args, 'benchmark.json') as folder:
        benchmark(folder, QUICK if args.quick else FULL, lambda line: print(line, flush=True))
    return 0
