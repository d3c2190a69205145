# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How sure the live twin is, over DDS."""

import json

import numpy as np
import pytest

from weld_twin_core.arm.chain import forward
from weld_twin_core.twin.directions import Directions, Discrepancy
from weld_twin_core.twin.domain import Domain
from weld_twin_core.twin.posterior import Posterior, as_dict
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.topics import TWIN_COVARIANCE, TWIN_POSE
from weld_twin_nodes.harness.cell import HealthListener
from weld_twin_nodes.live.forward_kinematics_twin import ForwardKinematicsTwin

pytestmark = pytest.mark.cells

S = 1_000_000_000
Q = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
TURN = 1e-3
"""Standard deviation of the base's turn about z in the model [rad]."""


@pytest.fixture
def model(robot, tmp_path):
    """A model whose base may be turned about z, measured within a tenth of Q."""
    covariance = np.zeros((6, 6))
    covariance[5, 5] = TURN**2
    posterior = Posterior(
        Directions(('base',), 1, ()),
        np.zeros(6),
        covariance,
        Discrepancy(0.0, 0.0, np.zeros(6), np.zeros(6), 0.1),
        Domain(
            robot.joint_names, tuple(((q - 0.1, q + 0.1),) for q in Q), (0.02,) * 6, (True,) * 6
        ),
    )
    content = {
        'schema': 'weld_twin/diagnosis/1',
        'model': {
            'tool': robot.T_flange_tool.tolist(),
            'bases': [robot.T_world_base.tolist()],
            'known': [],
            'found': [],
        },
        'posterior': as_dict(posterior),
    }
    path = tmp_path / 'diagnosis.json'
    path.write_text(json.dumps(content))
    return path


def stand_at(cell, robot, tap, q, start):
    """Publish one posture again and again until poses come back."""
    publisher, count = stand_at.publishers.setdefault(cell, cell.publisher()), [start]
    wanted = len(tap) + 3

    def told():
        count[0] += S // 5
        publisher.publish(cell.messages.joint_state(count[0], robot.joint_names, q))
        return len(tap) >= wanted

    cell.wait(told, 'poses with covariance')
    return count[0]


stand_at.publishers = {}


def test_the_live_twin_tells_its_covariance_and_where_it_knows_nothing(cell, robot, model):
    cell.add(ForwardKinematicsTwin, model=str(model), reliable_inputs=True)
    health = HealthListener(cell.node)
    poses, sure = cell.collect(TWIN_POSE.name), cell.collect(TWIN_COVARIANCE.name)
    now = stand_at(cell, robot, sure, Q, 0)
    message, pose = sure.last, forward(robot, Q)
    stamps = [(m.header.stamp.sec, m.header.stamp.nanosec) for m in (message, poses.last)]
    assert stamps[0] == stamps[1]
    p = message.pose.pose.position
    np.testing.assert_allclose([p.x, p.y, p.z], pose[:3, 3], rtol=0.0, atol=1e-12)
    x, y = pose[:2, 3]
    got = np.reshape(message.pose.covariance, (6, 6))
    lever = TURN * np.array([-y, x, 0.0, 0.0, 0.0, 1.0])
    np.testing.assert_allclose(got, np.outer(lever, lever), atol=1e-16)
    cell.wait(lambda: health.of('forward_kinematics_twin'), 'health')
    assert not any('outside' in text for _, text in health.of('forward_kinematics_twin'))

    far = Q + np.array([0.0, 0.0, 0.0, 1.06, 0.0, 0.0])
    now = stand_at(cell, robot, sure, far, now)
    warning = ('warn', 'outside what was recorded: wrist_1_joint is 0.96 rad beyond')
    cell.wait(
        lambda: any(
            level == warning[0] and warning[1] in text
            for level, text in health.of('forward_kinematics_twin')
        ),
        'a warning',
    )
    stand_at(cell, robot, sure, Q, now)
    health.clear()
    cell.wait(lambda: health.told.get('/forward_kinematics_twin'), 'health again')
    last = [text for _, text in health.told['/forward_kinematics_twin']][-1]
    assert 'outside' not in last


def test_a_model_without_a_posterior_gives_poses_alone(cell, robot, model):
    content = json.loads(model.read_text())
    del content['posterior']
    model.write_text(json.dumps(content))
    cell.add(ForwardKinematicsTwin, model=str(model), reliable_inputs=True)
    poses, sure = cell.collect(TWIN_POSE.name), cell.collect(TWIN_COVARIANCE.name)
    stand_at(cell, robot, poses, Q, 0)
    np.testing.assert_allclose(
        from_messages.pose(poses.last)[0], forward(robot, Q)[:3, 3], rtol=0.0, atol=1e-12
    )
    assert len(sure) == 0
