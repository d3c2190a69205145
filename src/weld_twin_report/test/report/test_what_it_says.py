# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the sheet says holds together: one figure for one thing, and what is not known is said."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import diagnoses
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.robot import Robot
from weld_twin_core.diagnosis.result import Candidate, Check, Site, Where
from weld_twin_core.effects import effect_from_mapping
from weld_twin_core.metrics.conformity import Rule
from weld_twin_nodes.wording.mending import left_without
from weld_twin_nodes.wording.quantities import counted
from weld_twin_nodes.wording.verdict import verdict
from weld_twin_report.report import report_page
from weld_twin_report.report.acceptance import Demand
from weld_twin_report.report.answer import Answer
from weld_twin_report.report.controllers import correction
from weld_twin_report.report.diagnosis_files import diagnosis_text
from weld_twin_report.report.diagnosis_page import Sheet
from weld_twin_report.report.page_data import components, sides_words
from weld_twin_report.report.to_do import worth_doing

PLAY = diagnoses.backlash()
CIRCLE = diagnoses.circle()


def plain(text):
    return re.sub(r'\s+', ' ', re.sub('<[^>]+>', ' ', text))


def part(page, start, end):
    return plain(page[page.index(start) : page.index(end)])


@pytest.mark.parametrize(
    ('confidence', 'said'),
    [(0.28, 'Partly identified'), (0.5, 'Identified'), (None, 'Identified')],
)
def test_an_answer_that_is_rather_wrong_as_a_whole_is_not_called_identified(confidence, said):
    assert Answer(replace(PLAY, status='identified', confidence=confidence)).status == said


def unknown(size):
    """Return play that a curve over the angle stands for, by so much at the ends of the angle."""
    robot = load('kuka_kr6_r900')
    seam = [diagnoses.moving(robot, 'circle')]
    ends = [float(end(seam[0].joints.q[:, 2])) for end in (np.min, np.max)]
    play = {'effect': 'backlash', 'joint': 'joint_a3', 'width': 8e-4}
    curve = {'effect': 'joint_curve', 'joint': 'joint_a3', 'values': [-size, size], 'knots': ends}
    case = diagnoses.diagnosis('unknown', robot, [play], [curve], seam, effects=())
    cause = replace(
        case.causes[0], dependence=(('direction', 0.8),), share=0.97, share_ci90=(0.7, 1.0)
    )
    return replace(case, causes=(cause,))


def test_of_an_unknown_cause_one_share_and_one_figure_of_what_is_left_are_told():
    case = unknown(1e-4)
    first, second = map(plain, verdict(case))
    assert '97 %' not in first and 'depending on the direction of motion' in first
    assert '%' not in second and 'on data not used for fitting' in second
    page = report_page(case)
    bar = part(page, 'bars wide shares', 'class="cards"')
    assert '97 % (70 to 100 %)' in bar and 'curve' not in bar
    card = part(page, 'class="cards"', 'id="seam"')
    left = left_without(case, 0)
    told = re.search(r'If only this is mended RMS \w+ from [\d.]+ mm to ([\d.]+) mm', card)
    assert float(told[1]) == pytest.approx(1e3 * left.rms_after, abs=6e-4)
    assert 'programs corrected by the curve' in card and 'so it takes off less' in card


def test_what_holds_less_than_half_is_never_told_as_most():
    case = unknown(1e-4)
    small, other = (
        replace(case.causes[0], share=0.3),
        replace(case.causes[0], share=0.6, members=()),
    )
    other = replace(other, place=(('joint_a5', 0.8),), dependence=(('constant', 0.9),))
    first, _ = verdict(replace(case, causes=(small, other), contributions=None))
    assert 'mostly' not in first and 'in part from joint_a5, and is constant there' in first


