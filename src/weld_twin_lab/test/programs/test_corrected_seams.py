# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Seams that are corrected with sealed causes: what is drawn, how it is judged, what is counted."""

import numpy as np
import pytest

from weld_twin_core.arm.catalog import load
from weld_twin_lab.programs.corrections import counted, page, path_accuracy, totals
from weld_twin_lab.programs.plain import driven, tool_pose
from weld_twin_lab.programs.sealed_seams import CELLS, robots_of


def seam(after, outcome='corrected', language='krl', before=2e-4, true=1e-5):
    return {
        'language': language,
        'robot': 'kuka_kr16_2',
        'kind': 'single',
        'causes': [{'effect': 'joint_offset', 'joint': 'joint_a2', 'offset': 1e-3}],
        'seam': 'line',
        'status': 'identified',
        'outcome': outcome,
        'why': '' if outcome == 'corrected' else 'seam.src line 9: the model is less sure',
        'at_m': {'before': before, 'after': after, 'true': true},
        'rms_m': {'before': before, 'after': after, 'true': true},
        'off_m': {'before': (before, before), 'after': (after, after)},
    }


def test_a_seam_made_worse_counts_as_worse_and_one_left_as_it_was_does_not():
    cases = [seam(1.1e-5), seam(2.02e-4), seam(2e-4, 'left'), {'language': 'krl', 'undrawn': '-'}]
    told = counted(cases)
    assert (told['cases'], told['undrawn'], told['worse']) == (3, 1, 1)
    assert (told['corrected'], told['left'], told['refused']) == (2, 1, 0)
    assert told['ratio']['median'] == pytest.approx(20.0)
    assert told['ratio_of_corrected']['worst'] == pytest.approx(20.2)


def test_the_table_tells_languages_apart_and_names_the_worsened_seam():
    cases = [seam(1.2e-5), seam(3e-4, language='csv'), seam(2e-4, 'left', 'csv')]
    found = totals(cases)
    assert (found['krl']['worse'], found['csv']['worse'], found['all']['worse']) == (0, 1, 1)
    text = page({'seed': 1, 'totals': found, 'cases': cases})
    assert text.count('corrected, worse than before') == 1
    assert '| the model is less sure | 1 |' in text


def test_a_plain_controller_tells_when_its_moves_end_and_where_it_believes_the_tool():
    robot, start = load('ur5'), np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
    first = tool_pose(robot, start, np.array(robot.T_flange_tool))
    places = [first + _shift(0.0, 0.1, 0.0), first + _shift(0.05, 0.1, 0.0)]
    moves = [('movej', [start]), *(('movel', [place]) for place in places)]
    made = driven(robot, moves, start, 0.02)
    np.testing.assert_allclose(made.ends, [0.0, 5.1, 7.7], atol=1e-6)
    wanted = first[:3, 3] + np.array([[0.0, 0.05, 0.0], [0.025, 0.1, 0.0]])
    np.testing.assert_allclose(made.believed(np.array([2.6, 6.35])), wanted, atol=1e-5)
    # No arm has its speed at once: what its joints give would throw the tool off.
    speed = np.linalg.norm(np.diff(made.tool, axis=0), axis=1) / np.diff(made.clock)
    assert max(speed[0], speed[-1], np.abs(np.diff(speed)).max()) < 0.0015


def _shift(*way):
    out = np.zeros((4, 4))
    out[:3, 3] = way
    return out


@pytest.mark.parametrize('language', CELLS)
def test_robots_take_turns_and_causes_differ(language):
    pytest.importorskip('mujoco', reason='the plant needs MuJoCo')
    from weld_twin_lab.programs.sealed_seams import lot_of

    lots = [lot_of(language, 5, number) for number in range(8)]
    assert {lot.robot for lot in lots[: len(robots_of(language))]} <= set(robots_of(language))
    assert len({lot.robot for lot in lots}) == min(8, len(robots_of(language)))
    assert len({(lot.families, lot.strata) for lot in lots}) > 4
    assert {lot.kind for lot in lots} <= {'single', 'double', 'triple'}
    assert lots != [lot_of(language, 6, number) for number in range(8)]


def test_path_accuracy_is_square_to_the_path_and_blind_to_being_late():
    along = np.linspace(0.0, 0.2, 41)
    wanted = np.stack([along, 0.0 * along, 0.0 * along], axis=1)
    late = np.linspace(-0.01, 0.199, 400)
    off = np.stack([late, np.full(400, 3e-4), np.where(late > 0.1, 4e-4, 0.0)], axis=1)
    found = path_accuracy(off, wanted)
    # The end is not passed: there the nearest place counts, a millimetre before it.
    assert found.at == pytest.approx(np.sqrt(1e-6 + 25e-8), rel=1e-3)
    assert path_accuracy(off[:-1], wanted[:-1]).at == pytest.approx(5e-4, rel=1e-6)
