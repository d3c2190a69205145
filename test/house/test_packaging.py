# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One version, one description of each package, and no import that nothing asks for."""

import ast
import re
import sys
from functools import cache
from xml.etree import ElementTree

import pytest
import yaml
from import_graph import ROOT, imported_names, module_files

import weld_twin_core

if sys.version_info >= (3, 11):
    import tomllib
else:
    tomllib = pytest.importorskip('tomli')

FILES = module_files(ROOT / 'src')
PACKAGES = sorted({name.partition('.')[0] for name in FILES})
PROJECT = tomllib.loads((ROOT / 'pyproject.toml').read_text())['project']
MODULES = {
    'PyYAML': 'yaml',
    'opencv-python-headless': 'cv2',
    'urdf-parser-py': 'urdf_parser_py',
    'pin': 'pinocchio',
    'SALib': 'SALib',
    'scikit-learn': 'sklearn',
}
"""Modules of the distributions that are called otherwise."""
ROS = {
    'action_msgs', 'ament_index_python', 'control_msgs', 'diagnostic_msgs', 'geometry_msgs', 'launch',
    'launch_ros', 'lifecycle_msgs', 'rcl_interfaces', 'rclpy', 'rosgraph_msgs', 'sensor_msgs', 'sros2',
    'std_srvs', 'rosidl_adapter', 'rosidl_generator_c', 'rosidl_generator_py',
    'rosidl_generator_type_description', 'rosidl_typesupport_c', 'rosidl_typesupport_fastrtps_c',
    'rosidl_typesupport_introspection_c',
}  # fmt: skip


def setup_keywords(package):
    tree = ast.parse((ROOT / 'src' / package / 'setup.py').read_text())
    calls = (node for node in ast.walk(tree) if isinstance(node, ast.Call))
    call = next(each for each in calls if getattr(each.func, 'id', '') == 'setup')
    return {item.arg: item.value for item in call.keywords}


@pytest.mark.parametrize('package', PACKAGES)
def test_package_xml_and_setup_py_agree(package):
    xml = ElementTree.parse(ROOT / 'src' / package / 'package.xml').getroot()
    told = setup_keywords(package)
    assert xml.findtext('name') == package
    assert xml.findtext('version') == told['version'].value == weld_twin_core.__version__
    assert xml.findtext('description') == told['description'].value
    assert xml.findtext('license') == told['license'].value == 'Apache-2.0'
    assert xml.findtext('export/build_type') == 'ament_python'
    assert told['python_requires'].value == PROJECT['requires-python']
    own = ROOT / 'src' / package / 'LICENSE'  # a wheel of one package brings it along
    assert own.read_bytes() == (ROOT / 'LICENSE').read_bytes()


@pytest.mark.parametrize('package', PACKAGES)
def test_package_names_the_project_where_it_lies_and_what_changed(package):
    reader = pytest.importorskip('catkin_pkg.package', reason='needs catkin_pkg')
    changes = pytest.importorskip('catkin_pkg.changelog', reason='needs catkin_pkg')
    found = reader.parse_package(str(ROOT / 'src' / package / 'package.xml'), warnings=[])
    assert [person.name for person in found.maintainers] == ['weld_twin contributors']
    assert (
        found.urls == []
    )  # the project has no address of its own; one that leads nowhere is none
    text = (ROOT / 'src' / package / 'CHANGELOG.rst').read_text()
    changelog = changes.get_changelog_from_path(str(ROOT / 'src' / package), package)
    day = changelog.get_date_of_version(found.version).date().isoformat()  # bloom wants one
    assert f'## {found.version} ({day})\n' in (ROOT / 'CHANGELOG.md').read_text()
    assert day == str(yaml.safe_load((ROOT / 'CITATION.cff').read_text())['date-released'])
    assert text.splitlines()[1] == f'Changelog for package {package}'
    declared = (ROOT / 'src' / package / 'QUALITY_DECLARATION.md').read_text()
    assert '(https://www.ros.org/reps/rep-2004.html)' in declared


