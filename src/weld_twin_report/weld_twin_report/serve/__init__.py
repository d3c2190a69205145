# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis in a browser: drop a recording, answer what is asked, read the sheet."""

from .settings import Settings

__all__ = ['Settings']
