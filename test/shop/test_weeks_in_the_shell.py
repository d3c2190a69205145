# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Two weeks of a shop in the shell: plan, fill in, import, diagnose, keep; what people add stays."""

import csv
import json

import numpy as np
import pytest
from command_line import done, weld_twin
from diagnosis_cells import all_but

from weld_twin_core.arm import catalog
from weld_twin_lab.programs.plain import tool_pose

ROBOT = 'kuka_kr6_r900'
MODEL = catalog.load(ROBOT)
JOINT = 2
"""Whose zero is off; counted from 0."""
WEEKS = (0.8e-3, 1.4e-3)
"""Its error in the first week and in the second [rad]."""
INSTRUMENT = (
    np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    np.array([2.0, 1.0, 0.3]),
)
"""How the instrument stands: turn and place [m]."""
REFLECTOR = np.eye(4)
REFLECTOR[:3, 3] = 0.05, 0.0, 0.12
NOTES = {'notes.txt': 'torch changed on Monday', 'photos/cell.jpg': 'picture'}


def fill_in(table, error, rng):
    """Do what the operator does: drive to every station, measure, write it down."""
    with open(table, newline='', encoding='utf-8') as file:
        head, *rows = csv.reader(file)
    for row in rows:
        q = np.radians([float(cell) for cell in row[1:7]])
        q[JOINT] += error
        turn, place = INSTRUMENT
        seen = (turn @ tool_pose(MODEL, q, REFLECTOR)[:3, 3] + place) * 1e3 + rng.normal(
            scale=0.02, size=3
        )
        row[-3:] = [f'{value:.4f}' for value in seen]
    with open(table, 'w', newline='', encoding='utf-8') as file:
        csv.writer(file, lineterminator='\n').writerows([head, *rows])


def plan(place, *more):
    words = ('--tolerance', 0.3, '--minutes', 9, '--controller', 'krl', '--out', place / 'plan')
    return weld_twin('investigate', '--robot', ROBOT, *words, *more)


def week(place, number, error, rng):
    """Fill in the table, import and diagnose; return what was found."""
    fill_in(place / 'plan/measurements.csv', error, rng)
    bag = place / f'week_{number}'
    done('import', place / 'plan/measurements.csv', '--robot', ROBOT, '--out', bag)
    words = ('--align', 'base,tool', '--exclude-effect', *all_but('joint_offset'))
    done('diagnose', bag, '--robot', ROBOT, *words, '--out', place / 'found')
    found = json.loads((place / 'found/diagnosis.json').read_text())
    effect = found['verdict']['effects'][0]  # the strongest
    assert effect['effect'] == 'joint_offset'
    assert effect['joint'] == MODEL.joint_names[JOINT]
    return effect['parameters']['offset']


def put_beside(folder):
    for name, text in NOTES.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)


def beside(folder):
    return {name: (folder / name).read_text() for name in NOTES}


@pytest.fixture(scope='module')
def weeks(tmp_path_factory):
    """Return the shop's folder after the first week, and what draws the noise of the second."""
    place, rng = tmp_path_factory.mktemp('shop'), np.random.default_rng(11)
    assert plan(place).code == 0
    put_beside(place / 'plan')
    assert week(place, 1, WEEKS[0], rng) == pytest.approx(WEEKS[0], abs=1.5e-4)
    put_beside(place / 'found')
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
    # No command has left scratch.
    assert {path.name for path in place.iterdir()} == {'plan', 'week_1', 'week_2', 'found'}
