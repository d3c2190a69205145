# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The table of answers: how the evidence is shared among all that could be at work."""
