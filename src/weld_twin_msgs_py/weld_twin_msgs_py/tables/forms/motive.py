# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Exports of Motive: markers and rigid bodies, with a header of several lines."""

from ..formats import Format, form

_MOTIVE = r'^(?:Rigid Body|Marker|Rigid Body Marker) (?P<what>.+?)(?: [0-9A-F]{6,}| \d+)?'
form(
    Format(
        'Motive of OptiTrack',
        r'\AFormat Version,',
        r'^Frame,Time',
        (
            (r'Time \(Seconds\)$', 'time [s]'),
            (_MOTIVE + r' Position (?P<axis>[XYZ])$', r'\g<axis> [{unit}]'),
            (_MOTIVE + r' Rotation (?P<axis>[XYZW])$', r'q\g<axis>'),
        ),
        above=4,
        unit=r'Length Units,(\w+)',
    )
)
