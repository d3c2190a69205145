# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A diagnosis as people read it: one self-contained page, and a summary for the terminal."""

from .diagnosis_page import report_page
from .terminal import print_summary

__all__ = ['print_summary', 'report_page']
