# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the README promises exists and runs."""

import io
import json
import re
import shlex
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.arm import catalog
from weld_twin_msgs_py.bags import read_recording
from weld_twin_msgs_py.files.effects_file import read_effects
from weld_twin_msgs_py.robots import load_robot
from weld_twin_nodes.cli import main

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / 'README.md').read_text()


def documents():
    own = ('README.md', 'CONTRIBUTING.md', 'bags/README.md')
    return [*(ROOT / name for name in own), *ROOT.glob('src/*/README.md'), *ROOT.glob('docs/*.md')]


def example(line):
    """Return the Python example of the README that has a line."""
    return next(code for code in re.findall(r'```python\n(.*?)```', TEXT, re.S) if line in code)


def run(code):
    """Run an example and return its names."""
    names = {}
    exec(compile(code, 'README.md', 'exec'), names)
    return names


@pytest.mark.parametrize('document', documents(), ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_somewhere(document):
    links = re.findall(r'\]\((?!http)([^)#]+)\)', document.read_text())
    assert [link for link in links if not (document.parent / link).exists()] == []


TABLE = TEXT.partition('| command | does |')[2].partition('\n\n')[0]
ROWS = [shlex.split(text)[1:] for text in re.findall(r'^\| `(weld-twin [^`]+)`', TABLE, re.M)]
ELSEWHERE = ('demo', 'serve', 'sensitivity', 'lab')
"""Rows that take minutes or go on for ever; their commands have tests of their own."""


@pytest.fixture(scope='module')
def rows_run(tmp_path_factory):
    """Run the rows of the table in their order, in a fresh folder; return it and what they said."""
    folder = tmp_path_factory.mktemp('readme')
    for name in ('bags', 'examples'):
        (folder / name).symlink_to(ROOT / name)
    said = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setenv('XDG_DATA_HOME', str(folder / 'home'))
        for words in ROWS:
            if words[0] not in ELSEWHERE:
                out = io.StringIO()
                with redirect_stdout(out), redirect_stderr(out):
                    code = main(words)
                said[' '.join(words)] = (code, out.getvalue())
    return folder, said


def test_every_row_of_the_table_runs_after_those_above_it(rows_run):
    _, said = rows_run
    assert len(said) + len(ELSEWHERE) == len(ROWS) == TABLE.count('\n| `')
    assert {row: text for row, (code, text) in said.items() if code != 0} == {}


@pytest.mark.parametrize(
    'words', [row for row in ROWS if row[0] in ELSEWHERE], ids=lambda row: row[0]
)
def test_the_rows_that_take_long_have_options_that_there_are(words, capsys):
    with pytest.raises(SystemExit):
        main([*words, '--no-such-option'])
    assert capsys.readouterr().err.endswith('unrecognized arguments: --no-such-option\n')


def test_the_example_files_are_of_the_arm_that_their_page_tells(rows_run):
    folder, said = rows_run
    found = json.loads((folder / 'found_cell/diagnosis.json').read_text())['model']['found']
    assert [(e['effect'], e['joint']) for e in found] == [('joint_offset', 'elbow_joint')]
    assert found[0]['offset'] == pytest.approx(1.2e-3, abs=3e-5)
    better = next(text for row, (_, text) in said.items() if row.startswith('correct '))
    before, after = map(float, re.findall(r'([\d.]+) mm RMS', better))
    assert after < 0.5 * before


def test_the_ten_lines_of_python_draw_and_find_the_play(monkeypatch, capsys):
    monkeypatch.setenv('MPLBACKEND', 'Agg')
    lines = example('import weld_twin_core as wt')
    names = run(lines)
    assert names['plt'].gca().lines, 'nothing was drawn'
    assert "identified [{'effect': 'backlash', 'joint': 'elbow_joint'" in capsys.readouterr().out
    names['plt'].close('all')


def test_the_example_bag_is_what_its_readme_says(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    command = re.search(r'`(weld-twin simulate [^`]+)`', (ROOT / 'bags/README.md').read_text())[1]
    assert main(shlex.split(command.replace('--out bags/', f'--out {tmp_path}/'))[1:]) == 0
    robot = catalog.load('ur5')
    kept, made = (read_recording(f / 'elbow_play', robot) for f in (ROOT / 'bags', tmp_path))
    np.testing.assert_allclose(made.joints.q, kept.joints.q, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(made.measured.position, kept.measured.position, rtol=0.0, atol=1e-9)


def test_no_page_that_a_command_made_is_kept():
    kept = list((ROOT / 'docs').rglob('*.html'))
    assert kept == [], 'keep the data; the build of the documentation makes the pages'


def test_the_files_that_contributing_names_exist():
    table = (ROOT / 'CONTRIBUTING.md').read_text().partition('## Rules')[0]
    rows = [line for line in table.splitlines() if line.startswith('| ')][2:]
    assert len(rows) >= 10
    missing = []
    for row in rows:
        packages = re.findall(r'\b(core|msgs_py|nodes|report|lab)\b', row)
        inside = [ROOT / f'src/weld_twin_{package}' for package in packages]
        lab = ROOT / 'src/weld_twin_lab/weld_twin_lab'
        room = ''
        for path in re.findall(r'`([\w/]+\.(?:py|md|toml))`', row):
            room = path.rpartition('/')[0] or room
            name = path.replace('NAME', '__init__') if path.endswith('.py') else path
            places = [ROOT, *inside, lab, *(own / own.name for own in inside)]
            places += [own / own.name / room for own in inside]
            if 'NAME.md' not in name and not any((place / name).exists() for place in places):
                missing.append(path)
    assert missing == []


def test_the_reference_has_every_public_name():
    pages = ''.join(path.read_text() for path in (ROOT / 'docs/reference').glob('*.md'))
    rooms = {'catalog': 'arm.catalog', 'paths': 'motion.paths', 'profiles': 'motion.profiles'}
    rooms |= {'rotation': 'arm.rotation'}
    rooms |= {name: 'errors' for name in wt.__all__ if name.endswith('Error')}
    missing = [
        name
        for name in wt.__all__
        if not re.search(rf'weld_twin_core\.(\w+\.)*{rooms.get(name, name)}$', pages, re.M)
    ]
    assert missing == []


def test_the_chain_of_the_readme_leads_to_the_robot_as_it_is(rows_run):
    """Simulate, diagnose and predict as written; the corrected twin moves as the one simulated."""
    folder, _ = rows_run
    robot = catalog.load('ur5')
    found = read_recording(folder / 'corrected', robot)
    true = wt.effects_from_list(
        [{'effect': 'backlash', 'joint': 'elbow_joint', 'width': 5e-4}], robot
    )
    known = load_robot(str(folder / 'found/robot.yaml'))
    left = read_effects(folder / 'found/robot_effects.yaml', known)
    ends = np.random.default_rng(3).uniform(-2.0, 2.0, (2, robot.n))
    anywhere = wt.Recording('anywhere', wt.JointMotion(np.arange(40.0), np.linspace(*ends, 40)))
    for recording in (found, anywhere):
        real, corrected = (
            wt.Twin(*each).poses(recording, recording.joints.t).position
            for each in ((robot, true), (known, left))
        )
        assert np.linalg.norm(real - corrected, axis=1).max() < 3e-5
