# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Make the made-up diagnoses importable."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
