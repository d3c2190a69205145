# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The same work without nodes: whole motions and recordings at once."""
