# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How sure the fitted model is of a pose: what the data leave open, and what they leave over."""
