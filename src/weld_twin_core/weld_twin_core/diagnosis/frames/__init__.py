# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Base and tool frames, which an instrument may put anywhere."""