def test_of_several_curves_at_a_place_the_one_furthest_off_is_drawn():
    robot = load('kuka_kr6_r900')
    seam = [diagnoses.moving(robot, 'circle')]
    curve = {'effect': 'joint_curve', 'joint': 'joint_a3', 'knots': [-1.0, 1.0]}
    small, large = ({**curve, 'over': over, 'values': [-size, size]}
                    for over, size in (('speed', 5e-5), ('direction', 4e-4)))  # fmt: skip
    case = diagnoses.diagnosis('unknown', robot, [large], [small, large], seam, effects=())
    both = replace(case.causes[0], members=(0, 1))
    page = report_page(replace(case, causes=(both,)))
    assert 'joint_a3: how far off by direction' in page and 'far off by speed' not in page


def test_a_place_that_is_not_likelier_than_not_is_never_told_alone():
    case = unknown(1e-4)
    places = (('joint_a5', 0.29), ('joint_a6', 0.29), ('joint_a4', 0.28))
    cause = replace(case.causes[0], place=places, dependence=(('constant', 0.33),))
    case = replace(case, causes=(cause,))
    told = 'joint_a5 or joint_a6'
    assert f'comes mostly from {told};' in verdict(case)[0]
    assert (
        f'Look at {told}, first at zeros and frames: what is found there is constant'
        in (worth_doing(case)[0])
    )
    assert f'that it sits at {told}.' in report_page(case)


def test_what_takes_most_off_unseen_data_leads_though_another_place_has_the_larger_share():
    two = [{'effect': 'servo_lag', 'joint': f'joint_a{k}', 'time_constant': t}
           for k, t in ((2, 6e-3), (3, 1e-3))]  # fmt: skip
    robot = load('kuka_kr6_r900')
    case = diagnoses.diagnosis('identified', robot, two, two, [diagnoses.moving(robot, 'circle')])
    causes = [replace(c, share=share, name=())
              for c, share in zip(case.causes, (0.33, 0.66), strict=True)]  # fmt: skip
    case = replace(case, causes=tuple(causes[::-1]), effects=(), status='unknown',
                   contributions=replace(case.contributions, parts=tuple(
                       p[::-1] for p in case.contributions.parts)))  # fmt: skip
    assert worth_doing(case)[0].startswith('Look at joint_a2, first at gains and feed-forward')


@pytest.mark.parametrize('size', [-8e-4, 1e-4])
def test_a_curve_that_makes_the_worst_spot_worse_is_never_advised(size):
    case = unknown(size)
    worse = left_without(case, 0)
    told = ' '.join(worth_doing(case))
    assert ('Do not correct programs by its curve' in told) is (
        worse.largest_after > 1.02 * worse.largest or worse.rms_after > 1.005 * worse.rms
    )
    assert 'Look at joint_a3, first at gear, belt and bearing' in told
    if size < 0.0:
        card = part(report_page(case), 'class="cards"', 'id="seam"')
        assert 'the curve makes the worst spot worse' in card and 'can be corrected' not in card


def test_what_is_left_counts_in_no_curve_that_is_advised_against():
    robot = load('kuka_kr6_r900')
    seam = [diagnoses.moving(robot, 'circle')]

    def curves(*sizes):
        return [{'effect': 'joint_curve', 'joint': f'joint_a{k}', 'values': [size, size],
                 'knots': [-4.0, 4.0]} for k, size in zip((2, 3), sizes, strict=True)]  # fmt: skip

    case = diagnoses.diagnosis(
        'unknown', robot, curves(6e-4, 2e-4), curves(6e-4, -8e-4), seam, effects=()
    )
    joints = [cause.place[0][0] for cause in case.causes]
    good = joints.index('joint_a2')
    left = left_without(case, good)
    second = plain(verdict(case)[1])
    assert f'by the curve of joint_a2 alone, {1e3 * left.rms:.3f} mm' in second
    assert f'shrinks to {1e3 * left.rms_after:.3f} mm' in second
    page = plain(report_page(case))
    assert f'Left with only cause {good + 1} mended {1e3 * left.rms_after:.3f} mm' in page
    assert (
        'without the entries of joint_a3 under found' in page
        and 'all 2 causes (not advised)' in page
    )


