# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Look into a bag, make a damaged one whole, play it.

'weld-twin bag BAG' alone tells what is in it.
"""

JOBS = ('info', 'recover', 'play')
USUAL = 'info'
"""The job that is meant where none is named."""
EXAMPLE = 'weld-twin bag bags/elbow_play'
