# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The paper's claims: what is measured on each robot and seam, and what that says of each."""

from .claim_case import Case
from .every_measure import measure_case
from .judgement import CaseName, Claim, judge

__all__ = ['Case', 'CaseName', 'Claim', 'judge', 'measure_case']
