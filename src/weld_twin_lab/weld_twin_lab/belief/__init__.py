# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How far a diagnosis can be trusted, learned from cases whose truths are known."""
