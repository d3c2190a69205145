# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""`plan-measurement`: what it says, and what it writes."""

from __future__ import annotations

import csv
import re

import numpy as np
import pytest

from weld_twin_core.arm import catalog
from weld_twin_msgs_py.files.joint_file import read_joint_motion

ROBOT = catalog.load('kuka_kr6_r900')
WORDS = ('investigate', '--robot', 'kuka_kr6_r900', '--tolerance', 0.3)


def test_it_writes_stations_a_table_and_a_program_of_the_same_postures(weld_twin, tmp_path):
    out = tmp_path / 'plan'
    result = weld_twin(*WORDS, '--minutes', 9, '--controller', 'krl', '--out', out)
    assert result.code == 0, result.err
    count = int(re.search(r'^(\d+) poses, \d+ minutes', result.out, re.M)[1])
    _, q, stations = read_joint_motion(out / 'stations.yaml', ROBOT)
    assert stations and len(q) == count
    with open(out / 'measurements.csv', newline='') as file:
        rows = list(csv.reader(file))
    assert rows[0][-3:] == ['x [mm]', 'y [mm]', 'z [mm]']
    shown = np.array([[float(cell) for cell in row[1:7]] for row in rows[1:]])
    np.testing.assert_allclose(np.radians(shown), q, atol=1e-6)
    axes = re.findall(r'PTP \{A1 ([-\d.]+),', (out / 'measure.src').read_text())
    np.testing.assert_allclose(np.array(axes, float), shown[:, 0], atol=1e-4)


def test_a_tolerance_out_of_reach_is_told(weld_twin):
    result = weld_twin(*WORDS[:3], '--tolerance', 0.02, '--minutes', 6, '--noise', 0.1)
    assert result.code == 0, result.err
    assert re.search(r'all \d+ poses that fit into the time keep 0.02 mm at \d+%', result.out)


@pytest.mark.parametrize(
    ('words', 'said'),
    [
        (('--minutes', 2), '24 are the fewest; give more time or shorter stations'),
        (('--minutes', 9, '--controller', 'krl'), 'say with --out where'),
        (('--minutes', 9, '--controller', 'basic'), "there is no language 'basic'; known are"),
        (('--minutes', 9, '--noise', -1), 'a tolerance, a noise and a spread above zero'),
        (('--minutes', 20_000), '--minutes at most 10000'),
    ],
)
def test_what_cannot_be_planned_is_one_sentence(weld_twin, words, said):
    result = weld_twin(*WORDS, *words)
    assert result.code == 2
    assert said in result.err
    assert len(result.err.splitlines()) == 1
