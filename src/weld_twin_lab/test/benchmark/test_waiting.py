# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The table of waits: whole commands, timed from outside."""

import pytest

from weld_twin_core.errors import DataError
from weld_twin_lab.benchmark.waiting import measured, summary


def quiet(text):
    """Say nothing."""


def test_a_command_is_timed_and_told(tmp_path):
    (entry,) = measured(None, tmp_path, 1, ['--help'], quiet)
    cost = entry['here']
    assert 0.0 < cost['cpu'] < 5.0
    assert cost['wall'] > 0.0
    assert cost['peak'] > 5e6
    assert '`weld-twin --help`' in summary([entry])


def test_a_checkout_without_an_environment_is_refused(tmp_path):
    with pytest.raises(DataError, match='run make setup'):
        measured(tmp_path, tmp_path, 1, [], quiet)


def test_a_job_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(DataError, match='no job is called tea'):
        measured(None, tmp_path, 1, ['tea'], quiet)
