# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
import re
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path

import numpy as np
import pytest
from by_pinocchio import by_pinocchio

from weld_twin_core.arm import catalog
from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.dynamics import gravity_torque
from weld_twin_core.arm.robot import Robot
from weld_twin_core.effects import effect_from_mapping
from weld_twin_core.errors import DataError, ModelError
from weld_twin_msgs_py.files.effects_file import read_effects, write_effects
from weld_twin_msgs_py.robots import load_robot, read_urdf, write_robot_yaml, write_urdf

ROBOTS = [
    ('ur_description/urdf/ur3_robot.urdf', None, 'tool0'),
    ('ur_description/urdf/ur5_robot.urdf', None, 'tool0'),
    ('ur_description/urdf/ur5_gripper.urdf', 'base_link', 'wrist_3_link'),
    ('ur_description/urdf/ur10_robot.urdf', None, 'ee_link'),
    ('panda_description/urdf/panda.urdf', None, 'panda_hand'),
    ('panda_description/urdf/panda.urdf', 'panda_link1', 'panda_link8'),
    ('kinova_description/robots/kinova.urdf', None, 'j2s6s200_end_effector'),
    ('xarm_description/urdf/xarm7.urdf', None, 'link7'),
    ('pr2_description/urdf/pr2.urdf', 'torso_lift_link', 'r_gripper_tool_frame'),
    ('talos_data/robots/talos_full_v2.urdf', 'torso_2_link', 'gripper_left_base_link'),
    ('tiago_description/robots/tiago.urdf', 'base_footprint', 'arm_tool_link'),
    ('romeo_description/urdf/romeo.urdf', 'torso', 'l_wrist'),
    ('icub_description/robots/icub.urdf', None, 'l_hand'),
]


@pytest.fixture(params=ROBOTS, ids=lambda case: f'{Path(case[0]).stem}-{case[2]}')
def case(request):
    name, base, tip = request.param
    try:
        shared = files('example-robot-data') or ()
    except PackageNotFoundError:
        pytest.skip('example-robot-data is not installed')
    path = next(file.locate() for file in shared if str(file).endswith(f'/robots/{name}'))
    return read_urdf(path, base, tip), path, base, tip


def random_positions(robot, count=40):
    return np.random.default_rng(11).uniform(-3.0, 3.0, (count, robot.n))