def test_the_controller_is_not_to_be_given_a_curve_that_takes_hardly_anything_off():
    card = part(report_page(unknown(1e-6)), 'class="cards"', 'id="seam"')
    assert 'Its curve takes hardly anything off: do not correct programs by it' in card
    assert 'Nothing is to be entered: the curve takes hardly anything off.' in card
    assert 'weld-twin correct' not in card


@pytest.mark.parametrize(('level', 'told'), [('ok', False), ('note', True)])
def test_clocks_are_looked_at_for_a_lag_unless_they_were_found_right(level, told):
    case = unknown(1e-4)
    cause = replace(case.causes[0], dependence=(('speed', 0.8),))
    checks = (Check('clocks', level, 'As they are.'),)
    first = worth_doing(replace(case, causes=(cause,), checks=checks))[0]
    assert 'gains and feed-forward of the drive' in first and ('clocks' in first) is told


def test_a_curve_is_told_by_where_it_is_furthest_off():
    case = unknown(4e-4)
    low, high = (f'{np.degrees(k):.3g}' for k in case.model.found[0].knots)
    card = part(report_page(case), 'class="cards"', 'id="seam"')
    row = re.search(r'By how much off by up to (0\.0229)° at (\S+)° ', card)
    assert row and row[2] in (low, high)
    assert f'how far off by angle, up to 0.0229° at {row[2]}°' in card


def test_an_unknown_cause_is_unknown_only_among_what_was_to_be_tried():
    case = unknown(1e-4)
    rivals = tuple(Candidate(Site(name, 'joint_a2'), p, 1e-4, 0.5)
                   for name, p in (('servo_lag', 0.6), ('backlash', 0.4)))  # fmt: skip
    absent = dict.fromkeys(('friction', 'backlash'), 'excluded by the user')
    case = replace(case, absent=absent, candidates=rivals)
    page = report_page(case)
    told = 'friction and backlash were not tried, as asked'
    assert f'the cause is none of those tried; {told}' in part(page, 'How sure', '</dl>')
    again, look, *_ = worth_doing(case)
    assert again.startswith('Diagnose again with friction and backlash: ')
    assert 'no effect that was tried gives it' in look and told in verdict(case)[0]
    card = part(page, 'class="cards"', 'id="seam"')
    assert f'no effect that was tried ({told}) gives it' in card
    near = part(page, 'What fits best', 'Not considered')
    assert 'servo lag of joint_a2' in near and 'backlash' not in near
    whole = replace(case, absent={})
    assert (
        'not tried, as asked' not in report_page(whole) and 'no known effect' in verdict(whole)[0]
    )
    kept = [c['effect'] for c in json.loads(diagnosis_text(case, ()))['candidates']]
    assert kept == ['servo_lag']


def open_and_sure(size):
    """Return a zero or base that cannot be told apart, beside certain play of so much."""
    robot = load('kuka_kr6_r900')
    play = {'effect': 'backlash', 'joint': 'joint_a3', 'width': size}
    zero = {'effect': 'joint_offset', 'joint': 'joint_a1', 'offset': 5e-4}
    case = diagnoses.diagnosis('ambiguous', robot, [play, zero], [play, zero],
                               [diagnoses.moving(robot, 'circle')])  # fmt: skip
    alike = (Site('base_pose', None), Site('joint_offset', 'joint_a1'))
    of_play, of_zero = case.causes
    of_zero = replace(of_zero, share=0.7, name=((alike[1], 0.5), (alike[0], 0.4)))
    return replace(
        case,
        causes=(of_zero, replace(of_play, share=0.2)),
        contributions=replace(
            case.contributions, parts=tuple(p[::-1] for p in case.contributions.parts)
        ),
        # The twin counts play first, the verdict names the zero first.
        effects=case.effects[::-1],
        actions=('Master joint_a1.', 'Service the gear.'),
        indistinguishable=(alike, (Site('backlash', 'joint_a3'),)),
        next_experiment={'sentence': 'Run the path.', 'cost': 0.7},
    )


