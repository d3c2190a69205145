# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One trial of the campaign in which recorders are killed."""

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from weld_twin_lab.campaigns.kill import Trial, try_once

pytestmark = pytest.mark.cells


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_a_kill_leaves_a_prefix_of_what_was_sent(storage):
    row = try_once(Trial(storage, moment=1.0, closing=False, split_mb=0.1, wait=0.0))
    assert row['fault'] == ''
    assert row['sent'] > 0