def test_a_urdf_gives_the_poses_and_gravity_torques_pinocchio_gives(case):
    robot, path, base, tip = case
    q = random_positions(robot)
    poses, torques = by_pinocchio(path, robot.joint_names, q, base, tip)
    np.testing.assert_allclose(forward(robot, q), poses, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(gravity_torque(robot, q), torques, rtol=0.0, atol=1e-10)


def test_a_urdf_written_and_read_again_has_the_same_poses(case, tmp_path):
    robot = case[0]
    write_urdf(tmp_path / 'again.urdf', robot)
    again = load_robot(str(tmp_path / 'again.urdf'))
    q = random_positions(robot)
    np.testing.assert_allclose(forward(again, q), forward(robot, q), rtol=0.0, atol=1e-13)
    np.testing.assert_array_equal(again.lower, robot.lower)
    np.testing.assert_array_equal(again.max_velocity, robot.max_velocity)
    assert again.joint_names == robot.joint_names


@pytest.mark.parametrize('name', catalog.names())
def test_pinocchio_reads_our_urdf_of_a_bundled_robot_with_its_gear_errors(name, tmp_path):
    nominal = catalog.load(name)
    rng = np.random.default_rng(3)
    shifts = {
        key: getattr(nominal, key) + rng.normal(0.0, 1e-3, nominal.n)
        for key in ('a', 'd', 'alpha', 'theta', 'beta')
    }
    robot = Robot(**{**nominal.__dict__, **shifts})
    write_urdf(tmp_path / 'r.urdf', robot)
    q = random_positions(robot)
    expected, _ = by_pinocchio(tmp_path / 'r.urdf', robot.joint_names, q, 'world', 'tool')
    np.testing.assert_allclose(forward(robot, q), expected, rtol=0.0, atol=1e-12)


def test_nearly_parallel_axes_keep_their_numbers_small(tmp_path):
    robot = catalog.load('ur5')
    tilted = Robot(**{**robot.__dict__, 'beta': np.array([0, 1e-4, -2e-4, 0, 0, 0])})
    write_urdf(tmp_path / 'r.urdf', tilted)
    again = load_robot(str(tmp_path / 'r.urdf'))
    assert abs(again.d).max() < 0.2
    q = random_positions(robot)
    np.testing.assert_allclose(forward(again, q), forward(tilted, q), rtol=0.0, atol=1e-13)


def test_modified_convention_is_written_exactly(tmp_path):
    rows = [
        {'name': f'j{k}', 'a': 0.1 * k, 'alpha': 0.7 - k, 'd': 0.3, 'theta_offset': 0.2 * k}
        for k in range(4)
    ]
    rows[1]['type'] = 'prismatic'
    robot = Robot.from_mapping({'name': 'm', 'convention': 'modified', 'joints': rows})
    write_urdf(tmp_path / 'm.urdf', robot)
    q = random_positions(robot)
    again = load_robot(str(tmp_path / 'm.urdf'))
    np.testing.assert_allclose(forward(again, q), forward(robot, q), rtol=0.0, atol=1e-13)


@pytest.mark.parametrize('name', catalog.names())
def test_yaml_round_trips_to_the_last_bit(name, tmp_path):
    robot = load_robot(name.upper())
    write_robot_yaml(tmp_path / 'r.yaml', robot)
    again = load_robot(str(tmp_path / 'r.yaml'))
    assert again.to_mapping() == robot.to_mapping()


def one_joint(keys='', **more):
    """Return a robot file of one joint, with more keys of it and of the robot."""
    own = ''.join(f'{key}: {value}\n' for key, value in more.items())
    return f'name: r\n{own}joints:\n- {{name: j{keys}}}\n'


BOMB = 'a: &a [x, x]\nb: &b [*a, *a]\n'


@pytest.mark.parametrize('gravity', ([0.0, 0.0, 0.0], [0.0, -7.0, -7.0]))
def test_exponents_without_a_point_are_numbers_and_an_arm_may_hang_or_float(tmp_path, gravity):
    (tmp_path / 'r.yaml').write_text(one_joint(', a: 1e-3, alpha: -2E+0', gravity=gravity))
    robot = load_robot(str(tmp_path / 'r.yaml'))
    assert (robot.a[0], robot.alpha[0], robot.gravity.tolist()) == (0.001, -2.0, gravity)


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('name: r\njoints: [\n', "robot file '{}' line 3: "),
        ('name: r\njoints:\n- {name: j, a: 1}\n- {name: j, a: 1}\n', 'uses a joint name twice'),
        ('name: r\nname: s\n', "robot file '{}' line 2: the key 'name' is given twice"),
        (BOMB, "robot file '{}' line 2: aliases are not accepted"),
        ('name: !!python/object:os.system x\n', 'could not determine a constructor'),
        (
            one_joint(', alpha: 90'),
            "robot file '{}': joint 'j': alpha is 90, which looks like degrees",
        ),
        (one_joint(', lower: -170, upper: 170'), 'lower is -170, which looks'),
        (one_joint(', a: 425'), 'a is 425, which looks like millimetres'),
        (one_joint(', d: 89.2'), 'd is 89.2, which looks like millimetres'),
        (one_joint(links='[{mass: 1, com: [0, 0, -26]}]'), "joint 'j': com is 26, which looks"),
        (
            one_joint(tool='{xyz: [0, 0, 250], quat_xyzw: [0, 0, 0, 1]}'),
            'tool is 250 away, which looks',
        ),
        (one_joint(payload='{mass: 2, com: [0, 0, 80]}'), "payload's com is 80 away, which looks"),
        (one_joint(gravity='[0, 0, -1]'), 'gravity is 1; it is in m/s^2'),
        (one_joint(gravity='[0, 0, -9810]'), 'gravity is 9810; it is in'),
        (one_joint(', b: 1'), "joint 'j' has the unknown key 'b'"),
        ('', 'a robot file must be a mapping of keys, got NoneType'),
        ('[' * 100_000, 'nested too deeply'),
        ('x' * 1_100_000, 'is larger than 1 MB'),
    ],
)
def test_bad_robot_files_are_refused_in_one_sentence(tmp_path, text, words):
    path = tmp_path / 'r.yaml'
    path.write_text(text)
    with pytest.raises(ModelError, match=re.escape(words.format(path))) as caught:
        load_robot(str(path))
    assert '\n' not in str(caught.value)


