# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Make the robots and motions of `plant_cells` importable under any of pytest's import modes."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
