# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The last step of the paper's workflow: which error matters most on this seam."""

from __future__ import annotations

import json

from weld_twin_core.sensitivity import default_tolerances, local_sensitivity, study_of_plan
from weld_twin_msgs_py.files.whole_files import write_text

from .hand_over import Job

FAMILIES = ('joint_offset', 'link_length', 'link_twist', 'backlash', 'base_pose')
NAMED = 3
"""Parameters that the demo names."""


def rank(job: Job, _: object) -> None:
    """Write ``sensitivity.json`` and name the parameters that move the tool most."""
    study = study_of_plan(job.robot, job.plan)
    result = local_sensitivity(study, default_tolerances(job.robot, FAMILIES)).as_dict()
    write_text(job.folder / 'sensitivity.json', json.dumps(result, indent=1) + '\n')
    leaders = ', '.join(
        f'{row["name"]} {row["contribution_m"] * 1e3:.2f} mm'
        for row in result['parameters'][:NAMED]
    )
    job.lines.append(f'matters   at typical tolerances {leaders}')
