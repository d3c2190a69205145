# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""``weld-twin iso9283`` on bags of an arm whose errors were put in, to the file and to the page."""

import json
import re

import numpy as np
import pytest
from command_line import done, refused, weld_twin
from page_text import flat, page_text

from weld_twin_core import __version__
from weld_twin_core.arm import catalog
from weld_twin_core.arm.chain import forward, jacobian
from weld_twin_core.arm.rotation import rotation_matrix, transform
from weld_twin_core.effects import effects_from_list
from weld_twin_core.motion.paths import default_seam
from weld_twin_core.motion.planned_motion import plan
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.bags import write_recording

ROBOT = catalog.load('ur5')
WIDTH, OFFSET, NOISE = 1.2e-3, 8e-4, 1.5e-5
ELBOW = {'effect': 'backlash', 'joint': 'elbow_joint', 'width': WIDTH}
SHOULDER = {'effect': 'joint_offset', 'joint': 'shoulder_pan_joint', 'offset': OFFSET}
MIDDLE = np.array([0.3, -1.2, 1.5, -1.9, -1.5, 0.2])


def measured(recording, effects, world=None, noise=NOISE, seed=1):
    """Return the recording measured on an arm with these effects, in the tracker's frame."""
    rng = np.random.default_rng(seed)
    t = recording.joints.t[:: 1 if recording.joints.static else 2]
    poses = Twin(ROBOT, effects_from_list(effects, ROBOT)).poses(recording, t)
    world = np.eye(4) if world is None else world
    position = poses.position @ world[:3, :3].T + world[:3, 3]
    position = position + noise * rng.standard_normal(position.shape)
    return recording.with_measured(Measurements(t, position, world[:3, :3] @ poses.rotation))


def bag_of(tmp_path, recording):
    path = tmp_path / 'bag'
    write_recording(path, recording, ROBOT)
    return path


def both_ways(cycles=12):
    """Return stations in which the middle is reached with the elbow rising and falling."""
    low, high = (MIDDLE + np.array([0, 0, turn, 0, 0, 0]) for turn in (-0.2, 0.2))
    once = np.stack([low, MIDDLE, high, MIDDLE])
    q = np.concatenate([high[None] + 0.1, np.tile(once, (cycles, 1))])  # comes from above first
    return Recording('test', JointMotion(20.0 * np.arange(len(q)), q, static=True))


def passes(count=4):
    """Return a seam planned on the arm, gone there and back several times with rests between."""
    one = plan(ROBOT, default_seam(ROBOT, 'line'), 'smooth', fit=True).motion
    step = one.t[1] - one.t[0]
    rest = np.repeat(one.q[:1], 100, axis=0)
    q = np.concatenate([part for _ in range(count) for part in (rest, one.q, one.q[::-1])])
    return Recording('test', JointMotion(step * np.arange(len(q)), q)), one.q


def result(folder):
    return json.loads((folder / 'iso9283.json').read_text())


def test_play_is_the_variation_between_ways_and_noise_the_repeatability(tmp_path):
    bag = bag_of(tmp_path, measured(both_ways(), [ELBOW]))
    said = done('iso9283', bag, '--robot', 'ur5', '--out', tmp_path / 'out')
    found = result(tmp_path / 'out')
    middle = next(p for p in found['poses'] if p['cycles'] == 24)
    lever = np.linalg.norm(jacobian(ROBOT, MIDDLE)[:3, 2])
    assert middle['vap_m'] == pytest.approx(WIDTH * lever, rel=0.03)
    assert middle['approaches'] == 2
    ends = [p for p in found['poses'] if p['cycles'] == 12]
    # mean and deviation of a length of three normal numbers: 1.60 and 0.67 of one of them
    for pose in ends:
        assert pose['rp_m'] == pytest.approx((1.60 + 3 * 0.67) * NOISE, rel=0.5)
        assert pose['ap_m'] == pytest.approx(WIDTH / 2 * lever, rel=0.06)
    assert found['ap_m'] == max(p['ap_m'] for p in found['poses'])
    assert any('12 cycles' in text and '30' in text for text in found['lacking'])
    assert f'{1e3 * middle["vap_m"]:.3f}' in said


