# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What commands say and write from first to last is as it was kept.

A motion with known errors is simulated, predicted, corrected and exported by a model that was
written by hand, so that no diagnosis is asked.
"""

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest
from page_text import flat, page_text

from weld_twin_core import __version__, forward, load
from weld_twin_core.twin.directions import Directions, Discrepancy
from weld_twin_core.twin.domain import Domain
from weld_twin_core.twin.posterior import Posterior, as_dict
from weld_twin_nodes.cli.in_process import weld_twin

ROBOT = load('ur5')
NAMES = list(ROBOT.joint_names)
PROGRAM = Path(__file__).parents[4] / 'test/programs/made/bracket.script'
FOUND = [
    {'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': 6e-4},
    {'effect': 'link_length', 'joint': 'shoulder_lift_joint', 'da': 2e-4},
    {'effect': 'backlash', 'joint': 'wrist_1_joint', 'width': 4e-4},
    {'effect': 'joint_compliance', 'joint': 'shoulder_lift_joint', 'compliance': 4e-6},
]
WORDS = ('--robot', 'ur5', '--model')


@pytest.fixture
def place(tmp_path):
    """Return a folder with true errors, a model of them, and a table of stations."""
    (tmp_path / 'true.yaml').write_text(
        json.dumps([*FOUND, {'effect': 'measurement_noise', 'sigma': 2e-5}])
    )
    home = np.array([0.1, -1.4, 1.7, -1.8, -1.5, 0.1])
    ranges = tuple(((q - 0.5, q + 0.5),) for q in home)
    domain = Domain(NAMES, ranges, (0.5,) * 6, (True,) * 6, load=(60.0, 60.0))
    rest = Discrepancy(2e-5, 1e-6, np.full(6, 2e-5), np.full(6, 1e-5), 1.0)
    known = Posterior(Directions((), 1, ()), np.zeros(0), np.zeros((0, 0)), rest, domain)
    model = {'tool': ROBOT.T_flange_tool.tolist(), 'bases': [ROBOT.T_world_base.tolist()],
             'known': [], 'found': FOUND}  # fmt: skip
    content = {'schema': 'weld_twin/diagnosis/1', 'shrink': {'rms_after_m': 3e-5},
               'model': model, 'posterior': as_dict(known)}  # fmt: skip
    (tmp_path / 'model.json').write_text(json.dumps(content))
    q = home + np.random.default_rng(4).uniform(-0.8, 0.8, (20, 6))
    seen = 1e3 * forward(ROBOT, q)[:, :3, 3] + [2.0, 0.0, -1.0]
    head = ','.join([*(f'joint_{k} [deg]' for k in range(1, 7)), 'x [mm]', 'y [mm]', 'z [mm]'])
    rows = np.column_stack([np.degrees(q), seen])
    np.savetxt(tmp_path / 'table.csv', rows, '%.6f', ',', header=head, comments='')
    return tmp_path


COMMANDS = {
    'simulate': ('simulate', '--robot', 'ur5', '--effects', 'true.yaml', '--path', 'weave',
                 '--profile', 'aggressive', '--rate', 20, '--seed', 3, '--out', 'bag'),
    'bag': ('bag', 'bag'),
    'predict': ('simulate', 'bag', *WORDS, 'model.json', '--table', 'poses.csv', '--out', 'pred'),
    'correct_motion': ('correct', 'bag', *WORDS, 'model.json', '--out', 'commands'),
    'correct_program': ('correct', PROGRAM, *WORDS, 'model.json', '--tolerance', '0.3mm',
                        '--out', 'better'),
    'correct_little': ('correct', PROGRAM, *WORDS, 'model.json', '--max-correction', '0.3mm',
                       '1deg', '--out', 'little'),
    'import': ('import', 'table.csv', '--robot', 'ur5', '--table', 'off.csv', '--out', 'stations'),
    **{f'export_{form}': ('export', 'model.json', '--robot', 'ur5', '--format', form)
       for form in ('yaml', 'urdf', 'offsets', 'left-over', 'effects')},
}  # fmt: skip


def number(cell):
    """Return a cell as a number, if it is one."""
    try:
        return float(cell)
    except ValueError:
        return cell


def content(file):
    """Return what is kept of a file."""
    text = file.read_text(encoding='latin-1')
    if file.suffix == '.html':
        return page_text(text)
    if file.suffix == '.json':
        return '\n'.join(f'{at} {value}' for at, value in flat(json.loads(text), ''))
    if file.suffix == '.csv':
        rows = [
            [number(cell) for cell in row.values()] for row in csv.DictReader(text.splitlines())
        ]
        columns = dict(zip(text.splitlines()[0].split(','), zip(*rows, strict=True), strict=True))
        return '\n'.join(f'{at} {value}' for at, value in flat(columns, ''))
    return text


def test_commands_say_and_write_what_was_kept(place, kept, monkeypatch):
    monkeypatch.chdir(place)
    there = set(place.rglob('*'))
    for name, words in COMMANDS.items():
        said = weld_twin(*words)
        new = sorted(set(place.rglob('*')) - there)
        there |= set(new)
        text = [f'ends with {said.code}', said.out, said.err]
        for file in new:
            if file.suffix in ('.html', '.json', '.csv', '.script') and file.name[0] != '.':
                text += [f'--- {file.relative_to(place)}', content(file)]
        whole = re.sub(r'\b[0-9a-f]{12,}\b', 'DIGEST', '\n'.join(text)).replace(
            __version__, 'VERSION'
        )
        kept(name, whole.replace(str(PROGRAM.parent), 'made') + '\n')
