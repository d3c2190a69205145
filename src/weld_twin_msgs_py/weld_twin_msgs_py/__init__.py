# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages, bags and files in and out of arrays; the numbers live in weld_twin_core."""

__version__ = '0.1.0'
