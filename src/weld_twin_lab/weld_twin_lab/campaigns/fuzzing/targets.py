# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Every kind of file the program reads, with samples that are right."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.arrays import Array
from weld_twin_core.effects import effects_from_list
from weld_twin_core.errors import DataError, ModelError
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_core.sensitivity import tolerances_from_list
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.bags import bag_info, read_recording, recover, write_recording
from weld_twin_msgs_py.files.diagnosis_model import load_model, read_diagnosis
from weld_twin_msgs_py.files.effects_file import read_effects
from weld_twin_msgs_py.files.path_file import read_path
from weld_twin_msgs_py.files.yaml_file import parse_yaml, read_yaml, yaml_text
from weld_twin_msgs_py.robots import load_robot, write_urdf
from weld_twin_msgs_py.tables import read_table

ROBOT = catalog.load('ur5')
EFFECTS = """
- {effect: joint_offset, joint: elbow_joint, offset: 1.0e-3}
- {effect: transmission_ripple, joint: wrist_1_joint, amplitude: [1e-4, 2e-4], order: [1, 2],
   phase: [0, 1]}
- {effect: backlash, joint: shoulder_pan_joint, width: 5.0e-4}
- {effect: joint_compliance, joint: elbow_joint, compliance: 1.0e-5}
- {effect: base_pose, xyz: [1.0e-3, 0, 0], rotvec: [0, 0, 1.0e-3]}
- {effect: thermal_growth, coefficient: 1.2e-5}
- {effect: payload, mass: 2.0, com: [0, 0, 0.1]}
- {effect: time_delay, delay: 0.01}
"""
TOLERANCES = """
- {effect: joint_offset, joint: elbow_joint, parameter: offset, distribution: normal, mean: 0.0,
   std: 5.0e-4}
- {effect: base_pose, parameter: xyz, index: 1, distribution: uniform, low: -1.0e-3, high: 1.0e-3}
"""
URDF = """<robot name="two"><link name="base"/><link name="upper"><inertial>
<origin xyz="0 0 0.1" rpy="0 0 0"/><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1"
 iyz="0" izz="1"/></inertial></link><link name="tool0"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.3"
 rpy="0 1.57 0"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="2"/></joint>
<joint name="j2" type="continuous"><parent link="upper"/><child link="tool0"/><origin
 xyz="0.4 0 0"/><axis xyz="0 1 0"/></joint></robot>"""
PATHS = (
    '{kind: line, start: [0.4, -0.2, 0.2], end: [0.4, 0.2, 0.2], weave: {amplitude: 2e-3, '
    'wavelength: 5e-3}, torch: {work: 0.1, travel: 0.1}}',
    '{kind: points, points: [[0.4, 0, 0.2], [0.5, 0.1, 0.2], [0.4, 0.2, 0.2]]}',
)


@dataclass(frozen=True)
class Target:
    """A kind of file."""

    suffix: str
    kind: str
    """Of the file's name, and how it may be changed."""
    seeds: tuple[bytes, ...]
    read: Callable[[Path], Any]
    """Reads the file of a path."""


@cache
def targets() -> dict[str, Target]:
    """Return all kinds of files by name."""
    robots = [catalog.load(name) for name in ('ur5', 'franka_panda')]
    bags = {storage: _bag(storage) for storage in ('mcap', 'sqlite3')}
    return {
        'robot': Target(
            '.yaml', 'yaml', _encoded(yaml_text(r.to_mapping()) for r in robots), load_robot
        ),
        'urdf': Target('.urdf', 'text', _encoded([URDF, _urdf()]), load_robot),
        'effects': Target(
            '.yaml', 'yaml', _encoded([EFFECTS]), lambda path: read_effects(path, ROBOT)
        ),
        'tolerances': Target(
            '.yaml',
            'yaml',
            _encoded([TOLERANCES]),
            lambda path: tolerances_from_list(read_yaml(path, 'tolerance file'), ROBOT),
        ),
        'table': Target('.csv', 'text', _tables(), lambda path: read_table(path, ROBOT)),
        'diagnosis': Target('.json', 'json', _encoded([_diagnosis()]), _model),
        'path': Target('.yaml', 'yaml', _encoded(PATHS), read_path),
        'points': Target(
            '.csv', 'text', (b'x,y,z\n0.4,0,0.2\n0.5,0.1,0.2\n0.4,0.2,0.2\n',), read_path
        ),
        'mcap': Target('.mcap', 'binary', (bags['mcap'][0],), _read_bag),
        'sqlite3': Target('.db3', 'binary', (bags['sqlite3'][0],), _read_bag),
        'metadata': Target(
            '.yaml', 'yaml', (bags['mcap'][1],), lambda path: _read_listed(path, bags['mcap'][0])
        ),
    }


