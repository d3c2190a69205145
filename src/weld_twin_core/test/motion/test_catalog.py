# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Bundled robots against Pinocchio, published URDFs, makers' drawings and finite differences."""

from importlib.metadata import PackageNotFoundError, files
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from drawn_robots import pinocchio_model
from source_chains import CHAINS, chain_poses

from weld_twin_core import ModelError, catalog, forward, gravity_torque, jacobian

UR = 'ur_description/urdf'
URDFS = {
    'ur5': (f'{UR}/ur5_robot.urdf', 'tool0', True),
    'ur10': (f'{UR}/ur10_robot.urdf', 'tool0', True),
    'franka_panda': ('panda_description/urdf/panda.urdf', 'panda_link8', False),
}


@pytest.fixture(params=catalog.names())
def robot(request):
    """Return each bundled robot in turn."""
    return catalog.load(request.param)


@pytest.fixture
def urdf_model():
    """Return a function that builds a Pinocchio model from a published URDF, without a hand."""
    pin = pytest.importorskip('pinocchio')
    try:
        shared = {Path(file).as_posix(): file for file in files('example-robot-data') or ()}
    except PackageNotFoundError:
        pytest.skip('example-robot-data is not installed')

    def build(path):
        (file,) = (file for name, file in shared.items() if name.endswith(f'/robots/{path}'))
        root = ElementTree.parse(file.locate()).getroot()
        for element in list(root):
            names = [element.get('name', '')] + [c.get('link', '') for c in element]
            if any('hand' in name or 'finger' in name for name in names):
                root.remove(element)
        return pin.buildModelFromXML(ElementTree.tostring(root, encoding='unicode'))

    return build


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(ModelError, match=r"called 'ur7'; there are ur5, ur10, kuka"):
        catalog.load('ur7')


def test_every_robot_names_its_source_and_has_limits_and_says_where_masses_are_missing(robot):
    assert len(robot.source) > 50
    for limit in (robot.lower, robot.upper, robot.max_velocity, robot.max_acceleration):
        assert np.isfinite(limit).all()
    if robot.mass is None:
        assert 'no source of link masses' in robot.source
    else:
        assert (robot.mass > 0.0).all()


def test_every_file_of_the_catalogue_is_a_robot_of_its_name():
    folder = Path(catalog.__file__).parent
    assert sorted(file.stem for file in folder.glob('*.yaml')) == sorted(catalog.names())
    assert all(catalog.load(name).name == name for name in catalog.names())


QUARTER = np.pi / 2
PUBLISHED = {
    # a and d [m] and alpha [rad] of the rows, as UR's article 45257 has them
    'ur5e': (
        [0.0, -0.425, -0.3922, 0.0, 0.0, 0.0],
        [0.1625, 0.0, 0.0, 0.1333, 0.0997, 0.0996],
        [QUARTER, 0.0, 0.0, QUARTER, -QUARTER, 0.0],
    ),
    'ur10e': (
        [0.0, -0.6127, -0.57155, 0.0, 0.0, 0.0],
        [0.1807, 0.0, 0.0, 0.17415, 0.11985, 0.11655],
        [QUARTER, 0.0, 0.0, QUARTER, -QUARTER, 0.0],
    ),
    # as Franka's interface specification has them (Craig), the flange in the last row
    'franka_panda': (
        [0.0, 0.0, 0.0, 0.0825, -0.0825, 0.0, 0.088],
        [0.333, 0.0, 0.316, 0.0, 0.384, 0.0, 0.107],
        [0.0, -QUARTER, QUARTER, QUARTER, -QUARTER, QUARTER, QUARTER],
    ),
}


@pytest.mark.parametrize('name', PUBLISHED)
def test_rows_are_those_that_the_maker_publishes(name):
    arm = catalog.load(name)
    for own, published in zip((arm.a, arm.d, arm.alpha), PUBLISHED[name], strict=True):
        np.testing.assert_allclose(own, published, rtol=0.0, atol=1e-15)