def test_what_is_small_and_certain_waits_until_the_larger_is_told_apart():
    case = open_and_sure(5e-4)
    first, *_, last = worth_doing(case)
    assert first.startswith('Find out whether it is zero offset of joint_a1 or base pose error: ')
    assert last == 'Service the gear.'
    assert (
        'in part from zero offset of joint_a1 or base pose error (these data do not tell'
        in (verdict(case)[0])
    )
    page = report_page(case)
    card = part(page[page.index('class="cards"') :], 'id="cause-1"', 'How sure')
    assert 'Zero offset of joint_a1 or base pose error' in card


def test_what_is_small_and_certain_comes_first_if_it_alone_meets_the_tolerance():
    case = open_and_sure(5e-4)
    left = left_without(case, 1)
    told = [worth_doing(case, Rule(factor * left.largest_after, 1e-6, 1))[0]
            for factor in (1.5, 0.9)]  # fmt: skip
    assert told[0].startswith('Service the gear. ') and 'That alone leaves' in told[0]
    assert told[1].startswith('Find out whether')


def test_how_long_a_proposed_measurement_takes_stands_beside_it():
    case = replace(unknown(1e-4), next_experiment={'sentence': 'Run the path.', 'cost': 0.7})
    assert 'Measure what next_experiment.yaml proposes (about 1 min), and' in worth_doing(case)[-1]


def test_a_named_cause_whose_mending_alone_makes_it_worse_is_to_be_mended_with_the_others():
    two = [
        {'effect': 'joint_offset', 'joint': 'joint_a2', 'offset': 8e-4},
        {'effect': 'joint_offset', 'joint': 'joint_a3', 'offset': -8e-4},
    ]
    robot = load('kuka_kr6_r900')
    seam = [diagnoses.moving(robot, 'circle')]
    case = diagnoses.diagnosis('identified', robot, two, two, seam, actions=('One.', 'Two.'))
    both = [left_without(case, k) for k in (0, 1)]
    grows = [left.grows or left.rises for left in both]
    told = ['mend it together with the others' in text for text in worth_doing(case)]
    assert told == grows and any(grows)


def test_a_cause_has_one_figure_of_belief_and_no_part_is_less_sure_than_the_whole():
    cause = replace(PLAY.causes[0], name=((Site('backlash', 'elbow_joint'), 0.76),))
    case = replace(PLAY, causes=(cause,), confidence=0.96)
    assert Answer(case).causes[0].belief == 0.96
    card = report_page(case)
    card = card[card.index('class="cards"') :]
    card = card[card.index('How sure') : card.index('<dt>By how much')]
    seen = plain(re.sub('<details.*?</details>', '', card, flags=re.DOTALL))
    assert re.findall(r'\d+ %', seen) == ['96 %'] and 'that it is backlash of elbow_joint' in seen


def test_the_whole_says_why_it_is_less_sure_than_its_parts():
    causes = tuple(
        replace(c, name=((c.name[0][0], p),), probability=p)
        for c, p in zip(CIRCLE.causes, (0.98, 0.9, 0.8), strict=True)
    )
    top = part(report_page(replace(CIRCLE, causes=causes, confidence=0.7)), 'How sure', '</dl>')
    assert 'All at once is less likely than each alone: 98 %, 90 %, 80 %' in top
    even = replace(CIRCLE, causes=causes, confidence=0.98)
    assert 'less likely than each' not in part(report_page(even), 'How sure', '</dl>')


