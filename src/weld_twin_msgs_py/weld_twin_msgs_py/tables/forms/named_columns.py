# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Logs and exports in which a line names the columns, a row of the table each."""

from ..formats import Format, form

# Logs of the RTDE client of Universal Robots, with blanks between the columns.
_RTDE = (
    (r'^timestamp$', 'time [s]'),
    (r'^actual_q_(\d)$', r'actual_q_\1 [rad]'),
    (r'^target_q_(\d)$', r'target_q_\1 [rad]'),
)
form(Format('RTDE of Universal Robots', r'\A(?:\S+ )*actual_q_0 ', r'actual_q_0 ', _RTDE, ' '))

# Logs of abb_libegm: joints of the robot, in degrees, by milliseconds.
form(
    Format(
        'EGM of ABB (abb_libegm)',
        r'\ATIMESTAMP,R_FB_POS_RJ1,',
        r'^TIMESTAMP,',
        ((r'^TIMESTAMP$', 'time [ms]'), (r'^R_FB_POS_RJ(\d)$', r'J\1 [deg]')),
    )
)

# Exports of Motive: markers and rigid bodies, with a header of several lines.
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

# Exports of Nexus and Tracker: trajectories of markers, with the rate above.
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

# Exports of QTM: markers by frames; three zeros are a gap.
form(
    Format(
        'QTM of Qualisys',
        r'\A(?:FILE_VERSION\t.*\n)?NO_OF_FRAMES\t',
        r'^MARKER_NAMES\t',
        ((r'^(?P<what>.+) (?P<axis>[XYZ])$', r'\g<axis> [mm]'), (r'^Time$', 'time [s]')),
        '\t',
        rate=r'^FREQUENCY\t([\d.]+)',
        named_by=r'^MARKER_NAMES\t(.*)',
        gap='0 0 0',
    )
)