LINKS = '<link name="a"/><link name="b"/><link name="c"/>'
JOINT = '<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/>{}</joint>'


def urdf(*joints):
    return '<robot name="r">' + LINKS + ''.join(JOINT.format(*j) for j in joints) + '</robot>'


def two(*ends):
    """A URDF of two joints between these links."""
    return urdf(('j', 'revolute', *ends[:2], ''), ('k', 'revolute', *ends[2:], ''))


def turning(kind='revolute', inside=''):
    """A URDF whose first joint is odd and whose second is sound."""
    return urdf(('j', kind, 'a', 'b', inside), ('k', 'revolute', 'b', 'c', ''))


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('<robot', 'is not well-formed XML'),
        ('<!DOCTYPE r [<!ENTITY a "b">]><robot name="r"/>', 'has a document type or entities'),
        ('<model name="r"/>', 'its outermost tag is <model>, not <robot>'),
        ('<robot xmlns:xacro="http://ros.org/wiki/xacro"><xacro:m/></robot>', 'is a xacro file'),
        ('<robot name="r"/>', 'there is no link in it'),
        (two('a', 'b', 'a', 'c'), 'the chain has several ends (b, c); say which with --tip-link'),
        (urdf(('j', 'fixed', 'a', 'b', ''), ('k', 'fixed', 'b', 'c', '')), 'no joint moves'),
        (turning('floating'), "joint 'j' is floating"),
        (turning(inside='<axis xyz="0 0 0"/>'), "the axis of joint 'j' has no direction"),
        (turning(inside='<mimic joint="k"/>'), "joint 'j' mimics another"),
        (
            turning(inside='<origin rpy="0 -90 0"/>'),
            "origin rpy of joint 'j' is -90, which looks like",
        ),
        (urdf(('j', 'revolute', 'a', 'z', '')), "joint 'j' names a link 'z' that is not there"),
        (two('a', 'b', 'c', 'b'), "link 'b' hangs on two joints"),
        (two('b', 'c', 'c', 'b'), 'no chain of joints'),
        (turning(inside='<origin xyz="1 2"/>'), "URDF '"),
        (
            turning(inside='<origin xyz="1 2 nan"/>'),
            "origin xyz of joint 'j' has 1 value(s) that are",
        ),
    ],
)
def test_bad_urdfs_are_refused_in_one_sentence(tmp_path, capfd, text, words):
    path = tmp_path / 'r.urdf'
    path.write_text(text)
    with pytest.raises(ModelError, match=re.escape(words)) as caught:
        load_robot(str(path), None, 'c' if 'no chain' in words else None)
    assert '\n' not in str(caught.value)
    assert capfd.readouterr().err == ''


def test_links_that_are_not_there_are_named(tmp_path):
    (tmp_path / 'r.urdf').write_text(turning())
    with pytest.raises(ModelError, match="no tip link 'tool'; its links are a, b, c"):
        load_robot(str(tmp_path / 'r.urdf'), tip_link='tool')


@pytest.mark.parametrize(
    ('spec', 'words'),
    [
        ('ur7', "'ur7' is neither a bundled robot (ur5, "),
        ('nowhere.yaml', "robot file 'nowhere.yaml' cannot be read: No such file"),
        ('nowhere.urdf', "URDF 'nowhere.urdf' cannot be read: No such file"),
        ('arm.urdf.xacro', "is a xacro file; run 'xacro arm.urdf.xacro'"),
    ],
)
def test_a_robot_that_is_not_there_is_named(spec, words):
    with pytest.raises(ModelError, match=re.escape(words)):
        load_robot(spec)