def test_of_causes_that_fit_alike_the_figure_is_that_of_the_set():
    case = diagnoses.ambiguous()
    pair, alias = case.indistinguishable[0], Site('axis_parallelism', 'joint_a2')
    # What is one error with another on any motion is named once, and believed all the same.
    group = (*pair, alias)
    names = tuple((site, p) for site, p in zip(group, (0.3, 0.2, 0.14), strict=True))
    cause = replace(case.causes[0], name=names, probability=0.64)
    same = ((pair[0], alias),)
    case = replace(case, confidence=0.48, causes=(cause,), indistinguishable=(group,), same=same)
    page = report_page(case)
    card = part(page[page.index('class="cards"') :], 'How sure', '<dt>By how much')
    assert '64 % that it is one of these; which of them is open.' in card
    places = part(report_page(case), 'By place', 'By what it depends on')
    assert 'joint_a1 or the base' in places


def test_rivals_are_weighed_against_each_other_without_a_second_figure_of_belief():
    rivals = [Candidate(Site(name, 'joint_a1'), p, 1e-4, 0.5)
              for name, p in (('joint_offset', 0.49), ('axis_parallelism', 0.48),
                              ('friction', 0.02), ('backlash', 1e-6))]  # fmt: skip
    page = report_page(replace(diagnoses.ambiguous(), candidates=tuple(rivals)))
    told = part(page, 'Candidates against each other', 'cannot tell apart')
    for words in ('the likeliest', 'as likely', '24 times less', 'more than 1000 times less'):
        assert words in told
    assert '49 %' not in told


def test_where_rivals_could_not_be_tried_nothing_is_said_to_be_settled():
    assert 'Nothing: in these recordings no other effect' in report_page(PLAY)
    still = {
        'friction': 'the joint hardly moves (wrist_1_joint)',
        'joint_coupling': 'the joint hardly moves (elbow_joint)',
        'drift': 'excluded by the user',
    }
    page = plain(report_page(replace(PLAY, absent=still)))
    assert 'no other effect looks like' not in page and 'No further measurement' not in page
    assert page.count('wrist_1_joint hardly moves, so friction could not be tried there') == 2
    assert 'Drift of the frame was not tried, as asked.' in page


def test_samples_left_out_are_told_as_that_beside_an_instrument_without_outliers():
    good = [np.ones(len(t), bool) for t in PLAY.traces.t]
    good[0][:18] = False
    fine = Check('outliers', 'ok', 'No single reading stands out from its neighbours.')
    case = replace(PLAY, checks=(fine,), traces=replace(PLAY.traces, trusted=tuple(good)))
    page = plain(report_page(case))
    assert re.search(r'seam_run \(18 samples left out: 0\.\d+ mm at .* s and 15 more\)', page)
    assert 'left out 18 of' in page and 'outliers not drawn' not in page
    sizes = sum(g.size for g in good)
    assert f'of the {sizes - 18} samples that count' in page and 'of all samples' not in page
    judged = part(report_page(case, sheet=Sheet(Demand(1e-3))), 'id="verdict"', '<h1')
    assert '18 samples are left out of it' in judged


@pytest.mark.parametrize(
    ('brand', 'told'),
    [
        ('fanuc', 'new value = what it reads now + 0.0687; then EXEC'),
        ('abb', 'new value = old value - 0.001198 * G'),
        ('yaskawa', 'in pulses: new value = old value - 0.0687 * P'),
        ('ur', 'in radians: new value = old value + 0.001198;'),
        ('kuka', '$MAMES of the axis, in degrees: new value = old value + 0.0687;'),
    ],
)
def test_what_a_controller_asks_for_is_told_in_its_unit(brand, told):
    zero = effect_from_mapping({'effect': 'joint_offset', 'joint': 'j5', 'offset': 1.1984e-3})
    assert told in correction(zero, brand) and 'MASTER_COUN' not in correction(zero, brand)


def test_the_table_of_joints_has_no_empty_columns():
    shares = np.zeros((6, len(diagnoses.REGRESSORS)))
    shares[2, 3] = 0.4
    where = replace(PLAY.where, map_shares=tuple(map(tuple, shares)))
    page = report_page(replace(PLAY, where=where))
    heads = re.findall('scope="col">(.*?)</th>', page[page.index('class="map"') :])
    assert [plain(h).strip() for h in heads[:2]] == ['Joint [%]', 'direction of motion']
    assert page.count('data-joint=') == 6 and 'acceleration' not in heads
    assert (
        'No joint alone could explain 0.5 % by constant, angle of low order, angle of high order'
        in plain(page)
    )


