# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What changed on one arm from diagnosis to diagnosis, and where it leads."""

from .changes import Change, Moved, Outlook, changes, outlook, reaches
from .series import ALL, Observation

__all__ = ['ALL', 'Change', 'Moved', 'Observation', 'Outlook', 'changes', 'outlook', 'reaches']
