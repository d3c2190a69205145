# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Make the made-up diagnoses importable."""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1])]
