# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Message packages of other people, built from their definitions where they are not installed."""
