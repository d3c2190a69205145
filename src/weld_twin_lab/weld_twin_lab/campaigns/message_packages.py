# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
`tf2_msgs` and what is needed of `control_msgs` and `mocap4r2_msgs`, which have no wheels.

ROS's own generators and a C compiler make the Python package and the type supports of the
middleware, as `rosidl_generate_interfaces` does in a workspace. The result is kept, and used again.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stdout, suppress
from importlib.util import find_spec
from io import StringIO
from pathlib import Path
from unittest.mock import patch

from weld_twin_core.errors import TwinError

POINT, POINTS = (
    'trajectory_msgs/JointTrajectoryPoint',
    'trajectory_msgs/MultiDOFJointTrajectoryPoint',
)
CODES = (
    *('SUCCESSFUL', 'INVALID_GOAL', 'INVALID_JOINTS', 'OLD_HEADER_TIMESTAMP'),
    *('PATH_TOLERANCE_VIOLATED', 'GOAL_TOLERANCE_VIOLATED'),
)
"""What a trajectory's end is called: 0, -1 and so on."""


def _fields(kind: str, *names: str) -> str:
    return ''.join(f'{kind} {name}\n' for name in names)


def _state(*parts: str) -> str:
    """Return the fields of a controller that tells some states of its joints."""
    joints = 'std_msgs/Header header\nstring[] joint_names\n' + _fields(POINT, *parts)
    many = (f'multi_dof_{part}' for part in parts)
    return joints + 'string[] multi_dof_joint_names\n' + _fields(POINTS, *many)


_TOLERATED = _fields('float64', 'position', 'velocity', 'acceleration')
DEFINITIONS: Mapping[str, Mapping[str, str]] = {
    'tf2_msgs': {'TFMessage': 'geometry_msgs/TransformStamped[] transforms\n'},
    'control_msgs': {
        'InterfaceValue': 'string[] interface_names\nfloat64[] values\n',
        'DynamicJointState': 'std_msgs/Header header\nstring[] joint_names\n'
        'InterfaceValue[] interface_values\n',
        'JointTrajectoryControllerState': _state('reference', 'feedback', 'error', 'output')
        + 'float64 speed_scaling_factor\n',
        'JointTolerance': 'string name\n' + _TOLERATED,
        'JointComponentTolerance': 'uint16 X_AXIS=1\nuint16 Y_AXIS=2\nuint16 Z_AXIS=3\n'
        'uint16 TRANSLATION=4\nuint16 ROTATION=5\nstring joint_name\nuint16 component\n'
        + _TOLERATED,
    },
    'mocap4r2_msgs': {
        'Marker': 'int64 index\ngeometry_msgs/Point translation\n',
        'RigidBody': 'std_msgs/Header header\nuint32 frame_number\nstring rigid_body_name\n'
        'Marker[] markers\ngeometry_msgs/Pose pose\n',
        'RigidBodies': 'std_msgs/Header header\nuint32 frame_number\nRigidBody[] rigidbodies\n',
    },
}
"""Packages, their messages, and the definitions of these in Jazzy."""
ACTIONS: Mapping[str, Mapping[str, str]] = {
    'control_msgs': {
        'FollowJointTrajectory': 'trajectory_msgs/JointTrajectory trajectory\n'
        'trajectory_msgs/MultiDOFJointTrajectory multi_dof_trajectory\n'
        + ''.join(
            f'JointTolerance[] {of}_tolerance\n'
            f'JointComponentTolerance[] component_{of}_tolerance\n'
            for of in ('path', 'goal')
        )
        + 'builtin_interfaces/Duration goal_time_tolerance\n---\nint32 error_code\n'
        + _fields('int32', *(f'{name} = {-k}' for k, name in enumerate(CODES)))
        + 'string error_string\n---\n'
        + _state('desired', 'actual', 'error')
    }
}
"""The same of their actions."""
NEEDED = (
    'builtin_interfaces',
    'std_msgs',
    'geometry_msgs',
    'trajectory_msgs',
    'service_msgs',
    'unique_identifier_msgs',
    'action_msgs',
)
"""Packages whose types they are made of."""
SUPPORTS = ('rosidl_typesupport_fastrtps_c', 'rosidl_typesupport_introspection_c')
"""Type supports that rmw_fastrtps_cpp asks for; the second tells of the type on the graph."""
JOINT = 'rosidl_typesupport_c'
"""The one that leads to these."""
PREFIX = Path(sys.prefix)
BUILT = 'weld_twin_messages_'
"""How the folders of packages begin that were built here."""