def test_both_ways_of_installing_have_the_same_programs():
    listed = setup_keywords('weld_twin_nodes')['entry_points']
    programs = dict(line.split(' = ') for line in ast.literal_eval(listed)['console_scripts'])
    assert programs == PROJECT['scripts']


@cache
def imported(package, *, at_once=False):
    """Return the packages that one imports, or only those importing it brings in at once."""
    own = {name: file for name, file in FILES.items() if name.partition('.')[0] == package}
    named = (imported_names(*each, at_once=at_once) for each in own.items())
    return frozenset(name.partition('.')[0] for names in named for name in names)


@pytest.mark.parametrize('package', PACKAGES)
def test_a_wheel_of_one_package_asks_for_all_that_it_imports(package):
    asked = ast.literal_eval(setup_keywords(package)['install_requires'])
    ranges = {re.match(r'[\w.-]+', item).group(): item for item in PROJECT['dependencies']}
    used = imported(package)
    needed = {
        text for name, text in ranges.items() if MODULES.get(name, name.replace('-', '_')) in used
    }
    minor = weld_twin_core.__version__.rpartition('.')[0]
    major, _, second = minor.partition('.')
    beside = {
        f'{name}>={minor},<{major}.{int(second) + 1}'
        for name in PACKAGES
        if name in used and name != package
    }
    assert needed | beside <= set(asked)
    assert set(asked) <= {*ranges.values(), *beside, 'setuptools'}


def test_who_cites_the_project_finds_its_version_and_licence():
    told = yaml.safe_load((ROOT / 'CITATION.cff').read_text())
    assert (told['cff-version'], told['type']) == ('1.2.0', 'software')
    assert told['version'] == weld_twin_core.__version__
    assert told['license'] == 'Apache-2.0'
    assert [author['name'] for author in told['authors']] == ['weld_twin contributors']


KEYS = {'urdf_parser_py': 'urdfdom_py'}
"""Keys of rosdep that are neither the name of the module nor that with `python3-` before it."""
NO_KEYS = {'rosbags', 'mcap', 'lz4'}
"""What rosdep has no key for; CONTRIBUTING says where it comes from."""


@pytest.mark.parametrize('package', PACKAGES)
def test_package_xml_names_what_is_imported(package):
    """What belongs to an extra of pyproject.toml alone is asked for where it is used."""
    xml = ElementTree.parse(ROOT / 'src' / package / 'package.xml').getroot()
    named = {item.text for item in xml.iter('exec_depend')}
    needed = [re.match(r'[\w.-]+', item).group() for item in PROJECT['dependencies']]
    always = {MODULES.get(name, name.replace('-', '_')) for name in needed} - NO_KEYS
    for module in sorted(set(imported(package)) & (always | ROS | set(PACKAGES)) - {package}):
        keys = {KEYS.get(module, module), f'python3-{module}'}
        assert keys & named, f'{package} imports {module}'
    assert set(re.findall(r'`(\w+)`', (ROOT / 'CONTRIBUTING.md').read_text())) >= NO_KEYS


@pytest.mark.parametrize('package', PACKAGES)
def test_everything_imported_is_declared(package):
    lists = [PROJECT['dependencies'], *PROJECT['optional-dependencies'].values()]
    declared = {re.match(r'[\w.-]+', item).group() for items in lists for item in items}
    known = {MODULES.get(name, name.replace('-', '_')) for name in declared}
    known |= {'setuptools', 'typing_extensions'}  # the second is read by type checkers alone
    used = set(imported(package)) - sys.stdlib_module_names - set(PACKAGES)
    assert used - known - (set() if package == 'weld_twin_core' else ROS) == set()


@pytest.mark.parametrize(
    ('package', 'forbidden'),
    [
        ('weld_twin_core', {'rclpy', 'rosbags', 'yaml', 'matplotlib', 'SALib', 'pandas'}),
        ('weld_twin_nodes', {'fastapi', 'sqlalchemy'}),
    ],
)
def test_what_only_others_need_is_not_imported(package, forbidden):
    assert set(imported(package)) & forbidden == set()


def test_messages_and_bags_do_without_a_ros_installation():
    assert set(imported('weld_twin_msgs_py', at_once=True)) & ROS == set()
