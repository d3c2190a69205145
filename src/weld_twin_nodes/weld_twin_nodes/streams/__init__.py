# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages as they come, put together: joint states, poses paired by stamp, deviations."""
