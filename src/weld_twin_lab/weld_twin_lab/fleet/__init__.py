# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Many cells over many years: what changed, what it costs, what a kill leaves."""