def folder_of_messages() -> Path | None:
    """Return a folder for ``PYTHONPATH`` with the packages; None where installed; raises TwinError."""
    absent = [package for package in DEFINITIONS if not _installed(package)]
    if not absent:
        return None
    name = hashlib.sha256(f'{DEFINITIONS}{ACTIONS}{PREFIX}{sys.version}'.encode()).hexdigest()[:12]
    kept = Path(tempfile.gettempdir()) / f'{BUILT}{os.getuid()}_{name}'
    if kept.is_dir():
        return kept
    _refuse_unable()
    with tempfile.TemporaryDirectory(dir=kept.parent) as folder:
        for package in absent:
            _build(package, Path(folder))
        with suppress(OSError):  # another process has put it there meanwhile
            Path(folder, 'site').rename(kept)
    return kept


@contextmanager
def messages_importable() -> Iterator[None]:
    """Let this process and its children import the packages, for a while."""
    folder = folder_of_messages()
    if folder is None:
        yield
        return
    # Several may ask at once and end in any order: each takes away what it has put there.
    given = os.environ.get('PYTHONPATH')
    os.environ['PYTHONPATH'] = os.pathsep.join(filter(None, [str(folder), given]))
    sys.path.insert(0, str(folder))
    try:
        yield
    finally:
        sys.path.remove(str(folder))
        paths = os.environ.get('PYTHONPATH', '').split(os.pathsep)
        if str(folder) in paths:
            paths.remove(str(folder))
        os.environ['PYTHONPATH'] = os.pathsep.join(paths)
        if not any(paths):
            del os.environ['PYTHONPATH']


def _installed(package: str) -> bool:
    spec = find_spec(package)
    return spec is not None and spec.origin is not None and BUILT not in spec.origin


def _refuse_unable() -> None:
    header = Path(sysconfig.get_path('include'), 'Python.h')
    lacking = [tool for tool in ('gcc', 'g++') if shutil.which(tool) is None]
    lacking += [] if header.is_file() else [str(header)]
    lacking += [] if find_spec('rosidl_generator_py') else ['rosidl_generator_py']
    if lacking:
        raise TwinError(
            f'{" and ".join(DEFINITIONS)} are not installed and cannot be built: {lacking[0]} is '
            'not here; install the packages, or a compiler and the headers of Python'
        )


def _build(package: str, folder: Path) -> None:
    source, made = folder / 'source' / package, folder / 'made' / package
    site = folder / 'site' / package
    for kind, texts in _interfaces(package).items():
        for place in (source, made, site):
            (place / kind).mkdir(parents=True)
        for name, text in texts.items():
            (source / kind / f'{name}.{kind}').write_text(text)
    # The generators tell of every file, and look for their templates where this says.
    with redirect_stdout(StringIO()), patch.dict(os.environ, AMENT_PREFIX_PATH=str(PREFIX)):
        _generate(package, source, made, site)
    (site / '__init__.py').touch()
    _compile(package, folder, made, site)


def _interfaces(package: str) -> dict[str, Mapping[str, str]]:
    """Return the definitions of a package by their kind, which is their folder and suffix."""
    kinds = {'msg': DEFINITIONS[package], 'action': ACTIONS.get(package, {})}
    return {kind: texts for kind, texts in kinds.items() if texts}


def _generate(package: str, source: Path, made: Path, site: Path) -> None:
    from rosidl_adapter.cli import TranslateActionToIDL, TranslateMsgToIDL
    from rosidl_generator_c.cli import GenerateC
    from rosidl_generator_py.cli import GeneratePython
    from rosidl_generator_type_description.cli import HashTypeDescription
    from rosidl_typesupport_c.cli import GenerateCTypesupport
    from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport
    from rosidl_typesupport_introspection_c.cli import GenerateIntrospectionCTypesupport

    include = [str(PREFIX / 'share' / own) for own in NEEDED]
    translators = {'msg': TranslateMsgToIDL('msg'), 'action': TranslateActionToIDL('action')}
    files: list[str] = []
    for kind, texts in _interfaces(package).items():
        given = [f'{source}:{kind}/{name}.{kind}' for name in sorted(texts)]
        files += translators[kind].translate(package, given, include, source)
    hashes = HashTypeDescription('hash').generate_type_hashes(package, files, include, made)
    GenerateC('c').generate(package, files, include, made, hashes)
    for generator, out in (
        (GenerateFastRTPSCTypesupport('fast'), made / SUPPORTS[0]),
        (GenerateIntrospectionCTypesupport('introspect'), made / SUPPORTS[1]),
        (GenerateCTypesupport('joint', typesupport_implementations=SUPPORTS), made / JOINT),
        (GeneratePython('py', typesupport_implementations=[JOINT]), site),
    ):
        generator.generate(package, files, include, out)


