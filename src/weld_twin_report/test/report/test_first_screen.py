# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The first screen answers what a fitter asks first, and what misled a reader once does so no more."""

from __future__ import annotations

import re
from dataclasses import replace

import diagnoses
import pytest

from weld_twin_core.arm.catalog import load
from weld_twin_core.diagnosis.result import Candidate, Site
from weld_twin_core.effects import effect_from_mapping
from weld_twin_nodes.wording.mending import left_with
from weld_twin_nodes.wording.quantities import in_short, short_rows
from weld_twin_report.report import report_page
from weld_twin_report.report.acceptance import Demand
from weld_twin_report.report.answer import Answer
from weld_twin_report.report.charts import furthest
from weld_twin_report.report.controllers import correction
from weld_twin_report.report.diagnosis_page import Sheet
from weld_twin_report.report.footing import next_section, parts_what
from weld_twin_report.report.to_do import warned, worth_doing

CIRCLE = diagnoses.circle()


def plain(text):
    return re.sub(r'\s+', ' ', re.sub('<[^>]+>', ' ', text))


def nameless(over, **changes):
    """Return a gap that a curve of one joint over something stands for."""
    robot = load('kuka_kr6_r900')
    curve = {'effect': 'joint_curve', 'joint': 'joint_a3', 'over': over,
             'values': [4e-4] if over == 'constant' else [-4e-4, 4e-4],
             'knots': [0.0] if over == 'constant' else [-1.0, 1.0]}  # fmt: skip
    seam = [diagnoses.moving(robot, 'circle')]
    case = diagnoses.diagnosis('unknown', robot, [curve], [curve], seam, effects=())
    return replace(case, causes=(replace(case.causes[0], **changes),))


def test_the_first_screen_answers_the_ten_tasks():
    page = report_page(CIRCLE, sheet=Sheet(Demand(5e-4)))
    top = page[page.index('id="verdict"') : page.index('id="acceptance"')]
    left = left_with(CIRCLE, (0,))
    for told in (
        'How far off', 'At the worst spot', 'after the start', 'May we weld with it', 'fails',
        'Left with all mended', 'How sure', '97 %', 'Were the data good', '1 warning (outliers)',
        '1. Backlash of joint_a3', 'play 0.0458', '97 % that it is backlash of joint_a3',
        f'{1e3 * left.rms_after:.3f} mm RMS, {1e3 * left.largest_after:.3f} mm at most',
        'Nothing to enter', 'All mended',
    ):  # fmt: skip
        assert told in plain(top)


def test_every_combination_of_three_causes_stands_in_the_table():
    page = report_page(CIRCLE, sheet=Sheet(Demand(5e-4)))
    rows = plain(page[page.index('<table class="acceptance"') : page.index('ISO 14253')])
    assert rows.count('mended:') == 7 and 'only 1. backlash of joint_a3 and 3. servo' in rows


def test_of_dependences_that_fit_alike_both_are_looked_at():
    case = nameless('direction', dependence=(('load', 0.35), ('angle', 0.35), ('time', 0.2)))
    (first, *_) = worth_doing(case)
    assert 'first at what yields (gear, bearing, mount); then at gear and encoder' in first
    assert 'depends on the load or the angle' in first
    assert '70 % that it depends on the load or the angle' in plain(report_page(case))


def test_a_constant_without_a_name_has_a_value():
    page = plain(report_page(nameless('constant', dependence=(('constant', 0.9),))))
    assert 'By how much off by 0.0229° everywhere' in page


def test_a_flat_curve_is_the_same_everywhere():
    flat = {'effect': 'joint_curve', 'joint': 'j', 'over': 'direction', 'knots': [-1.0, 1.0]}
    told = [furthest(effect_from_mapping({**flat, 'values': values}))
            for values in ([-5e-4, -4.99e-4], [-5e-4, 1e-4])]  # fmt: skip
    assert told == ['-0.0286° everywhere', 'up to 0.0286° going backward']


