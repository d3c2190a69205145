# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Exports of Nexus and Tracker: trajectories of markers, with the rate above."""

from ..formats import Format, form

form(
    Format(
        'Nexus or Tracker of Vicon',
        r'\A"?Trajectories"?[,;]*\r?\n',
        r'^Frame[,;]Sub Frame',
        ((r'^(?P<what>\S+) (?P<axis>[XYZ])$', r'\g<axis> [{unit}]'), (r'^Frame$', 'frame')),
        above=1,
        below=1,
        unit=r'^[,;]+(mm|m)\b',
        rate=r'\A"?Trajectories"?[,;]*\r?\n(\d+)',
    )
)
