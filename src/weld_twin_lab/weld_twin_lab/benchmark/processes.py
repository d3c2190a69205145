# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a process of its own costs: starting, a million poses, an hour of bag."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.chain import forward
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_msgs_py.bags import write_recording

from .arms import smooth_motion

JOINT_RATE, POSE_RATE = 125.0, 60.0
"""Hz: those of a UR controller and of a camera system."""
STARTS = 7
"""Starts of a process of which the median counts."""
COMMANDS = {
    'python': ['-c', 'pass'],
    'import numpy': ['-c', 'import numpy'],
    'import weld_twin_core': ['-c', 'import weld_twin_core'],
    'weld-twin --help': ['-m', 'weld_twin_nodes', '--help'],
}
_PEAK = """
def memory(key):  # getrusage would count the parent's memory too
    lines = open('/proc/self/status').read().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith(key))
"""
_MEMORY = (
    _PEAK
    + """
import json, sys
import numpy as np
from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.chain import forward
count = int(sys.argv[1])
robot, q = load('ur5'), np.random.default_rng(0).random((count, 6))
q *= 6.0
q -= 3.0
forward(robot, q[:6000])
before = memory('VmRSS')
poses = forward(robot, q)
print(json.dumps({'poses': count, 'bytes': memory('VmHWM') - before - poses.nbytes}))
"""
)
_BAG = (
    _PEAK
    + """
import json, sys, time
import numpy as np
from weld_twin_core.arm.catalog import load
from weld_twin_core.metrics.deviation import deviation
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.bags import read_recording
robot = load('ur5')
start = time.process_time()
recording = read_recording(sys.argv[1], robot)
read = time.process_time()
measured = recording.measured
off = measured.position - Twin(robot).poses(recording, measured.t).position
rms = float(np.sqrt((deviation(off) ** 2).mean()))
done = time.process_time()
print(json.dumps({
    'joint_states': recording.joints.t.size, 'poses': measured.t.size, 'read_s': read - start,
    'compare_s': done - read, 'peak_bytes': memory('VmHWM'), 'rms_m': rms,
}))
"""
)


def starts() -> dict[str, float]:
    """Return the median processor seconds that starting takes."""
    found: dict[str, list[float]] = {name: [] for name in COMMANDS}
    for _ in range(STARTS):
        for name, words in COMMANDS.items():
            before = _children()
            _run(words)
            found[name].append(_children() - before)
    return {name: float(np.median(values)) for name, values in found.items()}


def memory(count: int) -> dict[str, Any]:
    """Return the peak memory of many poses above what goes in and comes out [bytes]."""
    return _said(['-c', _MEMORY, str(count)])


def bag(minutes: float) -> dict[str, Any]:
    """Return what reading a bag, aligning its clocks and comparing with the twin takes."""
    robot = load('ur5')
    t = np.arange(round(minutes * 60.0 * JOINT_RATE)) / JOINT_RATE
    at = 0.003 + np.arange(round(minutes * 60.0 * POSE_RATE)) / POSE_RATE
    way = smooth_motion(robot, 2)[0] + 0.3 * np.sin(t[:, None] * np.arange(1.0, 7.0) / 5.0)
    motion = JointMotion(t, way)
    poses = forward(robot, motion.at(at)[0])
    measured = Measurements(at, poses[:, :3, 3], poses[:, :3, :3])
    with TemporaryDirectory() as folder:
        path = Path(folder) / 'bag'
        write_recording(path, Recording('hour', motion, measured), robot)
        return {'minutes': minutes, **_said(['-c', _BAG, str(path)])}


def _said(words: list[str]) -> dict[str, Any]:
    said: dict[str, Any] = json.loads(_run(words))
    return said


def _run(words: list[str]) -> str:
    here = {**os.environ, 'PYTHONPATH': os.pathsep.join(filter(None, sys.path))}
    done = subprocess.run(
        [sys.executable, *words], env=here, capture_output=True, text=True, check=False
    )
    if done.returncode:
        reason = done.stderr.strip().splitlines() or ['no reason given']
        raise DataError(f'a process of the benchmark ended with {done.returncode}: {reason[-1]}')
    return done.stdout


def _children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
