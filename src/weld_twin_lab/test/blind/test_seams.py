# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Seams drawn at random: one that passes near a singular posture is drawn again, not planned."""

import numpy as np

from weld_twin_core import PathError, catalog
from weld_twin_lab.blind import blind_cell

SPAN, RATE = 20.0, 50.0


def test_a_seam_that_would_take_too_long_is_drawn_again(monkeypatch):
    refused, plan = [], blind_cell.plan

    def watched(*args, **options):
        try:
            return plan(*args, **options)
        except PathError as error:
            refused.append(str(error))
            raise

    monkeypatch.setattr(blind_cell, 'plan', watched)
    robot = catalog.load('abb_irb120')
    q = blind_cell.seam_motion(robot, SPAN, RATE, np.random.default_rng(3))
    most = round(blind_cell.LONGEST * SPAN * RATE)
    assert any(f'samples, and {most:,} are the most' in sentence for sentence in refused)
    assert 0.5 * SPAN * RATE < len(q) < most
    robot.check_positions(q)