def _compile(package: str, folder: Path, made: Path, site: Path) -> None:
    include = folder / 'include' / package
    include.mkdir(parents=True)
    for place in (made / SUPPORTS[0], made / SUPPORTS[1], made / JOINT, made):
        for kind in _interfaces(package):
            shutil.copytree(place / kind, include / kind, dirs_exist_ok=True)
    support = {name: sorted((made / name).rglob('*.c*')) for name in SUPPORTS}
    structures = sorted(c for kind in _interfaces(package) for c in (made / kind).rglob('*.c'))
    link = _Linker(folder, site)
    base = link(f'lib{package}__rosidl_generator_c.so', structures, [])
    others = [link(f'lib{package}__{name}.so', support[name], [base]) for name in SUPPORTS]
    module = f'{package}_s__{JOINT}{sysconfig.get_config_var("EXT_SUFFIX")}'
    sources = [*site.rglob('*_s.c'), site / f'_{package}_s.ep.{JOINT}.c']
    sources += sorted((made / JOINT).rglob('*.cpp'))
    link(module, sources, [base, *others])


class _Linker:
    """Compiles sources into shared libraries that find each other where they lie."""

    def __init__(self, folder: Path, site: Path) -> None:
        import numpy as np

        self._folder, self._site = folder, site
        self._include = [
            f'-I{folder / "include"}',
            f'-I{sysconfig.get_path("include")}',
            f'-I{np.get_include()}',
            f'-I{PREFIX / "include"}',
            *(f'-I{place}' for place in (PREFIX / 'include').iterdir()),
        ]
        kinds = ('rosidl_generator_c', 'rosidl_generator_py', *SUPPORTS)
        self._libraries = [
            f'-L{PREFIX / "lib"}',
            *(f'-l{own}__{kind}' for own in NEEDED for kind in kinds),
            *(f'-l{name}' for name in ('rosidl_runtime_c', 'rcutils', 'fastcdr')),
            *(f'-lrosidl_typesupport_{name}' for name in ('c', 'introspection_c')),
            *(f'-lrosidl_typesupport_fastrtps_{name}' for name in ('c', 'cpp')),
        ]

    def __call__(self, name: str, sources: list[Path], needs: list[Path]) -> Path:
        """Return the library; quick to make matters more than quick code."""
        out = self._site / name
        of_c = [source for source in sources if source.suffix == '.c']
        objects = [self._object(source) for source in of_c]
        if len(of_c) < len(sources):
            # All at once: most of what a file takes are the headers, which are those of the others.
            whole = self._folder / f'{name}.cpp'
            rest = (f'#include "{source}"\n' for source in sources if source not in of_c)
            whole.write_text(''.join(rest))
            objects.append(self._object(whole))
        rpath = f'-Wl,-rpath,$ORIGIN:{PREFIX / "lib"}'
        soname = f'-Wl,-soname,{name},--no-as-needed'
        links = [*map(str, (*objects, *needs)), *self._libraries]
        self._run('g++', '-shared', soname, rpath, '-o', str(out), *links)
        return out

    def _object(self, source: Path) -> Path:
        out = self._folder / f'{hashlib.sha256(str(source).encode()).hexdigest()[:12]}.o'
        compiler = ['gcc'] if source.suffix == '.c' else ['g++', '-std=c++17']
        self._run(
            *compiler, '-O0', '-fPIC', '-w', '-c', str(source), '-o', str(out), *self._include
        )
        return out

    @staticmethod
    def _run(*command: str) -> None:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise TwinError(
                f'the message packages cannot be built: {command[0]} ended with code '
                f'{done.returncode}: {done.stderr[-800:]}'
            )
