# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Every kind of file the program reads, with samples that are right."""

from __future__ import annotations

import json
import re
import shutil
import tempfile
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import yaml

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
    suffix: str
    kind: str
    """Of the file's name, and how it may be changed."""
    seeds: tuple[bytes, ...]
    read: Callable[[Path], Any]
    """Reads the file of a path."""


@cache
def targets() -> dict[str, Target]:
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
        'tolerances': Target('.yaml', 'yaml', _encoded([TOLERANCES]), _tolerances),
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


def _tolerances(path: Path) -> Any:
    return tolerances_from_list(read_yaml(path, 'tolerance file'), ROBOT)


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
    model = {'tool': frame, 'bases': [frame], 'known': [], 'epochs_ns': [0], 'spans_ns': [[0, 1]]}
    model['found'] = [effect.to_mapping() for effect in effects]
    return json.dumps({'schema': 'weld_twin/diagnosis/1', 'model': model})


def _bag(storage: str) -> tuple[bytes, bytes]:
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
    folder = path.with_name('listed')
    folder.mkdir(exist_ok=True)
    try:
        (folder / 'bag.mcap').write_bytes(storage)
        shutil.copy(path, folder / 'metadata.yaml')
        bag_info(folder)
        return read_recording(folder, ROBOT)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


NUMBERS = (
    *b'nan .nan inf -.inf 1e308 -1e308 1e-320 0 -0.0 -1'.split(),
    *(b'', b'1e999', b'9223372036854775808', b'1' * 400, b'0x10', b'1_000', b'12:30:45'),
    *(b'1,5', b'~'),
)
"""What may stand in the place of a number: none, endless, huge, and no number at all."""
VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1.5, 1e308, -1e308, 1e-320, float('nan'), float('inf'), 10**30),
    *('', 'x', 'nan', 'x' * 3000, '\x00', '\U0001f600'),
    *([], {}, [[]], [1, 2], [None] * 3, {'x': 1}, {'': {}}, [[1.0] * 4] * 4, ['a', 1, None]),
)
SIZES = (0, 1, 0x7F, 0xFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 2**40, 2**62, 2**63 - 1, 2**64 - 1)
"""What may stand in the place of a length: ends of the ranges of integers."""
_NUMBER = re.compile(rb'-?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?')
_WORD = re.compile(rb'[A-Za-z_]{3,}')
_DEEP = 3000
"""Brackets put before; three times as deep as Python's own limit of calls."""

Change = Callable[[Random, bytes], bytes]


def mutate(rng: Random, seed: bytes, kind: str) -> bytes:
    """Return a seed with a few things wrong: 'binary' never as text, 'yaml' and 'json' also as trees."""
    if kind in ('yaml', 'json') and rng.random() < 0.5:
        return _tree(rng, seed, kind)
    changes = _BINARY if kind == 'binary' else _TEXT + _BINARY[:3]
    out = seed
    for _ in range(rng.choice((1, 1, 1, 2, 3, 6))):
        out = rng.choice(changes)(rng, out)
    return out


def _tree(rng: Random, seed: bytes, kind: str) -> bytes:
    data = yaml.safe_load(seed) if kind == 'yaml' else json.loads(seed)
    for _ in range(rng.choice((1, 1, 2, 3))):
        places = _places(data)
        if not places or rng.random() < 0.03:
            data = rng.choice(VALUES)
            continue
        holder, key = rng.choice(places)
        other, name = rng.choice(places)
        if rng.random() < 0.15:
            del holder[key]
        else:
            holder[key] = deepcopy(other[name] if rng.random() < 0.2 else rng.choice(VALUES))
    text = yaml_text(data) if kind == 'yaml' else json.dumps(data)
    return text.encode('utf-8', 'surrogatepass')


def _places(data: Any) -> list[tuple[Any, Any]]:
    if not isinstance(data, dict | list):
        return []
    items = list(data.items() if isinstance(data, dict) else enumerate(data))
    return [place for key, value in items for place in ((data, key), *_places(value))]


def _span(rng: Random, data: bytes) -> tuple[int, int]:
    start = rng.randrange(len(data) + 1)
    return start, min(len(data), start + rng.choice((1, 4, 16, 100, 1000)))


def _flip(rng: Random, data: bytes) -> bytes:
    if not data:
        return data
    out = bytearray(data)
    for _ in range(rng.choice((1, 1, 4, 32))):
        out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
    return bytes(out)


def _cut(rng: Random, data: bytes) -> bytes:
    start, end = _span(rng, data)
    return data[:start] + (b'' if rng.random() < 0.5 else data[end:])


def _repeat(rng: Random, data: bytes) -> bytes:
    start, end = _span(rng, data)
    return data[:end] + data[start:end] * rng.choice((1, 2, 50)) + data[end:]


def _size(rng: Random, data: bytes) -> bytes:
    width = rng.choice((2, 4, 8))
    start = rng.randrange(max(1, len(data) - width))
    value = rng.choice(SIZES) % (1 << 8 * width)
    field = value.to_bytes(width, rng.choice(('little', 'big')))
    return data[:start] + field + data[start + width :]


def _zero(rng: Random, data: bytes) -> bytes:
    start, end = _span(rng, data)
    return data[:start] + bytes(end - start) + data[end:]


def _replace(rng: Random, data: bytes, pattern: re.Pattern[bytes], by: bytes | None) -> bytes:
    matches = list(pattern.finditer(data))
    if not matches:
        return data
    place = rng.choice(matches)
    new = rng.choice(matches).group() if by is None else by
    return data[: place.start()] + new + data[place.end() :]


def _number(rng: Random, data: bytes) -> bytes:
    return _replace(rng, data, _NUMBER, rng.choice(NUMBERS))


def _word(rng: Random, data: bytes) -> bytes:
    return _replace(rng, data, _WORD, None)


def _line(rng: Random, data: bytes) -> bytes:
    lines = data.split(b'\n')
    k, m = rng.randrange(len(lines)), rng.randrange(len(lines))
    if rng.random() < 0.5:
        lines[k], lines[m] = lines[m], lines[k]
    else:
        lines[k:k] = [lines[m]] * rng.choice((1, 30))
    return b'\n'.join(lines)


def _deep(rng: Random, data: bytes) -> bytes:
    start = rng.randrange(len(data) + 1)
    opening = rng.choice((b'[', b'{', b'- ', b'"', b'<link>', b'!!'))
    return data[:start] + opening * _DEEP + data[start:]


_BINARY: tuple[Change, ...] = (_flip, _cut, _repeat, _size, _zero)
_TEXT: tuple[Change, ...] = (_number, _number, _number, _word, _word, _line, _deep)
