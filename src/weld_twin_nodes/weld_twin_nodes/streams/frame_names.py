# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Names of the frames in message headers."""

WORLD = 'world'
"""The measuring frame: measured and twin poses are given in it."""
BASE = 'base'
"""The robot's base: deviations are given in it."""
