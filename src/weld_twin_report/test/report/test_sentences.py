# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the report says in words and numbers."""

from dataclasses import replace
from io import StringIO

import diagnoses
import pytest
from rich.console import Console

from weld_twin_core.arm.catalog import load
from weld_twin_core.diagnosis.result import Candidate, Site, Unexplained
from weld_twin_core.diagnosis.verdict.decision import UNEVEN
from weld_twin_core.effects import REGISTRY, effect_from_mapping
from weld_twin_nodes.wording.quantities import (
    millimetres,
    odds,
    parameter_rows,
    percent,
    uncertain,
)
from weld_twin_nodes.wording.verdict import verdict
from weld_twin_nodes.wording.words import cause, in_words, listed
from weld_twin_report.report import print_summary
from weld_twin_report.report.diagnosis_page import _how_much


def plain(text):
    return text.replace('\N{NO-BREAK SPACE}', ' ').replace('\N{MINUS SIGN}', '-')


@pytest.mark.parametrize(
    ('metres', 'text'),
    [
        (4.213e-4, '0.421 mm'),
        (0.0123456, '12.35 mm'),
        (0.0, '0.000 mm'),
        (3e-7, '< 0.001 mm'),
        (None, '\N{EN DASH}'),
        (float('nan'), '\N{EN DASH}'),
    ],
)
def test_lengths_are_told_in_millimetres(metres, text):
    assert plain(millimetres(metres)) == text


@pytest.mark.parametrize(
    ('share', 'text'),
    [(0.0, '0 %'), (0.002, '< 1 %'), (0.93, '93 %'), (0.9999, '> 99 %'), (1.0, '100 %')],
)
def test_a_share_close_to_all_or_nothing_is_not_told_as_such(share, text):
    assert plain(percent(share)) == text


@pytest.mark.parametrize(
    ('value', 'std', 'text'),
    [
        (5.00123e-4, 1.234e-5, '0.500 ± 0.012 mrad'),
        (-0.02, 3e-4, '-20.00 ± 0.30 mrad'),
        (1.2e-3, None, '1.2 mrad'),
        (1.2e-3, 0.0, '1.2 mrad'),
        (0.12, 0.34, '120 ± 340 mrad'),
    ],
)
def test_a_value_has_as_many_digits_as_its_error_allows(value, std, text):
    assert plain(uncertain(value, std, 1e3, 'mrad')) == text


def test_every_effect_of_the_library_has_a_name_in_words():
    titled = {name for name, effect in REGISTRY.items() if effect.traits.title}
    assert titled == set(REGISTRY) - {'measurement_noise'}


def test_what_may_be_the_instrument_or_the_robot_is_not_told_to_be_noise():
    told = diagnoses.nothing()
    assert verdict(told)[1] == 'As far as these data reach, the model is the robot.'
    gap = replace(told.gap, rms_m=0.964e-3, noise_floor_m=0.606e-3)
    first, second = verdict(replace(told, gap=gap, reasons=(UNEVEN,)))
    assert 'differ by 0.964 mm, of which no more than 0.606 mm passes for noise' in plain(first)
    assert second == 'Whether the rest is the robot or the instrument, these data do not tell.'


def test_an_effect_of_the_user_is_named_by_its_own_name():
    assert cause('tooth_wear', 'joint_2') == 'tooth wear of joint_2'


@pytest.mark.parametrize(
    ('names', 'text'),
    [([], ''), (['a'], 'a'), (['a', 'b'], 'a and b'), (['a', 'b', 'c'], 'a, b and c')],
)
def test_lists_read_as_prose(names, text):
    assert listed(names) == text


def test_reasons_are_told_in_words():
    sites = [Site('backlash', 'j1'), Site('backlash', 'j10')]
    told = in_words('backlash of j10, backlash of j1 differ by nothing', sites)
    assert told == 'Backlash of j10, backlash of j1 differ by nothing.'
    assert in_words('base_pose is the same', [Site('base_pose', None)]) == (
        'Base pose error is the same.'
    )


def test_a_vector_is_told_in_one_row():
    tool = effect_from_mapping({'effect': 'tool_pose', 'xyz': [1e-3, 0, -2e-3]})
    rows = parameter_rows(tool, {'xyz': [1e-5, 1e-5, 1e-5]})
    assert plain(rows[0][1]) == 'x 1.000 ± 0.010, y 0.000 ± 0.010, z -2.000 ± 0.010 mm'
    # The flange of this robot is turned by half a turn about x at the end of its rows.
    turned = parameter_rows(tool, {'xyz': [1e-5, 2e-5, 3e-5]}, load('kuka_kr6_r900'))
    assert plain(turned[0][1]) == 'x 1.000 ± 0.010, y 0.000 ± 0.020, z 2.000 ± 0.030 mm'
    none = effect_from_mapping({'effect': 'tool_pose', 'xyz': [1e-6, 0, -2e-6]})
    assert (
        plain(parameter_rows(none, {'xyz': [1e-5] * 3})[0][1]) == '0.000 ± 0.010 mm in x, y and z'
    )


def test_brackets_in_names_do_not_confuse_the_terminal():
    case, out = diagnoses.backlash(), StringIO()
    odd = Candidate(Site('backlash', '[red]axis[/]'), 0.1, 1e-4, 0.5)
    print_summary(replace(case, candidates=(odd, odd)), Console(file=out, width=200))
    assert '[red]axis[/]' in out.getvalue()


def test_no_probability_is_told_as_certain():
    assert plain(odds(1.0)) == '> 99 %'
    assert plain(odds(0.0)) == '< 1 %'
    assert plain(odds(0.6)) == '60 %'


def test_what_remains_beside_a_name_is_not_told_as_above_the_noise_that_is_in_it():
    case = diagnoses.backlash()
    gap = replace(case.gap, noise_floor_m=4.1e-5)
    remains = Unexplained(7.3e-5, above_noise=True)
    told, _ = verdict(replace(case, status='unknown', gap=gap, unexplained=remains))
    words = '0.073 mm remains that no effect in the library explains; measuring noise alone is 0.041 mm'
    assert words in plain(told)


def test_a_share_is_told_of_what_it_is_a_share_of():
    """Frames fitted to other stretches may leave much more than the gap of all."""
    found = diagnoses.backlash()
    more = replace(found.shrink, rms_before_m=2.0 * found.gap.rms_m)
    assert 'of the RMS gap, on data' in _how_much(found)
    said = plain(_how_much(replace(found, shrink=more)))
    assert f'of the {plain(millimetres(2.0 * found.gap.rms_m))} there, on data' in said
