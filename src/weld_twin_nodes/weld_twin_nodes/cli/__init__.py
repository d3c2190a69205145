# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line: one module or folder of `commands` for each command."""

from .main import main

__all__ = ['main']
