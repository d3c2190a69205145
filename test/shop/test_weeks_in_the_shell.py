# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Two weeks of a shop in the shell: plan, fill in, import, diagnose, keep; what people add stays."""

from __future__ import annotations

import csv
import json
import shutil
import subprocess
import sys

import numpy as np
import pytest
from own_postgres import NoServer, postgres

from weld_twin_core.arm import catalog
from weld_twin_nodes.cli.in_process import weld_twin

ROBOT = 'kuka_kr6_r900'
MODEL = catalog.load(ROBOT).to_mapping()
JOINT = 2
"""Whose zero is off; counted from 0."""
WEEKS = (0.8e-3, 1.4e-3)
"""Its error in the first week and in the second [rad]."""
INSTRUMENT = (
    np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    np.array([2.0, 1.0, 0.3]),
)
"""How the instrument stands: turn and place [m]."""
NOTES = {'notes.txt': 'torch changed on Monday', 'photos/cell.jpg': 'picture'}


def turned(axis, angle):
    c, s = np.cos(angle), np.sin(angle)
    out = np.eye(4)
    k, m = [i for i in range(3) if i != axis]
    out[[k, m], [k, m]] = c
    out[k, m], out[m, k] = (-s, s) if axis != 1 else (s, -s)
    return out


def moved(x, z):
    out = np.eye(4)
    out[:3, 3] = x, 0.0, z
    return out


def tool(q):
    """Return where the reflector is [m], by the convention's own product of four motions."""
    at = np.eye(4)
    for joint, angle in zip(MODEL['joints'], q, strict=True):
        x = moved(joint['a'], 0.0) @ turned(0, joint['alpha'])
        z = turned(2, angle + joint.get('theta_offset', 0.0)) @ moved(0.0, joint['d'])
        at = at @ (x @ z if MODEL['convention'] == 'modified' else z @ x)
    return (at @ [0.05, 0.0, 0.12, 1.0])[:3]


def fill_in(table, error, rng):
    """Do what the operator does: drive to every station, measure, write it down."""
    with open(table, newline='', encoding='utf-8') as file:
        head, *rows = csv.reader(file)
    for row in rows:
        q = np.radians([float(cell) for cell in row[1:7]])
        q[JOINT] += error
        turn, place = INSTRUMENT
        seen = (turn @ tool(q) + place) * 1e3 + rng.normal(scale=0.02, size=3)
        row[-3:] = [f'{value:.4f}' for value in seen]
    with open(table, 'w', newline='', encoding='utf-8') as file:
        csv.writer(file, lineterminator='\n').writerows([head, *rows])


def done(*words):
    said = weld_twin(*words)
    assert said.code == 0, said.err
    return said


def plan(place, *more):
    words = ('--tolerance', 0.3, '--minutes', 9, '--controller', 'krl', '--out', place / 'plan')
    return weld_twin('investigate', '--robot', ROBOT, *words, *more)


def week(place, number, error, rng):
    """Fill in the table, import and diagnose; return what was found."""
    fill_in(place / 'plan/measurements.csv', error, rng)
    bag = place / f'week_{number}'
    done('import', place / 'plan/measurements.csv', '--robot', ROBOT, '--out', bag)
    done('diagnose', bag, '--robot', ROBOT, '--align', 'base,tool', '--out', place / 'found')
    found = json.loads((place / 'found/diagnosis.json').read_text())
    effect = found['verdict']['effects'][0]  # the strongest
    assert effect['effect'] == 'joint_offset'
    assert effect['joint'] == MODEL['joints'][JOINT]['name']
    return effect['parameters']['offset']


def put_beside(folder):
    for name, text in NOTES.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)


def beside(folder):
    return {name: (folder / name).read_text() for name in NOTES}


@pytest.fixture(scope='module')
def weeks(tmp_path_factory):
    """Return the shop's folder after two weeks, and that of a laptop with the first week alone."""
    place, rng = tmp_path_factory.mktemp('shop'), np.random.default_rng(11)
    assert plan(place).code == 0
    put_beside(place / 'plan')
    assert week(place, 1, WEEKS[0], rng) == pytest.approx(WEEKS[0], abs=1.5e-4)
    put_beside(place / 'found')
    shutil.copytree(place / 'found', place / 'laptop')
    return place, rng


def test_what_was_filled_in_and_put_beside_outlives_the_second_week(weeks):
    place, rng = weeks
    table = place / 'plan/measurements.csv'
    filled = table.read_text()
    refused = plan(place)
    assert refused.code == 2 and refused.err.count('\n') == 1
    assert f"'{table}' was changed after weld-twin wrote it" in refused.err
    assert "--force, which keeps it as 'measurements.kept-1.csv'" in refused.err
    assert table.read_text() == filled
    forced = plan(place, '--force')
    assert forced.code == 0 and "kept as 'measurements.kept-1.csv'" in forced.err
    assert (place / 'plan/measurements.kept-1.csv').read_text() == filled
    assert ',,,\n' in table.read_text()  # a new one, to fill in
    assert week(place, 2, WEEKS[1], rng) == pytest.approx(WEEKS[1], abs=1.5e-4)
    for folder in ('plan', 'found'):
        assert beside(place / folder) == NOTES
    # No command has seen the laptop's folder, and none has left scratch.
    assert {path.name for path in place.iterdir()} == {
        'plan',
        'week_1',
        'week_2',
        'found',
        'laptop',
    }


def test_two_machines_keep_their_diagnoses_in_one_new_database_at_once(weeks):
    pytest.importorskip('sqlalchemy', reason='the history is an extra')
    pytest.importorskip('psycopg', reason='PostgreSQL needs its driver')
    place, _ = weeks
    try:
        with postgres() as url:
            machines = [
                subprocess.Popen(
                    [sys.executable, '-m', 'weld_twin_nodes', 'history', 'add', str(place / folder),
                     '--cell', 'line 3', '--at', at, '--db', url],
                    stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                )
                for folder, at in (('laptop', '2026-03-02'), ('found', '2026-03-09'))
            ]  # fmt: skip
            for machine in machines:
                out, err = machine.communicate(timeout=120.0)
                assert machine.returncode == 0, err
                assert out.endswith('added\n')
            shown = done('history', 'show', '--cell', 'line 3', '--db', url).out
    except NoServer as error:
        pytest.skip(str(error))
    assert shown.count('2026-03-02') == shown.count('2026-03-09') == 1
