# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""True shares follow from how a case was made."""

import numpy as np
import pytest

from weld_twin_lab.belief.judged import true_shares
from weld_twin_lab.blind.blind_cell import deviation, draw_cell, floor, take
from weld_twin_lab.blind.making import SealedCase


def case_of(*offsets, seed=1):
    """Return a case of zero errors [rad] of joints that turn the arm about parallel axes."""
    cell = draw_cell('ur5', 'free', ('joint_offset',), np.random.default_rng(seed))
    ride = take(cell, 'free', 15.0, np.random.default_rng(2))
    causes = [{'effect': 'joint_offset', 'joint': cell.robot.joint_names[k], 'offset': size}
              for k, size in enumerate(offsets, 1)]  # fmt: skip
    return SealedCase(None, cell, causes, [], [], (), ride, ride, ride, False)


def squares(case, causes):
    return (deviation(case.cell, causes, case.train) ** 2).sum(axis=1).mean()


def test_causes_that_overlap_share_what_they_move_together():
    case = case_of(1e-3, 8e-4)
    shares = true_shares(case)
    whole = squares(case, case.causes)
    noise, _ = floor(case.cell, case.causes, case.train)
    assert sum(shares) == pytest.approx(whole / (whole + noise**2), abs=1e-9)
    alone = [squares(case, [cause]) / (whole + noise**2) for cause in case.causes]
    # They turn the arm the same way, so each moves the tool along with the other.
    assert all(share > square + 0.05 for share, square in zip(shares, alone, strict=True))


def test_a_cause_that_cancels_a_part_of_another_has_no_share_and_leaves_it_the_whole():
    case = case_of(1e-3, -2e-4)
    whole = squares(case, case.causes)
    assert whole < squares(case, case.causes[:1])
    first, second = true_shares(case)
    assert second == 0.0
    noise, _ = floor(case.cell, case.causes, case.train)
    assert first == pytest.approx(whole / (whole + noise**2), abs=1e-9)
