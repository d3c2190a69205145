# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The robot placed where a recording was measured, so that commands and measurements compare."""

from dataclasses import replace

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.diagnosis.frames.aligned import frames_only
from weld_twin_core.errors import DataError
from weld_twin_core.metrics.performance import measured_of, pose_cycles, stops
from weld_twin_core.recording import Recording

NUMBERS = 6
"""Of one frame."""
WANTED = 3
"""
Coordinates measured at different poses, over numbers fitted. A fit takes its share of the squared
error away: of three coordinates a number, one in three, so that accuracy looks 18 % better.
"""
ROWS = 4000
"""Measurements that frames are fitted on at most; twelve numbers need no more."""


def placed(recording: Recording, robot: Robot, align: frozenset[str]) -> tuple[Robot, list[str]]:
    """Return the robot in the frame of the measurements, and sentences that say how."""
    if not align:
        return robot, ['base and tool are where the robot file has them; nothing was fitted']
    names = ' and '.join(sorted(align))
    numbers, measured = NUMBERS * len(align), measured_of(recording)
    each = 3 if measured.rotation is None else 6
    result = stops(recording)
    seen = len(pose_cycles(result, robot)) if recording.joints.static else measured.t.size
    if each * seen < WANTED * numbers:
        raise DataError(
            f'{names} cannot be fitted on {seen} different pose{"s"[: seen > 1]}: the fit takes '
            f'{numbers} of {each * seen} measured coordinates; measure the frames and put them '
            'into the robot file, or measure more poses'
        )
    some = np.unique(np.linspace(0, measured.t.size - 1, ROWS).round().astype(int))
    model = frames_only(recording.with_measured(measured.take(some)), robot, align)
    say = (
        f'{names} {"were" if len(align) > 1 else "was"} fitted to this recording, {numbers} '
        f'numbers on {seen} poses, so that the accuracy is what is left after the best fit; the '
        'standard has the frames measured beforehand'
    )
    return replace(model.robot, T_world_base=model.bases[0]), [say]