SIBLINGS = """<robot name="arm">
<link name="base_link"/><link name="base"/><link name="arm_base"/><link name="tool0"/>
<joint name="beside" type="fixed"><origin xyz="0 0 0.1" rpy="0 0 3.141592653589793"/>
<parent link="base_link"/><child link="base"/></joint>
<joint name="below" type="fixed"><origin xyz="0 0 0.2"/>
<parent link="base_link"/><child link="arm_base"/></joint>
<joint name="turn" type="revolute"><origin xyz="1 0 0"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" velocity="1" effort="1"/>
<parent link="arm_base"/><child link="tool0"/></joint></robot>"""


def test_the_base_may_be_fixed_beside_the_chain(tmp_path):
    (tmp_path / 'arm.urdf').write_text(SIBLINGS)
    below = load_robot(str(tmp_path / 'arm.urdf'), 'base_link', 'tool0')
    beside = load_robot(str(tmp_path / 'arm.urdf'), 'base', 'tool0')
    np.testing.assert_allclose(forward(below, [0.3])[:3, 3], [1.0, 0.0, 0.2], atol=1e-12)
    np.testing.assert_allclose(forward(beside, [0.3])[:3, 3], [-1.0, 0.0, 0.1], atol=1e-12)
    half_turn = np.diag([-1.0, -1.0, 1.0])
    np.testing.assert_allclose(
        forward(beside, [0.3])[:3, :3], half_turn @ forward(below, [0.3])[:3, :3], atol=1e-12
    )


def test_base_and_tip_links_belong_to_a_urdf():
    with pytest.raises(ModelError, match="'ur5' is no URDF, so it has no base link"):
        load_robot('ur5', tip_link='tool0')


def test_files_are_not_overwritten_unless_asked(tmp_path, robot):
    write_robot_yaml(tmp_path / 'r.yaml', robot)
    with pytest.raises(DataError, match='exists already and is not overwritten'):
        write_robot_yaml(tmp_path / 'r.yaml', robot)
    write_robot_yaml(tmp_path / 'r.yaml', robot, overwrite=True)
    assert [path.name for path in tmp_path.iterdir()] == ['r.yaml']


# Effects files -------------------------------------------------------------------------------


def test_effects_round_trip(tmp_path, robot):
    entries = [
        {'effect': 'backlash', 'joint': 'elbow', 'width': 0.0005},
        {
            'effect': 'transmission_ripple',
            'joint': 'elbow',
            'amplitude': [1e-5, 2e-5],
            'order': [1.0, 2.0],
            'phase': [0.1, 0.2],
        },
        {'effect': 'base_pose', 'xyz': [1e-3, 0.0, 0.0], 'rotvec': [0.0, 0.0, 1e-3]},
    ]
    write_effects(tmp_path / 'e.yaml', map(effect_from_mapping, entries))
    back = read_effects(tmp_path / 'e.yaml', robot)
    for effect, entry in zip(back, entries, strict=True):
        mapping = effect.to_mapping()
        assert {key: mapping[key] for key in entry} == entry


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        (
            '- {effect: backlash, joint: wrist}\n',
            "effect 0: robot 'two' has no joint 'wrist'; its",
        ),
        ('- {effect: slack}\n', "effect 0: unknown effect 'slack'"),
        ('effect: backlash\n', 'an effects file must be a list of effects'),
        ('- {effect: backlash\n', 'line 2: '),
    ],
)
def test_bad_effects_files_name_file_and_entry(tmp_path, robot, text, words):
    path = tmp_path / 'e.yaml'
    path.write_text(text)
    with pytest.raises(ModelError, match=re.escape(words)) as caught:
        read_effects(path, robot)
    assert str(caught.value).startswith(f"effects file '{path}'")


def test_an_empty_effects_file_means_no_effects(tmp_path, robot):
    (tmp_path / 'e.yaml').write_text('')
    assert read_effects(tmp_path / 'e.yaml', robot) == ()