def _encoded(texts: Any) -> tuple[bytes, ...]:
    return tuple(text.encode() for text in texts)


def _urdf() -> str:
    with tempfile.TemporaryDirectory() as place:
        write_urdf(Path(place) / 'robot.urdf', ROBOT)
        return (Path(place) / 'robot.urdf').read_text(encoding='utf-8')


def _model(path: Path) -> Any:
    return read_diagnosis(path), load_model(ROBOT, path)


def _recording(count: int = 40) -> Recording:
    rng = np.random.default_rng(1)
    t = 0.05 * np.arange(count, dtype=np.float64)
    q: Array = np.array([0.3, -1.2, 1.4, -1.0, -1.5, 0.2]) + 0.2 * rng.standard_normal(
        (count, ROBOT.n)
    )
    motion = JointMotion(t, q)
    still = Recording('sample', motion)
    poses = Twin(ROBOT).poses(still, t)
    return Recording('sample', motion, Measurements(t, poses.position, poses.rotation))


def _tables() -> tuple[bytes, ...]:
    recording = _recording(12)
    assert recording.measured is not None
    rows = np.column_stack([np.degrees(recording.joints.q), recording.measured.position * 1e3])
    header = ','.join([*(f'J{k + 1}' for k in range(ROBOT.n)), 'X [mm]', 'Y [mm]', 'Z [mm]'])
    lines = [header, *(','.join(f'{value:.6f}' for value in row) for row in rows)]
    text = '\n'.join(lines) + '\n'
    return text.encode(), text.replace(',', ';').replace('.', ',').encode()


def _diagnosis() -> str:
    frame = np.eye(4).tolist()
    effects = effects_from_list(parse_yaml(EFFECTS, 'effects'), ROBOT)
    return json.dumps(
        {
            'schema': 'weld_twin/diagnosis/1',
            'model': {
                'tool': frame,
                'bases': [frame],
                'known': [],
                'epochs_ns': [0],
                'spans_ns': [[0, 1]],
                'found': [effect.to_mapping() for effect in effects],
            },
        }
    )


def _bag(storage: str) -> tuple[bytes, bytes]:
    """Return a storage file and its metadata."""
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / 'bag'
        write_recording(path, _recording(), ROBOT, storage=storage)
        file = next(item for item in path.iterdir() if item.suffix != '.yaml')
        return file.read_bytes(), (path / 'metadata.yaml').read_bytes()


def _read_bag(path: Path) -> Any:
    """Read a bag, and recover it whether it reads or not."""
    try:
        recover(path, path.with_name('recovered'))
        read_recording(path.with_name('recovered'), ROBOT)
    except (DataError, ModelError):
        pass
    finally:
        shutil.rmtree(path.with_name('recovered'), ignore_errors=True)
    bag_info(path)
    return read_recording(path, ROBOT)


def _read_listed(path: Path, storage: bytes) -> Any:
    """Read a bag whose metadata is not right."""
    folder = path.with_name('listed')
    folder.mkdir(exist_ok=True)
    try:
        (folder / 'bag.mcap').write_bytes(storage)
        shutil.copy(path, folder / 'metadata.yaml')
        bag_info(folder)
        return read_recording(folder, ROBOT)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
