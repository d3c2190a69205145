# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Every check of the data by name, in the order in which they are made."""

from __future__ import annotations

from .computed import computed, source
from .efforts import efforts
from .evidence import Checker
from .images import images
from .mixups import mixups
from .orientation import gravity, orientation
from .parted import parted
from .repeats import outliers, repeats
from .richness import motion, quantity
from .setup_change import setup
from .stamp_regularity import clocks, stamps
from .stuck import stuck

CHECKS: dict[str, tuple[Checker, str]] = {
    'quantity': (quantity, 'There is enough to work on.'),
    'readings': (stuck, 'No reading stands still while the tool moves.'),
    'tools': (parted, 'No recording has another tool than the first.'),
    'images': (images, 'No camera measured.'),
    'units, signs, joints, robot': (mixups, 'Joints, positions and robot belong together.'),
    'gravity': (gravity, 'Gravity pulls down where the base stands.'),
    'efforts': (efforts, 'No measured effort of the joints is used.'),
    'orientation': (orientation, 'Orientations turn as the joints say.'),
    'instrument': (computed, 'The poses have the noise of an instrument.'),
    'clocks': (clocks, 'Joint and measurement stamps belong to one clock.'),
    'stamps': (stamps, 'Stamps come regularly and without gaps.'),
    'repeats': (repeats, 'Nothing was recorded twice.'),
    'source of the joints': (source, 'Joint positions are not plainly those of a command.'),
    'motion': (motion, 'Every joint moves, both ways, and the frames can be told apart.'),
    'outliers': (outliers, 'No single reading stands out from its neighbours.'),
    'set-up': (setup, 'The set-up did not move while it was measured.'),
}
"""Every check by name: the function, and what it says when it finds nothing."""
