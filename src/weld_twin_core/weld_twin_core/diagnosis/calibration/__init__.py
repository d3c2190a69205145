# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How often statements with such evidence were right, learned on cases with known truths."""
