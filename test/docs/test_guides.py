# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Pages of guides run as they stand, and results that are kept say how they came about."""

import csv
import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from weld_twin_core.arm import catalog
from weld_twin_nodes.cli import main
from weld_twin_nodes.cli.main import parser_of, renamed
from weld_twin_nodes.offline.exports import FORMATS
from weld_twin_report.report.diagnosis_files import PAGE, RESULT

ROOT = Path(__file__).parents[2]
GUIDE = (ROOT / 'docs' / 'diagnosis.md').read_text(encoding='utf-8')


@pytest.fixture
def here(tmp_path, monkeypatch):
    (tmp_path / 'bags').symlink_to(ROOT / 'bags')
    monkeypatch.chdir(tmp_path)


def test_the_commands_run_one_after_the_other(here):
    commands = re.findall(r'^    weld-twin (.*)$', GUIDE, re.MULTILINE)
    assert len(commands) == 4
    for command in commands:
        assert main(shlex.split(command)) == 0, command


def test_the_code_runs(here, capsys):
    exec(re.search(r'```python\n(.*?)```', GUIDE, re.DOTALL)[1], {})
    assert "'status'" in capsys.readouterr().out


def test_every_file_is_told():
    for name in [PAGE, RESULT, *(name for name, _ in FORMATS.values())]:
        assert f'`{name}`' in GUIDE, name


def options_of(command, capsys):
    with pytest.raises(SystemExit):
        main([command, '--help-all'])
    return set(re.findall(r'--[a-z-]+', capsys.readouterr().out))


def test_every_option_is_told(capsys):
    own_page = options_of('import', capsys) - {'--camera', '--target', '--contacts'}
    for option in options_of('diagnose', capsys) - own_page:
        assert option in GUIDE, option


DOCS = ROOT / 'docs'
PAGES = ('ur', 'kuka', 'abb', 'fanuc', 'yaskawa')
DIAGNOSED = 'fanuc'
"""Of whose arm the table is diagnosed: the one that counts its third axis otherwise."""
MINUTES, WORDS_A_MINUTE = 5, 200
"""What a page may take to read."""
TURNED = 2.5e-3
"""How far the third joint of the arm really stands off [rad]."""


def commands(page):
    text = (DOCS / f'first_{page}.md').read_text(encoding='utf-8')
    blocks = re.findall(r'```bash\n(.*?)```', text, re.S)
    return [line for block in blocks for line in block.splitlines() if line]


def measure(table, robot, third_from_ground):
    """Fill the table in as a tracker would that stands somewhere, on an arm that is off."""
    plant = pytest.importorskip('weld_twin_lab.plant.plant', reason='needs MuJoCo')
    from weld_twin_lab.plant.exponentials import Command
    from weld_twin_lab.plant.tracker import Tracker

    with open(table, newline='') as file:
        head, *rows = csv.reader(file)
    q = np.radians([[float(cell) for cell in row[1:7]] for row in rows])
    if third_from_ground:
        q[:, 2] += q[:, 1]
    flaws = [
        {'effect': 'joint_offset', 'joint': robot.joint_names[2], 'offset': TURNED},
        {'effect': 'base_pose', 'xyz': [1.2, -0.4, 0.3], 'rotvec': [0.02, 0.01, 0.6]},
        {'effect': 'tool_pose', 'xyz': [0.08, 0.02, 0.15], 'rotvec': [0.0, 0.0, 0.0]},
    ]
    t = 1.0 + np.arange(float(len(q)))
    told = Command(t, q, static=True)
    noisy = Tracker(sigma=3e-5, orientation=False)
    seen = plant.run(robot.to_mapping(), flaws, told, noisy, np.random.default_rng(5))
    with open(table, 'w', newline='') as file:
        out = csv.writer(file)
        out.writerow(head)
        for row, place in zip(rows, seen.position, strict=True):
            out.writerow([*row[:7], *(f'{1e3 * value:.3f}' for value in place)])


@pytest.mark.parametrize('page', PAGES)
def test_a_beginner_comes_to_a_verdict(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    plan, read, ask = commands(page)
    robot = catalog.load(re.search(r'--robot (\S+)', plan)[1])
    assert main(shlex.split(plan)[1:]) == 0, capsys.readouterr().err
    measure(Path('plan/measurements.csv'), robot, third_from_ground=page == 'fanuc')
    assert main(shlex.split(read)[1:]) == 0, capsys.readouterr().err
    if page != DIAGNOSED:
        parser_of(shlex.split(ask)[1:]).parse_args(shlex.split(ask)[1:])
        return
    assert main(shlex.split(ask)[1:]) == 0, capsys.readouterr().out
    found = json.loads(Path('found/diagnosis.json').read_text())
    alike = [site for group in found['verdict']['indistinguishable'] for site in group]
    named = [(e['effect'], e['joint']) for e in found['verdict']['effects'] + alike]
    assert ('joint_offset', robot.joint_names[2]) in named, named
    assert found['shrink']['rms_after_m'] < 2e-4


@pytest.mark.parametrize('page', PAGES)
def test_a_page_is_three_commands_and_five_minutes(page):
    text = (DOCS / f'first_{page}.md').read_text(encoding='utf-8')
    assert len(commands(page)) <= 3
    assert len(text.split()) <= MINUTES * WORDS_A_MINUTE


RESULTS = Path(__file__).parents[2] / 'docs/results'
LARGE, ALL = 100_000, 2_200_000
"""Bytes of the largest file that is kept, and of all, but for what is learned from."""
LEARNED = 'belief/cases.jsonl.gz'
"""The statements that the calibration is learned from; the only file that is larger."""
MADE = (RESULTS / 'SHA256SUMS').read_text(encoding='utf-8')


def test_what_is_kept_is_small():
    sizes = {
        str(file.relative_to(RESULTS)): file.stat().st_size
        for file in RESULTS.rglob('*')
        if file.is_file()
    }
    assert sizes.pop(LEARNED)
    assert [name for name, size in sizes.items() if size > LARGE] == []
    assert sum(sizes.values()) < ALL


def test_what_is_not_kept_has_a_digest_and_stands_below_its_command():
    blocks = MADE.strip().split('\n\n')[1:]
    for block in blocks:
        assert re.fullmatch(
            r'# weld-twin .+ --out OUT\n(# engine [0-9a-f]{64}\n)?([0-9a-f]{64}  \S+\n?)+', block
        ), block
        for name in re.findall(r'^[0-9a-f]{64}  (\S+)$', block, re.M):
            assert not (RESULTS / name).exists() and (RESULTS / name).parent.is_dir()


@pytest.mark.parametrize('command', sorted(set(re.findall(r'^# weld-twin (.+)$', MADE, re.M))))
def test_the_command_of_what_is_not_kept_can_be_typed(command):
    typed = renamed(shlex.split(command))
    assert parser_of(typed).parse_args(typed).out == 'OUT'
