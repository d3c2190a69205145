# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The plant shares nothing with the twin that diagnoses it."""

import subprocess
import sys
from pathlib import Path

import weld_twin_lab.plant as plant

FOLDER = Path(plant.__file__).parent


def test_no_twin_is_imported():
    code = (
        'import sys, weld_twin_lab.plant; twin = ("weld_twin_core", "weld_twin_msgs"); '
        'print([name for name in sys.modules if name.startswith(twin)])'
    )
    out = subprocess.run(
        [sys.executable, '-c', code],
        capture_output=True,
        text=True,
        check=True,
        cwd=FOLDER.parent.parent,
    )
    assert out.stdout.strip() == '[]'


def test_no_twin_is_named():
    for file in FOLDER.glob('*.py'):
        assert 'weld_twin_core' not in file.read_text(encoding='utf-8'), file.name
