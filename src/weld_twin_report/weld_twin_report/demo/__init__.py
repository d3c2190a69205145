# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole job on an embedded example, one step after the other; see `steps`."""

from .analysis import Job, Step
from .steps import STEPS, run_demo

__all__ = ['STEPS', 'Job', 'Step', 'run_demo']
