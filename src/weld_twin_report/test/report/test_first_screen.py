# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The first screen answers what a fitter asks first, without what misled one; no word is broken."""

import diagnoses
import pytest
from rich.console import Console

from weld_twin_core.effects import effect_from_mapping
from weld_twin_nodes.wording.quantities import in_short, short_rows
from weld_twin_report.report import print_summary
from weld_twin_report.report.charts import furthest
from weld_twin_report.report.controllers import correction
from weld_twin_report.report.to_do import warned


def test_a_flat_curve_is_the_same_everywhere():
    flat = {'effect': 'joint_curve', 'joint': 'j', 'over': 'direction', 'knots': [-1.0, 1.0]}
    told = [furthest(effect_from_mapping({**flat, 'values': values}))
            for values in ([-5e-4, -4.99e-4], [-5e-4, 1e-4])]  # fmt: skip
    assert told == ['-0.0286° everywhere', 'up to 0.0286° going backward']


@pytest.mark.parametrize(
    ('value', 'std', 'told'),
    [
        (0.028651, 0.00025, '0.0287 ± 0.0003°'),
        (0.063025, 0.000081, '0.0630 ± 0.0001°'),
        (0.5, 0.2, '0.500 ± 0.200°'),
        (-12.345, None, '\N{MINUS SIGN}12.3°'),
    ],
)
def test_a_value_has_the_digits_of_the_action_beside_it(value, std, told):
    assert in_short(value, std, 1.0, '°') == told


def test_of_a_frame_only_the_axes_that_count_are_told():
    base = effect_from_mapping({'effect': 'base_pose', 'xyz': [0, 0, 0], 'rotvec': [0, 0, 6e-4]})
    assert short_rows(base, {'xyz': [5e-6] * 3, 'rotvec': [2e-6] * 3}) == [
        ('rotvec', 'z 0.0344 ± 0.0001°')
    ]


def test_without_a_maker_it_is_told_what_takes_the_correction():
    zero = effect_from_mapping({'effect': 'joint_offset', 'joint': 'j', 'offset': 1e-3})
    gear = effect_from_mapping({'effect': 'gear_ratio', 'joint': 'j', 'scale': 1e-3})
    assert correction(zero, None).startswith('As the zero of this axis')
    assert 'correct the points of the program' in correction(gear, None)


def test_what_not_to_do_stands_out():
    told = ''.join(map(str, warned('Turn 0.5 deg. Do not correct programs by its curve: 0.1 mm.')))
    assert told == ('Turn 0.5°. <strong>Do not correct programs by its curve: 0.1 mm.</strong>')
    assert warned('Turn.') == ['Turn.']


@pytest.fixture(scope='module', params=[diagnoses.backlash, diagnoses.unknown])
def made(request):
    return request.param()


@pytest.mark.parametrize('width', [40, 80, 140])
def test_no_word_is_broken(made, width, capsys):
    wide, narrow = (Console(highlight=False, width=w) for w in (400, width))
    print_summary(made, wide)
    whole = set(capsys.readouterr().out.split())
    print_summary(made, narrow)
    shown = capsys.readouterr().out
    assert max(map(len, shown.splitlines())) <= width
    heads = {f'{word}:' for word in whole} | {'error:'}
    assert [word for word in shown.split() if word not in whole | heads] == []
