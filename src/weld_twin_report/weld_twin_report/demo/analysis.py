# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The offline part: the bag read again and set against the twin."""

from __future__ import annotations

import numpy as np

from weld_twin_core.errors import DataError
from weld_twin_core.metrics.deviation import deviation_metrics
from weld_twin_core.motion.seam_frame import seam_components
from weld_twin_core.twin.poses import Poses
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.bags import read_recording

from .hand_over import Job


def analyse(job: Job, _: object) -> None:
    """Fill in the recording, its deviations from the nominal twin, and their metrics."""
    job.recording = read_recording(job.bag, job.robot)
    measured = job.recording.measured
    if measured is None:
        raise DataError(f"bag '{job.bag}' holds no measurements")
    expected = Twin(job.robot).poses(job.recording, measured.t)
    actual = expected if measured.rotation is None else Poses(measured.position, measured.rotation)
    job.deviation = measured.position - expected.position
    # The plan's stamps are those of the joint states, so each measurement finds its place on
    # the seam by time.
    place = np.searchsorted(job.plan.motion.t, measured.t - 1e-9).clip(max=len(job.plan.s) - 1)
    tangent, normal = job.plan.seam.tangent[place], job.plan.seam.normal[place]
    job.seam_deviation = seam_components(job.deviation, tangent, normal)
    job.metrics = deviation_metrics(
        actual,
        expected,
        t=measured.t,
        path_length_m=job.plan.length,
        tangent=tangent,
        normal=normal,
    )