def test_stretches_that_are_nearly_equal_are_told_as_even():
    def told(sizes):
        path = tuple((float(k), k + 1.0, 0.1, 1e-3 * v) for k, v in enumerate(sizes))
        where: Where = replace(PLAY.where, path=path)
        return plain(report_page(replace(PLAY, where=where)))

    assert 'Evenly along the seam: 0.310 mm to 0.350 mm RMS' in told([0.31, 0.35, 0.33])
    assert 'Evenly' not in told([0.31, 0.55, 0.33])


def test_one_is_no_plural():
    assert [counted(k, 'cell') for k in (0, 1, 2)] == ['0 cells', '1 cell', '2 cells']
    assert counted(1, 'diagnosis', 'diagnoses') == '1 diagnosis'


def test_the_first_screen_has_degrees_and_no_milliradians():
    page = report_page(replace(CIRCLE, actions=()), sheet=Sheet())
    assert 'mrad' not in part(page, 'id="verdict"', 'id="acceptance"')


def test_where_the_arm_stands_along_is_where_it_goes_next():
    traces = PLAY.traces
    path = traces.measured[0] - traces.before[0]
    path[:12] = path[12]
    still = replace(traces, measured=(path + traces.before[0], *traces.measured[1:]))
    way = (path[13] - path[12]) / np.linalg.norm(path[13] - path[12])
    parts = components(replace(PLAY, traces=still), 0, np.tile(2e-4 * way, (len(path), 1)))
    assert plain(sides_words(parts[3])).startswith('0.200 mm ahead')


def test_checks_that_are_in_order_passed():
    checks = tuple(Check(name, 'ok', 'fine') for name in ('clocks', 'outliers', 'units'))
    page = plain(report_page(replace(PLAY, checks=checks)))
    assert 'all 3 checks passed' in page and 'All 3 checks passed.' in page
    one = replace(checks[0], level='note')
    page = plain(report_page(replace(PLAY, checks=(one, *checks[1:]))))
    assert '2 of 3 checks passed; 1 note' in page and 'found nothing' not in page


def test_what_is_open_is_open_in_what_it_depends_on_too():
    case = diagnoses.ambiguous()
    sites = (Site('joint_offset', 'joint_a1'), Site('backlash', 'joint_a1'))
    cause = replace(case.causes[0], name=tuple((site, 0.4) for site in sites))
    case = replace(case, indistinguishable=(sites,), causes=(cause,))
    told = part(report_page(case), 'By what it depends on', 'By direction')
    assert 'constant or the direction of motion' in told


def test_what_a_cause_does_is_told_at_the_stations_where_there_is_no_seam():
    still = diagnoses.calibration()
    assert all(recording.joints.static for recording in still.recordings)
    page = report_page(replace(still, families=()))
    assert 'Effect at the stations' in page and 'Effect on the seam' not in page
    moving = report_page(PLAY)
    assert 'Effect on the seam' in moving and 'Effect at the stations' not in moving


ORDERS = {'kuka': ('ZYX', False), 'fanuc': ('xyz', False), 'abb': (None, True)}
"""Angles as the makers write them, and whether positions are in metres."""


def frame_in(text, brand):
    """Return the frame that the numbers of a maker stand for."""
    order, metres = ORDERS[brand]
    text = re.sub(r'q1 to q4', '', text)
    numbers = [float(v) for v in re.findall(r'-?\d+\.\d+', text)]
    out = np.eye(4)
    if order is None:
        turn = Rotation.from_quat([*numbers[4:], numbers[3]])
    else:
        turn = Rotation.from_euler(order, numbers[3:], degrees=True)
    out[:3, :3], out[:3, 3] = turn.as_matrix(), np.array(numbers[:3]) * (1.0 if metres else 1e-3)
    return out


