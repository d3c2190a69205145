# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Time the twin beside its peers, after checking that they agree.

Peers that are not installed are left out. One thread; contenders take turns, so that the ratios
hold on a busy machine too. Writes benchmark.json and a table (benchmark.md) to the directory.
"""

from __future__ import annotations

import os

from weld_twin_nodes.cli.options import folder_output
from weld_twin_nodes.offline.environment import THREADS

from ...study import Study, options, study

QUICK = '--quick  small sizes, to see that it runs'
OPTIONS = options(folder_output('where results go'), QUICK, out='')


@study
def run(study: Study) -> None:
    """Run the benchmark; print results as they come."""
    os.environ.update(dict.fromkeys(THREADS, '1'))  # read by libraries when they are imported

    from ...benchmark import all_races

    sizes = all_races.QUICK if study.args.quick else all_races.FULL
    with study.args.output('benchmark.json') as folder:
        all_races.benchmark(folder, sizes, lambda line: print(line, flush=True))
