# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The measurement proposed is a file that the trajectory generator's planner runs."""

import numpy as np
import pytest
from measured_cells import asked, moving, recorded, stations

from weld_twin_core.arm import catalog
from weld_twin_core.diagnosis.advice import next_experiment
from weld_twin_core.diagnosis.algebra.problem import Scale
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.joint_file import write_joint_motion
from weld_twin_nodes.offline.seam_motion import joint_motion


@pytest.fixture(params=[(moving, 'path'), (stations, 'bidirectional')], ids=['path', 'stations'])
def proposal(request, ur5, tmp_path):
    kind, wanted = request.param
    rng = np.random.default_rng(3)
    problem, model = asked(ur5, recorded(ur5, kind(ur5, rng), rng))
    scale = Scale(2e-5, 4e-5, tuple(np.ones(m) for m in problem.samples))
    found = next_experiment(problem, model, [()], scale)
    assert found['kind'] == wanted
    path = tmp_path / 'next_experiment.yaml'
    write_joint_motion(path, found['motion'], found['sentence'])
    return found['motion'], path


def test_the_motion_passes_every_point_within_the_limits_of_the_robot(ur5, proposal):
    wanted, path = proposal
    motion = joint_motion(ur5, str(path))
    nearest = [np.abs(motion.q - q).max(axis=1).min() for q in np.array(wanted['q'])]
    # A path is sampled anew: half a step of it lies between.
    step = np.abs(np.diff(motion.q, axis=0)).max()
    assert max(nearest) < (1e-9 if wanted['static'] else 0.5 * step + 1e-3)
    rates = np.abs(np.diff(motion.q, axis=0)) / np.diff(motion.t)[:, None]
    assert (rates <= ur5.max_velocity).all()
    slopes = (motion.q[2:] - motion.q[:-2]) / (motion.t[2:] - motion.t[:-2])[:, None]
    np.testing.assert_allclose(motion.velocity[1:-1], slopes, atol=0.02)


def test_the_arm_rests_at_every_station_when_it_is_to_be_measured(ur5, tmp_path):
    q = np.array([[0.0] * 6, [0.4] * 6, [0.4] * 6, [-0.5] * 6])
    t = [0.0, 15.0, 30.0, 31.0]
    path = tmp_path / 'stations.yaml'
    names = list(ur5.joint_names)
    write_joint_motion(path, {'static': True, 'joint_names': names, 't': t, 'q': q}, 'four')
    motion = joint_motion(ur5, str(path))
    for k in range(3):
        near = np.abs(motion.t - t[k]) <= 0.9
        np.testing.assert_allclose(motion.q[near], np.tile(q[k], (near.sum(), 1)), atol=1e-12)
        assert (motion.velocity[near] == 0.0).all()
    last = motion.t > motion.t[-1] - 1.9
    np.testing.assert_allclose(motion.q[last], np.tile(q[3], (last.sum(), 1)), atol=1e-12)
    speed, hardest = (
        np.abs(motion.velocity),
        np.abs(np.gradient(motion.velocity, motion.t, axis=0)),
    )
    assert (speed <= ur5.max_velocity).all() and (hardest <= ur5.max_acceleration).all()


def test_joints_in_another_order_are_put_in_that_of_the_robot(ur5, tmp_path):
    rows = [[0.1, 0.2, 0.3, 0.4, 0.5, 0.6], [0.2, 0.3, 0.4, 0.5, 0.6, 0.7]]
    path = tmp_path / 'turned.yaml'
    names = list(reversed(ur5.joint_names))
    write_joint_motion(
        path, {'static': False, 'joint_names': names, 't': [0.0, 5.0], 'q': rows}, 'turned'
    )
    np.testing.assert_allclose(joint_motion(ur5, str(path)).q[0], rows[0][::-1])


def test_a_motion_of_another_robot_is_refused_in_a_sentence(proposal):
    with pytest.raises(DataError, match='moves shoulder_pan_joint'):
        joint_motion(catalog.load('abb_irb120'), str(proposal[1]))
