# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Are causes told in whole cells, and from pixels, as on one arm under a tracker?

Sealed cells of the plant: an arm, one on a track beside a positioner, two arms; then stations
seen by two cameras and by a tracker. With --data, a real arm is told from its pixels and judged by a
tracker. Writes cells.json and cells.md; a run that was interrupted goes on where it stopped.
"""

from __future__ import annotations

from ...study import Study, head, options, require_simulator, study

OPTIONS = options(
    """
--cells N    sealed cells of every kind [default: 14]
--cameras N  sealed arms before cameras [default: 40]
--seed N     the first that is drawn [default: 0]
--data DIR   published recordings: holds motoman_left
""",
    pool=True,
)


@study
def run(study: Study) -> bool:
    """Run what is not done yet, write the result, print the table."""
    from weld_twin_nodes.offline.task_pool import Task

    from ...cells.case import beside_a_camera, sealed
    from ...cells.drawn import KINDS
    from ...cells.real_pixels import PARTS, part
    from ...cells.table import AS_TRACKED, named_as_tracked, page

    require_simulator()
    args = study.args
    seeds = range(args.seed, args.seed + args.cells)
    kinds = [Task(sealed, (kind, seed), kind) for seed in seeds for kind in KINDS]
    cameras = range(args.seed, args.seed + args.cameras)
    beside = [Task(beside_a_camera, (seed,), 'camera') for seed in cameras]
    parts = [Task(part, (args.data, k), 'pixels') for k in range(PARTS * bool(args.data))]
    with study.runner('telling whole cells') as runner:
        cells, pixels, real = (runner.run(tasks) for tasks in (kinds, beside, parts))
    content = head('cells/1', seed=args.seed, cells=cells, pixels=pixels, real=real)
    study.write('cells', content, page(cells, pixels, real))
    return named_as_tracked(pixels) >= AS_TRACKED
