# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A middleware with DDS security, built from its source on the ROS there is; tools that make keys too.

The wheels of Fast DDS have no security. Debian's Cyclone DDS has, but the package that joins it to
ROS, ``rmw_cyclonedds_cpp``, comes as source alone, and so does ``sros2``, which makes the
keys: run as a module with a folder, a policy and enclaves, a process of its own sees what was built.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

from weld_twin_core.errors import TwinError

WANTED = ('rmw_cyclonedds_cpp', 'sros2')
"""Packages that are built, where the folder has them."""
MIDDLEWARE = WANTED[0]
"""The one that nothing works without."""
FETCH = (
    'fetch the branch jazzy of ros2/rmw_cyclonedds and ros2/sros2 into a folder, '
    'and give it as --source'
)
"""What to do where there is no source."""
INCLUDE = ('/usr/include', f'/usr/include/{sysconfig.get_config_var("MULTIARCH")}')
"""Where headers lie."""
HEADERS = {'dds/dds.h': 'cyclonedds-dev', 'lttng/tracepoint.h': 'liblttng-ust-dev'}
"""What is compiled against, and the packages of Debian that have it."""
WHEELS = (
    *('ament_cmake', 'ament_cmake_core', 'ament_cmake_export_definitions'),
    *('ament_cmake_export_dependencies', 'ament_cmake_export_include_directories'),
    *('ament_cmake_export_interfaces', 'ament_cmake_export_libraries'),
    *('ament_cmake_export_link_flags', 'ament_cmake_export_targets', 'ament_cmake_gen_version_h'),
    *('ament_cmake_gmock', 'ament_cmake_gtest', 'ament_cmake_include_directories'),
    *('ament_cmake_libraries', 'ament_cmake_pytest', 'ament_cmake_python', 'ament_cmake_ros'),
    *('ament_cmake_target_dependencies', 'ament_cmake_test', 'ament_cmake_version'),
    'ament_package',
)
"""What the wheels of ROS need to build a package in C++; none of them brings another."""
LIBRARY = f'lib{MIDDLEWARE}.so'


@contextmanager
def secured_middleware(source: Path, work: Path) -> Iterator[None]:
    """Run on a source, built in a folder where it is not yet, for a while; raises TwinError."""
    install = work / 'install'
    if next(install.rglob(LIBRARY), None) is None:
        _refuse_unable(source)
        _build(source, work)
    before = dict(os.environ)
    os.environ.update(_environment(install))
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


def _refuse_unable(source: Path) -> None:
    packages = _packages(source)
    if MIDDLEWARE not in packages:
        raise TwinError(f"'{source}' holds no {MIDDLEWARE}: {FETCH}")
    tools = {
        'cmake': 'apt-get install cmake',
        'g++': 'apt-get install g++',
        'colcon': 'pip install colcon-common-extensions',
    }
    for tool, remedy in tools.items():
        if shutil.which(tool) is None:
            raise TwinError(f'{MIDDLEWARE} cannot be built: {tool} is not here; {remedy}')
    for header, package in HEADERS.items():
        if not any(Path(place, header).is_file() for place in INCLUDE):
            raise TwinError(
                f'{MIDDLEWARE} cannot be built: {header} is not here; apt-get install {package}'
            )
    _refuse_moved_wheels()


def _refuse_moved_wheels() -> None:
    """Refuse wheels whose build files name places that are not here."""
    prefix = Path(sys.prefix)
    if not (prefix / 'share' / 'rmw').is_dir():
        return  # ROS is the system's
    lacking = [name for name in WHEELS if find_spec(name) is None]
    if lacking:
        wheels = ' '.join(f'ros-jazzy-{name.replace("_", "-")}' for name in lacking)
        raise TwinError(
            f'{MIDDLEWARE} cannot be built: wheels of the build tools are not here; pip install {wheels}'
        )
    tag = f'cp{sys.version_info[0]}{sys.version_info[1]}'
    made_in = Path(f'/opt/python/{tag}-{tag}')
    for place, here in (
        (made_in / 'include', sysconfig.get_config_var('INCLUDEDIR')),
        (made_in / 'lib', prefix / 'lib'),
    ):
        if not place.exists():
            raise TwinError(
                f'{MIDDLEWARE} cannot be built: the build files of the wheels name {place}; '
                f'ln -s {here} {place}'
            )


def _packages(source: Path) -> set[str]:
    return {file.parent.name for file in source.rglob('package.xml')}


def _build(source: Path, work: Path) -> None:
    work.mkdir(parents=True, exist_ok=True)
    there = [name for name in WANTED if name in _packages(source)]
    prefix = os.pathsep.join(filter(None, [os.environ.get('AMENT_PREFIX_PATH'), sys.prefix]))
    done = subprocess.run(
        [
            *('colcon', '--log-base', str(work / 'log'), 'build', '--merge-install'),
            *('--base-paths', str(source), '--build-base', str(work / 'build')),
            *('--install-base', str(work / 'install'), '--packages-up-to', *there),
            *('--cmake-args', '-DBUILD_TESTING=OFF', '-DCMAKE_BUILD_TYPE=Release'),
            f'-DPython3_EXECUTABLE={sys.executable}',
        ],
        env={**os.environ, 'AMENT_PREFIX_PATH': prefix, 'CMAKE_PREFIX_PATH': prefix},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise TwinError(
            f'{MIDDLEWARE} does not build: {(done.stderr or done.stdout).strip()[-800:]}'
        )


def _environment(install: Path) -> Mapping[str, str]:
    script = f'source {shlex.quote(str(install / "setup.bash"))} && env -0'
    out = subprocess.run(['bash', '-c', script], capture_output=True, text=True, check=True).stdout
    made = dict(item.split('=', 1) for item in out.split('\0') if '=' in item)
    library = next(install.rglob(LIBRARY), None)
    if library is None:
        raise TwinError(f"'{install}' has no {LIBRARY}; remove the folder and try again")
    bundled = [place for root in map(Path, sys.path) for place in root.glob('ros_*.libs')]
    # The wheels look for a middleware among themselves alone; a library that is loaded is found.
    own = [str(library.parent), f'{sys.prefix}/lib', *map(str, bundled)]
    made['LD_LIBRARY_PATH'] = os.pathsep.join(filter(None, [*own, made.get('LD_LIBRARY_PATH')]))
    return {**made, 'RMW_IMPLEMENTATION': MIDDLEWARE, 'LD_PRELOAD': str(library)}


ABSENT = 3
"""Exit code where sros2 cannot be imported; it prints why."""


def keystore(folder: Path, policy: Path, enclaves: Iterable[str]) -> Path:
    """Return a new keystore for the domain of the environment; raises TwinError where sros2 fails."""
    command = [sys.executable, '-m', __name__, str(folder), str(policy), *enclaves]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    said = (done.stderr or done.stdout).strip()
    if done.returncode == ABSENT:
        raise TwinError(f'no keys can be made without sros2: {said}')
    if done.returncode:
        raise TwinError(f'sros2 makes no keys: {said[-600:]}')
    return folder


def main(folder: str, policy: str, *enclaves: str) -> int:
    try:
        from sros2.keystore import create_enclave, create_keystore, create_permission
    except ImportError as error:
        remedy = FETCH if error.name == 'sros2' else 'pip install "cryptography<42" lxml'
        print(f'{error}; {remedy}')
        return ABSENT
    place = Path(folder)
    create_keystore(place)
    for enclave in enclaves:
        create_enclave(place, enclave)
        create_permission(place, enclave, Path(policy))
    return 0


if __name__ == '__main__':
    raise SystemExit(main(*sys.argv[1:]))
