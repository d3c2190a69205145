# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The paper's claims: what is measured on each robot and seam, and what that says of each."""

from .measures import measure_case
from .rules import CaseName, Claim, judge

__all__ = ['CaseName', 'Claim', 'judge', 'measure_case']
