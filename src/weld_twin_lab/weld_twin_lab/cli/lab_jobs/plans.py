# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Plans of a first measurement, carried out by the plant: is an arm as sure as its plan said?

Writes plans.json; a run that was interrupted goes on where it stopped.
"""

from __future__ import annotations

from ...study import Study, option, options, study

add_arguments = options(option('--plans', 24, 'N', 'how many (24)'))


@study
def run(study: Study) -> None:
    """Carry the plans out and print what came of them."""
    from ...coverage.planned import planned, summary

    entries = planned(study.args.plans, study.parts('parts'), study.tell)
    study.write('plans', entries)
    print(', '.join(f'{key} {value:.3g}' for key, value in summary(entries).items()))
