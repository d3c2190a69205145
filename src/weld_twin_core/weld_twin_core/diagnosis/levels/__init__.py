# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is certain of each cause, level by level: its place, what it depends on, and its name."""
