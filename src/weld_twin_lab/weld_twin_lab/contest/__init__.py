# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Sealed cases in an open form, methods of whatever make that answer them, and one table of all."""
