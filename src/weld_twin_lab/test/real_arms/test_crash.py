# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Results hold tracebacks without the directories of the machine that made them."""

import weld_twin_core as wt
from weld_twin_lab.real_arms.unseen import traceback_text


def test_files_of_a_traceback_are_told_as_from_their_package_on():
    try:
        wt.load('no robot of this name')
    except Exception:
        told = traceback_text()
    assert (
        'File "weld_twin_core/weld_twin_core/arm/' in told or 'File "weld_twin_core/arm/' in told
    )
    assert str(wt.__file__).rpartition('/weld_twin_core/')[0] not in told
