# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Make, diagnose and score in one go.

The truths lie beside the cases then; nothing but the code keeps the diagnosis from reading them.
"""

from __future__ import annotations

from ...study import Study, options, study
from .draw_options import DRAW
from .make import made
from .score import diagnosed_and_scored

add_arguments = options(*DRAW, out='where everything goes', pool=True)


@study
def run(study: Study) -> None:
    """Run what is not done yet, and print the measures."""
    made(study, study.out / 'cases', study.out / 'truths')
    diagnosed_and_scored(study)
