# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How the tool is to travel: seams, time laws, and the joint motion that follows them."""
