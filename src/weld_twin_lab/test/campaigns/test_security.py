# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the trial of security calls shown, and the trial itself where it can be made."""

import json
from importlib.util import find_spec

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from weld_twin_core.errors import TwinError
from weld_twin_lab.campaigns.secured import keystore
from weld_twin_lab.campaigns.security import verdict
from weld_twin_nodes.cli.in_process import weld_twin

TOPICS = {'/joint_states': 9, '/twin/tool_pose': 9}
WELL = {'alive': True, 'topics': TOPICS, 'codes': [0, 0]}
OPEN = {'heard': [9, 8, 7, 6], 'recorded': [9, 8, 7, 6], **WELL}
LOCKED = {'heard': [9, 0, 0, 0], 'recorded': [9, 0, 0, 0], **WELL}


def test_security_is_shown_when_strangers_get_through_without_keys_alone():
    assert verdict({'open': OPEN, 'enforced': LOCKED})
    timely = {**OPEN, 'topics': {**TOPICS, '/diagnosis': 1}}
    assert verdict({'open': timely, 'enforced': LOCKED})


@pytest.mark.parametrize(
    ('way', 'change'),
    [
        ('open', {'heard': [9, 0, 7, 6]}),  # the trial itself hears nothing
        ('open', {'recorded': [9, 8, 7, 0]}),
        ('enforced', {'heard': [9, 1, 0, 0]}),
        ('enforced', {'heard': [9, 0, 0, 1]}),
        ('enforced', {'recorded': [9, 1, 0, 0]}),
        ('enforced', {'recorded': [9, 0, 1, 0]}),
        ('enforced', {'recorded': [0, 0, 0, 0]}),
        ('enforced', {'heard': [0, 0, 0, 0]}),  # nobody hears: the policy lets too little through
        ('enforced', {'alive': False}),
        ('enforced', {'codes': [0, 1]}),
        ('enforced', {'topics': {'/joint_states': 9}}),
    ],
)
def test_anything_else_shows_nothing(way, change):
    result = {'open': OPEN, 'enforced': LOCKED}
    assert not verdict({**result, way: {**result[way], **change}})


def test_what_could_not_be_tried_is_not_passed():
    assert not verdict({'open': OPEN, 'reason': 'no keys'})


def test_a_folder_without_the_middleware_is_refused_with_what_to_fetch(tmp_path):
    out = tmp_path / 'security.json'
    code, _, _ = weld_twin(
        'lab', 'campaign', 'security', '--source', str(tmp_path), '--out', str(out)
    )
    assert code == 1
    assert json.loads(out.read_text())['reason'] == (
        f"open: '{tmp_path}' holds no rmw_cyclonedds_cpp: fetch the branch jazzy of "
        'ros2/rmw_cyclonedds and ros2/sros2 into a folder, and give it as --source'
    )


@pytest.mark.skipif(find_spec('sros2') is not None, reason='sros2 is here')
def test_without_what_makes_keys_it_says_so(tmp_path):
    with pytest.raises(
        TwinError, match=r"without sros2: No module named 'sros2'; fetch the branch"
    ):
        keystore(tmp_path / 'keys', tmp_path / 'policy.xml', ['/weld_twin/party'])
    assert not (tmp_path / 'keys').exists()


@pytest.mark.skipif(
    find_spec('sros2') is None,
    reason='sros2 is not here, and no wheel of it: no keys can be made; see --source',
)
def test_strangers_hear_and_say_nothing_under_enforced_security(tmp_path):
    code, printed, _ = weld_twin(
        'lab', 'campaign', 'security', '--out', str(tmp_path / 'security.json')
    )
    result = json.loads((tmp_path / 'security.json').read_text())
    if 'security libraries' in result['reason'] or 'unprotected' in result['reason']:
        pytest.skip(result['reason'])
    assert code == 0, printed
