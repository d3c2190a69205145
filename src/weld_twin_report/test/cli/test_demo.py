# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""`demo`: the whole job in one command, and what it leaves behind; nodes in the README's Python."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import refused

from weld_twin_core import Twin, catalog
from weld_twin_msgs_py.bags import provenance, read_recording

pytest.importorskip('rclpy', reason='needs ROS 2')

ROOT = Path(__file__).parents[4]
pytestmark = pytest.mark.cells


def demo(out):
    return subprocess.run(
        [sys.executable, '-m', 'weld_twin_nodes', 'demo', '--out', str(out)],
        capture_output=True,
        text=True,
        timeout=900,  # given up for lost; the demo has waits of its own
    )


@pytest.mark.slow
def test_the_demo_leaves_bag_table_and_picture_that_agree(tmp_path):
    out = tmp_path / 'out'
    result = demo(out)
    assert result.returncode == 0, result.stderr
    robot = catalog.load('ur5')
    recording = read_recording(out / 'bag', robot)
    expected = Twin(robot).poses(recording, recording.measured.t).position
    rows = np.genfromtxt(out / 'deviation.csv', delimiter=',', names=True)
    off = recording.measured.position - expected
    np.testing.assert_allclose(
        np.column_stack([rows['dx_m'], rows['dy_m'], rows['dz_m']]), off, rtol=1e-8, atol=1e-12
    )
    seam = np.column_stack([rows['along_m'], rows['across_m'], rows['normal_m']])
    np.testing.assert_allclose(
        np.linalg.norm(seam, axis=1), np.linalg.norm(off, axis=1), rtol=1e-8
    )
    assert provenance(out / 'bag')['effects'][0]['effect'] == 'backlash'
    rms = np.sqrt((off**2).sum(axis=1).mean()) * 1e3
    assert f'{rms:8.4f} mm' in (out / 'summary.txt').read_text()
    assert (out / 'seam.png').read_bytes().startswith(b'\x89PNG')
    clear, unclear = (
        json.loads((out / name / 'diagnosis.json').read_text())['verdict']
        for name in ('diagnosis', 'open')
    )
    assert clear['status'] == 'identified' and clear['confidence'] > 0.9
    assert unclear['status'] == 'ambiguous'
    said = (out / 'summary.txt').read_text().replace('\N{NO-BREAK SPACE}', ' ').splitlines()
    told = [line for line in said if line.startswith(('The gap', 'With', 'Either'))]
    assert len(told) == 4
    for page in ('README.md', 'docs/index.md', 'docs/tutorial.md'):
        text = (ROOT / page).read_text()
        missing = [line for line in told if line not in text]
        assert not missing, f'{page}: run tools/in_env python tools/demo_page.py'


def test_the_demo_does_not_replace_what_it_did_not_make(tmp_path):
    (tmp_path / 'thesis.tex').touch()
    assert 'holds something else already' in refused('demo', '--out', tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ['thesis.tex']


def test_the_harness_example_of_the_readme_runs():
    every = re.findall(r'```python\n(.*?)```', (ROOT / 'README.md').read_text(), re.DOTALL)
    (code,) = (each for each in every if 'from weld_twin_nodes.harness import Cell' in each)
    exec(compile(code, 'README.md', 'exec'), names := {})
    assert len(names['poses']) > 0