def test_the_path_runs_beside_the_commanded_one_by_what_the_shoulder_is_off(tmp_path):
    motion, q = passes()
    bag = bag_of(tmp_path, measured(motion, [SHOULDER], noise=0.0))
    said = done('iso9283', bag, '--robot', 'ur5', '--out', tmp_path / 'out')
    path = result(tmp_path / 'out')['path']
    assert path['cycles'] == 4
    off = q + OFFSET * np.eye(6)[0]
    wanted, there = (forward(ROBOT, rows)[:, :3, 3] for rows in (q, off))
    tangent = np.gradient(wanted, axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-12)
    shift = there - wanted
    across = np.linalg.norm(shift - (shift * tangent).sum(1)[:, None] * tangent, axis=1)
    inner = slice(len(q) // 10, -len(q) // 10)
    assert across[inner].min() * 0.98 < path['at_m'] < across.max() * 1.02
    assert path['rt_m'] < 2e-6
    assert 'm long' in said


def test_an_unknown_tracker_frame_is_noticed_and_can_be_fitted(tmp_path):
    world = transform(rotation_matrix([0.1, -0.2, 2.0]), np.array([2.0, -1.0, 0.5]))
    motion, _ = passes(3)
    bag = bag_of(tmp_path, measured(motion, [], world))
    assert '--align base' in done('iso9283', bag, '--robot', 'ur5', '--out', tmp_path / 'far')
    said = done('iso9283', bag, '--robot', 'ur5', '--align', 'base', '--out', tmp_path / 'out')
    assert result(tmp_path / 'out')['path']['at_m'] < 3 * NOISE
    assert 'fitted to this recording' in said


@pytest.mark.parametrize(
    ('recording', 'options', 'sentence'),
    [
        (
            Recording(
                'once', JointMotion([0.0, 9.0], np.stack([MIDDLE, 0.9 * MIDDLE]), static=True)
            ),
            (),
            'bag repeats neither a pose nor a path: no pose was measured twice, 2 different ones',
        ),
        (
            both_ways(),
            ('--align', 'base,tool'),
            'base and tool cannot be fitted on 4 different poses',
        ),
        (both_ways(), ('--align', 'wrist'), "'wrist' is neither"),
    ],
)
def test_what_cannot_be_told_is_one_sentence(tmp_path, recording, options, sentence):
    bag = bag_of(tmp_path, measured(recording, []))
    said = refused('iso9283', bag, '--robot', 'ur5', *options, '--out', tmp_path / 'out')
    assert sentence in said
    assert not (tmp_path / 'out').exists()


@pytest.mark.parametrize('made', [both_ways, lambda: passes(3)[0]], ids=['poses', 'path'])
def test_page_file_and_terminal_are_as_they_were_kept(tmp_path, kept, request, made):
    bag = bag_of(tmp_path, measured(made(), [ELBOW, SHOULDER]))
    said = weld_twin('iso9283', bag, '--robot', 'ur5', '--out', tmp_path / 'out')
    page = (tmp_path / 'out' / 'report.html').read_text(encoding='utf-8')
    assert not re.findall(r'(?:src|href)\s*=', page) and 'Content-Security-Policy' in page
    file = result(tmp_path / 'out')
    lines = [f'{at} {value}' for at, value in flat(file, '') if 'sha256' not in at]
    text = '\n'.join([page_text(page), said.out, *lines]).replace(str(tmp_path), '')
    digest = re.compile('[0-9a-f]{12,}')
    kept(
        f'iso9283_{request.node.callspec.id}', digest.sub('', text).replace(__version__, 'VERSION')
    )
