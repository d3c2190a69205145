# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Logs of abb_libegm: joints of the robot, in degrees, by milliseconds."""

from ..formats import Format, form

form(
    Format(
        'EGM of ABB (abb_libegm)',
        r'\ATIMESTAMP,R_FB_POS_RJ1,',
        r'^TIMESTAMP,',
        ((r'^TIMESTAMP$', 'time [ms]'), (r'^R_FB_POS_RJ(\d)$', r'J\1 [deg]')),
    )
)
