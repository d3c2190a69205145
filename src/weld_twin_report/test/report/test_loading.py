# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is loaded before a diagnosis begins: everybody waits for it, every time."""

import subprocess
import sys

SLOW = ('scipy.interpolate', 'scipy.optimize', 'scipy.stats', 'scipy.spatial', 'matplotlib')
LOADED = f"""
import sys
import weld_twin_core.diagnosis, weld_twin_msgs_py.bags, weld_twin_report.report.diagnosis_files
print([name for name in {SLOW} if name in sys.modules])
"""


def test_a_diagnosis_loads_nothing_slow_that_it_does_not_use():
    said = subprocess.run(
        [sys.executable, '-c', LOADED], capture_output=True, text=True, check=True
    )
    assert said.stdout == '[]\n'