@pytest.mark.parametrize(
    ('one', 'other', 'told'),
    [
        (('joint_curve', 'j2', 'speed'), ('joint_curve', 'j3', 'speed'),
         'It tells something at j2 from something at j3.'),
        (('joint_curve', 'j2', 'speed'), ('joint_curve', 'j2', 'load'),
         'It shows whether it is something at j2 that depends on the speed or something at j2 that '
         'depends on the load.'),
        (('backlash', 'j2', 'direction'), ('joint_curve', 'j3', 'speed'),
         'It shows whether it is backlash of j2 or something at j3.'),
    ],
)  # fmt: skip
def test_a_measurement_is_told_by_what_it_parts(one, other, told):
    sides = [[{'effect': e, 'joint': at, 'at': at, 'on': on}] for e, at, on in (one, other)]
    wanted = {'between': sides, 'reason': 'by 22 standard deviations', 'promise': 0.48}
    assert parts_what(wanted) == told
    page = plain(next_section(Answer(replace(CIRCLE, next_experiment=wanted))))
    assert (
        told in page
        and 'Chance that it decides 48 %' in page
        and 'standard deviations' not in page
    )


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


def test_what_imitates_an_unknown_cause_says_nothing_of_it():
    robot = load('kuka_kr6_r900')
    play = {'effect': 'backlash', 'joint': 'joint_a3', 'width': 8e-4}
    lag = {'effect': 'servo_lag', 'joint': 'joint_a3', 'time_constant': 5e-4}
    seam = [diagnoses.moving(robot, 'circle')]
    case = diagnoses.diagnosis('unknown', robot, [play], [lag], seam, effects=())
    own = replace(case.causes[0], name=((Site('joint_curve', 'joint_a3'), 0.9),))
    case = replace(case, causes=(own,), contributions=None)
    page = plain(report_page(case))
    assert 'trails by' not in page and 'Nothing to enter' not in page
    # It helps on data that were not fitted, so it may be used, whatever it is.
    assert 'Programs corrected by what fits best' in page and 'corrected robot' not in page
    useless = replace(case, shrink=replace(case.shrink, ratio=1.0))
    assert 'Nothing can be corrected yet' in plain(report_page(useless))
    assert 'with that mended' not in page
    assert 'Left with what fits best' in page and 'with this mended' not in page
    assert 'comes mostly from joint_a3' in page and 'Look at joint_a3' in page
    # Nothing can be thought mended, so the table has the gap of the headline alone.
    gap = f'{1e3 * case.gap.rms_m:.3f} mm'
    assert re.search(rf'as it is, worst at [\d.]+ s {gap} ', page) and 'mended:' not in page


def test_a_gear_ratio_has_degrees_and_no_two_minds_about_the_controller():
    robot = load('abb_irb1600')
    gear = {'effect': 'gear_ratio', 'joint': robot.joint_names[1], 'scale': 1.2e-3}
    seam = [diagnoses.moving(robot)]
    page = plain(report_page(diagnoses.diagnosis('identified', robot, [gear], [gear], seam)))
    assert 'off by 0.108° in every 90°' in page and 'has no field for it' not in page
    assert 'Where the controller has a field for ratios of gears' in page
    assert 'divided by it where it is turns of the motor per turn of the joint' in page


def test_the_circle_has_a_key():
    page = report_page(CIRCLE)
    key = plain(page[page.index('class="key"') : page.index('id="where"')])
    for told in ('as it is', 'with what is ticked mended', 'the commanded circle', 'turns back'):
        assert told in key


def test_bars_of_rivals_have_one_scale():
    rivals = [
        Candidate(Site(name, 'joint_a1'), p, 1e-4, shrink)
        for name, p, shrink in (('servo_lag', 0.9, 0.8), ('friction', 0.1, 0.5),
                                ('joint_offset', 1.0, 0.2))
    ]  # fmt: skip
    page = report_page(replace(CIRCLE, candidates=tuple(rivals)))
    bars = page[page.index('Candidates against each other') : page.index('cannot tell apart')]
    assert re.findall(r'width:([\d.]+)%', bars) == ['20.00', '50.00', '80.00']


def test_what_not_to_do_stands_out():
    told = ''.join(map(str, warned('Turn 0.5 deg. Do not correct programs by its curve: 0.1 mm.')))
    assert told == ('Turn 0.5°. <strong>Do not correct programs by its curve: 0.1 mm.</strong>')
    assert warned('Turn.') == ['Turn.']
