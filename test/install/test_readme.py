# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the README promises exists and runs."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from weld_twin_core.arm import catalog
from weld_twin_msgs_py.bags import read_recording
from weld_twin_nodes.cli import main

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / 'README.md').read_text()
COMMANDS = re.findall(r'`(weld-twin [^`]+)`', TEXT)


def documents():
    return [ROOT / name for name in ('README.md', 'CONTRIBUTING.md', 'bags/README.md')]


@pytest.mark.parametrize('document', documents(), ids=lambda path: path.name)
def test_links_lead_somewhere(document):
    links = re.findall(r'\]\((?!http)([^)#]+)\)', document.read_text())
    assert links
    assert [link for link in links if not (document.parent / link).exists()] == []


@pytest.mark.parametrize('command', [c for c in COMMANDS if c.split()[1] in ('simulate', 'info')])
def test_the_commands_run_as_written(command, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    words = shlex.split(command.replace('my_bag', str(tmp_path / 'my_bag')))
    assert main(words[1:]) == 0, capsys.readouterr().err


def test_the_harness_example_runs():
    pytest.importorskip('rclpy', reason='needs ROS 2')
    exec(compile(re.search(r'```python\n(.*?)```', TEXT, re.S)[1], 'README.md', 'exec'), {})


def test_the_example_bag_is_what_its_readme_says(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    command = re.search(r'`(weld-twin simulate [^`]+)`', (ROOT / 'bags/README.md').read_text())[1]
    assert main(shlex.split(command.replace('--out bags/', f'--out {tmp_path}/'))[1:]) == 0
    robot = catalog.load('ur5')
    kept, made = (read_recording(f / 'elbow_play', robot) for f in (ROOT / 'bags', tmp_path))
    np.testing.assert_allclose(made.joints.q, kept.joints.q, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(made.measured.position, kept.measured.position, rtol=0.0, atol=1e-9)
