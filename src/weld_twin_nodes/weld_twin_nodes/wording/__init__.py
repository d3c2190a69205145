# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A diagnosis in plain sentences and figures: what nodes, pages and the terminal say of it."""
