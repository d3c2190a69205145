# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Exports of QTM: markers by frames; three zeros are a gap."""

from ..formats import Format, form

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
