# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How published touches are read and judged, on touches of an arm that is exact."""

import numpy as np
import pytest

from weld_twin_core.diagnosis.frames.aligned import aligned
from weld_twin_lab.coverage.touched import postures_at
from weld_twin_lab.real_arms.sources import places_of, socket_robot, touches

PLACES = {'front': [0.5, 0.0, 0.2], 'left': [0.0, 0.5, 0.4]}
EACH = 6


@pytest.fixture(scope='module')
def data(tmp_path_factory):
    """Return a directory with touches of an exact arm, sockets 50 mm apart."""
    folder, rng = tmp_path_factory.mktemp('data'), np.random.default_rng(2)
    robot = socket_robot(folder, 'kuka_14')
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
    _, model = aligned(recording, socket_robot(data, 'kuka_14'), '', ())
    points = model.twin(0).poses(recording, recording.joints.t).position.reshape(2, EACH, 3)
    assert np.ptp(points, axis=1).max() < 1e-8
    assert np.linalg.norm(points[0, 0] - points[1, 0]) == pytest.approx(0.05, abs=1e-8)
