# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How published touches are read and judged, on touches of an arm that is exact."""

import numpy as np
import pytest

from weld_twin_core.diagnosis.frames.aligned import aligned
from weld_twin_lab.contacts.data import places_of, robot_of, touches
from weld_twin_lab.contacts.splits import judge
from weld_twin_lab.contacts.table import summary, table
from weld_twin_lab.contacts.touching import postures_at

PLACES = {'front': [0.5, 0.0, 0.2], 'left': [0.0, 0.5, 0.4]}
EACH = 6


@pytest.fixture(scope='module')
def data(tmp_path_factory):
    """Return a directory with touches of an exact arm, sockets 50 mm apart."""
    folder, rng = tmp_path_factory.mktemp('data'), np.random.default_rng(2)
    robot = robot_of(folder, 'kuka_14')
    for place, point in PLACES.items():
        (folder / 'kuka_14' / place).mkdir(parents=True)
        for socket in (0, 1):
            target = np.array(point) + [0.0, 0.05 * socket, 0.0]
            q = postures_at(robot, target, EACH, rng)
            np.savetxt(folder / 'kuka_14' / place / f'hole_{socket}.csv', q, delimiter=',')
    return folder


def test_touches_of_an_exact_arm_do_not_scatter(data):
    assert places_of(data, 'kuka_14') == ('front', 'left')
    recording = touches(data, 'kuka_14', ['left'])
    assert recording.contacts.labels == ('left/0',) * EACH + ('left/1',) * EACH
    _, model = aligned(recording, robot_of(data, 'kuka_14'), '', ())
    found = judge('left', model, model, recording)
    assert max(found.before_m, found.after_m, found.each_axis_m) < 1e-8
    assert found.distance_m == pytest.approx(0.05, abs=1e-8)


def test_the_table_counts_what_got_worse():
    entries = [entry('front', 5e-4, 2e-4), entry('left', 3e-4, 4e-4)]
    (row,) = summary(entries)
    assert row['before_m'] == pytest.approx(4e-4)
    assert row['after_m'] == pytest.approx(3e-4)
    assert row['worse_than_nominal'] == ['left']
    assert '| kuka_14 | left | 0.300 | 0.400 | 0.200 | 50.02 | 0.250 | unknown |' in table(entries)


def entry(place, before, after):
    """Return a split that left a place out."""
    judged = {'place': place, 'before_m': before, 'after_m': after, 'each_axis_m': after / 2}
    return {
        'kind': 'without',
        'arm': 'kuka_14',
        'judged': [judged | {'distance_m': 0.05002}],
        'flagged': [],
        'told_held_out_m': 2.5e-4,
        'status': 'unknown',
        'seconds': 3.0,
    }