def test_ranges_and_speeds_of_an_arm_are_those_of_its_data_sheet_in_degrees():
    arm = catalog.load('abb_irb120')  # ABB, product specification 3HAC035960
    lower, upper = [-165, -110, -110, -160, -120, -400], [165, 110, 70, 160, 120, 400]
    np.testing.assert_allclose(arm.lower, np.radians(lower), rtol=1e-15)
    np.testing.assert_allclose(arm.upper, np.radians(upper), rtol=1e-15)
    speed = np.radians([250, 250, 250, 320, 320, 420])
    np.testing.assert_allclose(arm.max_velocity, speed, rtol=1e-15)


def test_tool_pose_jacobian_and_gravity_are_those_of_pinocchio(robot, configurations):
    pin, model = pinocchio_model(robot)
    data, tip = model.createData(), model.getFrameId('tip')
    for q in configurations(robot):
        pin.framesForwardKinematics(model, data, q)
        np.testing.assert_allclose(forward(robot, q), data.oMf[tip].homogeneous, atol=1e-12)
        expected = pin.computeFrameJacobian(
            model, data, q, tip, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )
        np.testing.assert_allclose(jacobian(robot, q), expected, atol=1e-12)
        # What gravity does to the joints is minus what the motors must hold.
        held = pin.computeGeneralizedGravity(model, data, q)
        np.testing.assert_allclose(gravity_torque(robot, q), -held, atol=1e-10)


@pytest.mark.parametrize('name', URDFS)
def test_the_flange_is_where_the_published_urdf_has_it(name, urdf_model, configurations):
    pin = pytest.importorskip('pinocchio')
    path, tip, half_turn = URDFS[name]
    robot, model = catalog.load(name), urdf_model(path)
    # UR's controller base looks the other way than its URDF's base_link.
    base = np.diag([-1.0, -1.0, 1.0, 1.0]) if half_turn else np.eye(4)
    data = model.createData()
    for q in configurations(robot):
        pin.framesForwardKinematics(model, data, q)
        expected = base @ data.oMf[model.getFrameId(tip)].homogeneous
        np.testing.assert_allclose(forward(robot, q), expected, atol=1e-5)


def test_the_gravity_torque_of_the_panda_is_that_of_its_urdf(urdf_model, configurations):
    pin = pytest.importorskip('pinocchio')
    robot, model = catalog.load('franka_panda'), urdf_model(URDFS['franka_panda'][0])
    model.gravity.linear = robot.gravity
    for q in configurations(robot):
        held = pin.computeGeneralizedGravity(model, model.createData(), q)
        np.testing.assert_allclose(gravity_torque(robot, q), -held, atol=1e-4)


@pytest.mark.parametrize('name', CHAINS)
def test_the_flange_is_where_the_joints_of_the_source_put_it(name, configurations):
    robot = catalog.load(name)
    for q in configurations(robot):
        np.testing.assert_allclose(forward(robot, q), chain_poses(name, q)[-1], atol=1e-12)


def test_the_gravity_torque_of_the_iiwa_is_the_slope_of_the_energy_of_its_urdf(configurations):
    robot = catalog.load('kuka_iiwa14')
    masses = [5.289529, 5.688888, 3.461245, 4.122995, 1.563756, 2.457878, 0.265331]
    centres = [
        (0.0, -0.033795, 0.132404, 1.0),
        (0.000136, 0.047548, 0.076322, 1.0),
        (0.0, 0.034913, 0.123108, 1.0),
        (0.0, -0.039793, 0.086944, 1.0),
        (0.0, -0.029824, 0.076267, 1.0),
        (0.0, 0.07102, 0.00495, 1.0),
        (3e-06, -2e-06, 0.013782, 1.0),
    ]

    def energy(q):
        links = chain_poses('kuka_iiwa14', q)
        heights = [(link @ c)[2] for link, c in zip(links, centres, strict=False)]
        return np.linalg.norm(robot.gravity) * np.dot(masses, heights)

    step = 1e-5
    for q in configurations(robot):
        moves = step * np.eye(robot.n)
        slope = [(energy(q + move) - energy(q - move)) / (2.0 * step) for move in moves]
        np.testing.assert_allclose(gravity_torque(robot, q), -np.array(slope), atol=1e-6)
