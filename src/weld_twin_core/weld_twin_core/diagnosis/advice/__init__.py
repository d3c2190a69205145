# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What to do next: mend what was found, or measure what would decide."""

from .actions import actions
from .experiment import next_experiment
from .postures import Limits

__all__ = ['Limits', 'actions', 'next_experiment']