@pytest.mark.parametrize('brand', ORDERS)
def test_a_positioner_that_stands_elsewhere_is_told_as_its_controller_takes_it(brand):
    """Old and new value, and what to do where the controller has the root at another place."""
    turn = Rotation.from_euler('xyz', [20.0, -35.0, 110.0], degrees=True)
    foot = {'xyz': [1.4, 0.2, 0.7], 'quat_xyzw': turn.as_quat().tolist()}
    high = Rotation.from_euler('z', 90.0, degrees=True)
    data = load('kuka_kr16_2').to_mapping() | {'name': 'cell'}
    data['base'] = {'xyz': [0.0, 0.0, 0.5], 'quat_xyzw': high.as_quat().tolist()}
    data['controller'] = {'base': {'xyz': [0.0, 0.0, 0.1], 'quat_xyzw': [1.0, 0.0, 0.0, 0.0]}}
    data['workpiece'] = {'base': foot, 'joints': [{'name': 'tilt', 'a': 0.1}]}
    error = {'effect': 'root_pose', 'xyz': [2e-3, -1e-3, 3e-3], 'rotvec': [1e-3, 2e-3, -3e-3]}
    told = correction(effect_from_mapping(error), brand, Robot.from_mapping(data))

    def placed(xyz, rotation):
        out = np.eye(4)
        out[:3, :3], out[:3, 3] = rotation.as_matrix(), xyz
        return out

    base = placed([0.0, 0.0, 0.5], high)
    mine = base @ placed([0.0, 0.0, 0.1], Rotation.from_quat([1.0, 0.0, 0.0, 0.0]))
    moved = Rotation.from_rotvec(high.apply(error['rotvec']))
    real = placed(foot['xyz'] + high.apply(error['xyz']), moved * turn)
    parts = re.split('Old value |; new value |\\. The origin ', told)
    old, new = (frame_in(part, brand) for part in parts[1:3])
    np.testing.assert_allclose(old, np.linalg.inv(mine) @ placed(foot['xyz'], turn), atol=2e-6)
    np.testing.assert_allclose(new, np.linalg.inv(mine) @ real, atol=2e-6)
    other = placed([0.3, -0.2, 0.4], Rotation.from_rotvec([0.2, 0.1, 1.0]))
    step = frame_in(parts[3].split('new value is ')[1].split('old value')[0], brand)
    step[:3, 3] *= 1e-3 if brand == 'abb' else 1.0  # PoseMult is in mm
    np.testing.assert_allclose(step @ old @ other, new @ other, atol=4e-6)
    if brand == 'abb':  # as a program of it is written
        assert re.search(r'\[\[(-?\d+\.\d{3},?){3}\],\[(-?\d\.\d{7},?){4}\]\]', told)


def test_a_frame_on_the_workpiece_is_told_where_it_is_on_the_positioner():
    """Of a cell poses are measured there, and no bolt of the robot's foot is to blame."""
    data = load('kuka_kr16_2').to_mapping() | {'name': 'cell'}
    tool = {'xyz': [0.1, 0.05, 0.08], 'quat_xyzw': [0.0, 0.0, 0.6, 0.8]}
    data['workpiece'] = {'joints': [{'name': 'turn'}], 'tool': tool}
    turn, moved = Rotation.from_quat(tool['quat_xyzw']), np.array([0.012, -0.02, 0.004])
    # What the measuring frame sees of the positioner is displaced by the error.
    off = {'effect': 'base_pose', 'xyz': (-turn.inv().apply(moved)).tolist(), 'rotvec': [0.0] * 3}
    told = effect_from_mapping(off).remedy(Robot.from_mapping(data))
    assert 'at x, y, z = (112.000, 30.000, 84.000) mm' in told
    assert 'in place of x, y, z = (100.000, 50.000, 80.000) mm' in told
    assert 'fixture' in told and 'bolts' not in told
