# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Commands run for others, each in a process of its own within bounds of memory and time."""

from .command import Guarded, Limits, Outcome

__all__ = ['Guarded', 'Limits', 'Outcome']
