# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A torch on a soft bracket, against a bar held by hand."""

import numpy as np
import pytest
from plant_cells import UR5, dh_links, dh_positions, record, stations
from scipy.spatial.transform import Rotation

LEVER = np.array([0.0, 0.06, 0.3])
SAG = {'effect': 'tool_sag', 'bend': 1e-3 * np.linalg.norm(LEVER), 'lever': LEVER.tolist()}


def test_a_torch_sags_by_its_bend_where_it_is_level_and_by_nothing_where_it_hangs():
    command = stations(UR5, 12)
    moved = record(UR5, [SAG], command, richness=0.0).position - dh_positions(UR5, command.q)
    world = Rotation.from_quat(UR5['base']['quat_xyzw'])
    held = Rotation.from_quat(UR5['tool']['quat_xyzw'])
    for row, got in zip(command.q, moved, strict=True):
        bar = Rotation.from_matrix(dh_links(UR5, row)[-1][:3, :3]).apply(held.apply(LEVER))
        level = np.hypot(bar[0], bar[1])
        # It turns in the upright plane through the bar, by the share of it that is level.
        down = 1e-3 * level / np.linalg.norm(LEVER)
        aside = world.apply([*(bar[:2] * bar[2] / level), -level])
        assert got == pytest.approx(down * aside, abs=2e-3 * down * np.linalg.norm(LEVER) + 1e-9)


def test_a_flat_bracket_bends_less_about_its_second_axis():
    command = stations(UR5, 12)
    straight = dh_positions(UR5, command.q)
    even, flat = (
        np.linalg.norm(record(UR5, [SAG], command, richness=r).position - straight, axis=1)
        for r in (0.0, 1.0)
    )
    assert (flat < even + 1e-9).all()
    assert flat.min() < 0.8 * even.max()
