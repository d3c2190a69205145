# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Live through simulated years of weekly checks, and see which changes the history finds.

Most years are drawn: how sure each diagnosis is comes from real ones. Some are simulated by the plant
and diagnosed in full. A run that was interrupted goes on where it stopped.
"""

from __future__ import annotations

from ...study import Study, options, require_simulator, study

OPTIONS = options(
    """
--seed N   decides the cells and the years [default: 26]
--years N  drawn years [default: 200]
--cells N  cells they are of [default: 12]
--full N   years diagnosed in full [default: 2]
""",
    out='directory for the results',
    of='OUT',
    pool=True,
)


@study
def run(study: Study) -> bool:
    """Run what is not done yet, write the results, print the table."""
    from ...fleet.years import GOALS, page, run_years

    require_simulator()
    args = study.args
    with study.runner('living through years') as runner:
        result = run_years(args.seed, args.years, args.cells, args.full, runner)
    study.write('years', result, page(result, args.seed, args.cells))
    kept = {name: result['drawn'][name] for name in GOALS}
    return all(
        value is not None and GOALS[name][0] <= value <= GOALS[name][1]
        for name, value in kept.items()
    )
