# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Whole sheets are as they were kept: six in full, of others what differs from one of these.

The name of a case is what its sheet was read for; in `kept/` the words that answer it stand.
"""

import json
import re
from dataclasses import replace
from functools import cache
from io import StringIO
from pathlib import Path

import diagnoses
import numpy as np
import pytest
from page_text import flat, page_text
from rich.console import Console

from weld_twin_core import JointMotion, __version__, effect_from_mapping, load
from weld_twin_core.diagnosis.result import Candidate, Check, Family, Found, Shares, Site
from weld_twin_nodes.wording import mending
from weld_twin_nodes.wording.mending import remaining_without
from weld_twin_report.report import print_summary, report_page, sections
from weld_twin_report.report.answer import Answer
from weld_twin_report.report.diagnosis_files import diagnosis_text
from weld_twin_report.report.diagnosis_page import Sheet
from weld_twin_report.report.sections import Demand

PLAY, CIRCLE, OPEN = diagnoses.backlash(), diagnoses.circle(), diagnoses.ambiguous()


def curve(joint, values, **more):
    """Return the entry of a curve that stands for what has no name."""
    return {'effect': 'joint_curve', 'joint': joint, 'values': values, **more}


def seen(status, true, believed, robot='kuka_kr6_r900', path='circle', **changes):
    """Return a diagnosis of one run of an arm of the catalog."""
    arm = load(robot)
    return diagnoses.diagnosis(
        status, arm, true, believed, [diagnoses.moving(arm, path)], **changes
    )


@cache
def unknown(size):
    """Return play that a curve over the angle stands for, by so much at the ends of the angle."""
    q = diagnoses.moving(load('kuka_kr6_r900'), 'circle').joints.q[:, 2]
    play = {'effect': 'backlash', 'joint': 'joint_a3', 'width': 8e-4}
    ends = [float(q.min()), float(q.max())]
    case = seen('unknown', [play], [curve('joint_a3', [-size, size], knots=ends)], effects=())
    return one_cause(case, dependence=(('direction', 0.8),), share=0.97, share_ci90=(0.7, 1.0))


def one_cause(case, **changes):
    """Return a diagnosis with its first cause alone, changed."""
    return replace(case, causes=(replace(case.causes[0], **changes),))


def nameless(over, **changes):
    """Return a gap that a curve of one joint over something stands for."""
    values, knots = ([4e-4], [0.0]) if over == 'constant' else ([-4e-4, 4e-4], [-1.0, 1.0])
    entry = curve('joint_a3', values, over=over, knots=knots)
    return one_cause(seen('unknown', [entry], [entry], effects=()), **changes)


def turned(case, **changes):
    """Return a diagnosis of two causes the other way round."""
    parts = tuple(part[::-1] for part in case.contributions.parts)
    made = {'causes': case.causes[::-1], **changes}
    return replace(case, contributions=replace(case.contributions, parts=parts), **made)


def several_curves():
    """Return a place where two curves stand for one cause."""
    small, large = (
        curve('joint_a3', [-size, size], over=over, knots=[-1.0, 1.0])
        for over, size in (('speed', 5e-5), ('direction', 4e-4))
    )
    case = seen('unknown', [large], [small, large], effects=())
    return one_cause(case, members=(0, 1))


def a_curve_advised_against():
    """Return two curves of which one makes it worse."""
    each = [
        [
            curve(f'joint_a{k}', [size] * 2, knots=[-4.0, 4.0])
            for k, size in zip((2, 3), sizes, strict=True)
        ]
        for sizes in ((6e-4, 2e-4), (6e-4, -8e-4))
    ]
    return seen('unknown', *each, effects=())


def open_and_sure():
    """Return a zero or base that cannot be told apart, beside certain play."""
    play = {'effect': 'backlash', 'joint': 'joint_a3', 'width': 5e-4}
    zero = {'effect': 'joint_offset', 'joint': 'joint_a1', 'offset': 5e-4}
    case = seen('ambiguous', [play, zero], [play, zero])
    alike = (Site('base_pose', None), Site('joint_offset', 'joint_a1'))
    of_play, of_zero = case.causes
    of_zero = replace(of_zero, share=0.7, name=((alike[1], 0.5), (alike[0], 0.4)))
    return turned(
        case,
        causes=(of_zero, replace(of_play, share=0.2)),
        effects=case.effects[::-1],  # the twin counts play first, the verdict names the zero first
        actions=('Master joint_a1.', 'Service the gear.'),
        indistinguishable=(alike, (Site('backlash', 'joint_a3'),)),
        next_experiment={'sentence': 'Run the path.', 'cost': 0.7},
    )


def allowing(factor):
    """Return what is open beside what is sure, and a tolerance of so much of what the sure leaves."""
    case = open_and_sure()
    left = factor * remaining_without(case, 1).largest_after
    return case, Sheet(Demand(left, 1e-6))


def lags(share):
    """Return two lags, of which one takes more off, and the other has the larger share."""
    two = [{'effect': 'servo_lag', 'joint': f'joint_a{k}', 'time_constant': t}
           for k, t in ((2, 6e-3), (3, 1e-3))]  # fmt: skip
    case = seen('identified', two, two)
    causes = [
        replace(c, share=s, name=())
        for c, s in zip(case.causes, (1.0 - share, share), strict=True)
    ]
    return turned(case, causes=tuple(causes[::-1]), effects=(), status='unknown')


def zeros_against_each_other():
    two = [{'effect': 'joint_offset', 'joint': f'joint_a{k}', 'offset': size}
           for k, size in ((2, 8e-4), (3, -8e-4))]  # fmt: skip
    return seen('identified', two, two, actions=('One.', 'Two.'))


def not_tried():
    rivals = tuple(Candidate(Site(name, 'joint_a2'), p, 1e-4, 0.5)
                   for name, p in (('servo_lag', 0.6), ('backlash', 0.4)))  # fmt: skip
    absent = dict.fromkeys(('friction', 'backlash'), 'excluded by the user')
    return replace(unknown(1e-4), absent=absent, candidates=rivals)


def with_an_alias():
    pair, alias = OPEN.indistinguishable[0], Site('axis_parallelism', 'joint_a2')
    group = (*pair, alias)
    names = tuple(zip(group, (0.3, 0.2, 0.14), strict=True))
    case = replace(OPEN, confidence=0.48, same=((pair[0], alias),), indistinguishable=(group,))
    return one_cause(case, name=names, probability=0.64)


def fit_alternatives(case, *each):
    return replace(
        case,
        candidates=tuple(Candidate(Site(name, 'joint_a1'), p, 1e-4, s) for name, p, s in each),
    )


def left_out(*places, far=None):
    """Return play with samples of its first run left out, one of them far off."""
    good = [np.ones(len(t), bool) for t in PLAY.traces.t]
    good[0][list(places)] = False
    before = [np.array(part) for part in PLAY.traces.before]
    if far:
        before[0][places[0]] = [far, 0.0, 0.0]
    traces = replace(PLAY.traces, trusted=tuple(good), before=tuple(before))
    fine = Check('outliers', 'ok', 'No single reading stands out from its neighbours.')
    return replace(PLAY, traces=traces, checks=PLAY.checks if far else (fine,))


def joints_explain_little():
    shares = np.zeros((6, len(diagnoses.REGRESSORS)))
    shares[2, 3] = 0.4
    return where(map_shares=tuple(map(tuple, shares)))


def where(**changes):
    return replace(PLAY, where=replace(PLAY.where, **changes))


def stretches(*sizes):
    return where(path=tuple((float(k), k + 1.0, 0.1, v) for k, v in enumerate(sizes)))


def checked(*levels):
    return replace(PLAY, checks=tuple(Check(f'check {k}', level, 'Said.')
                                      for k, level in enumerate(levels)))  # fmt: skip


def open_in_what_it_depends_on():
    sites = (Site('joint_offset', 'joint_a1'), Site('backlash', 'joint_a1'))
    case = one_cause(OPEN, name=tuple((site, 0.4) for site in sites))
    return replace(case, indistinguishable=(sites,))


def repeated_stations():
    once = diagnoses.stations(CIRCLE.model.robot, 5)
    motion = JointMotion(np.arange(20.0), np.tile(once.joints.q, (4, 1)), static=True)
    zero = {'effect': 'joint_offset', 'joint': 'joint_a2', 'offset': 5e-4}
    again = [replace(once, joints=motion)]
    return diagnoses.diagnosis('identified', CIRCLE.model.robot, [zero], [zero], again)


def causes_changed(**changes):
    return replace(CIRCLE, causes=(replace(CIRCLE.causes[0], **changes), *CIRCLE.causes[1:]))


def beliefs(whole):
    causes = tuple(
        replace(c, name=((c.name[0][0], p),), probability=p)
        for c, p in zip(CIRCLE.causes, (0.98, 0.9, 0.8), strict=True)
    )
    return replace(CIRCLE, causes=causes, confidence=whole)


def half_of_it_named():
    half = tuple(replace(c, share=0.6 * c.share) for c in CIRCLE.causes)
    return replace(CIRCLE, causes=half, shares=Shares(1.0 - sum(c.share for c in half), 0.0))


def a_clock_beside():
    """Return what is open, with a clock that is late beside it."""
    sure = Found(effect_from_mapping({'effect': 'time_delay', 'delay': 0.01}), {})
    causes = tuple(
        replace(OPEN.causes[0], share=s, members=(k,)) for k, s in enumerate((0.1, 0.9))
    )
    return replace(
        OPEN,
        effects=(*OPEN.effects, sure),
        actions=(*OPEN.actions, 'Set the clock right.'),
        causes=causes,
        contributions=None,
        model=replace(OPEN.model, found=(*OPEN.model.found, sure.effect)),
        indistinguishable=(*OPEN.indistinguishable, (Site('time_delay', None),)),
    )


def imitated(**shrink):
    """Return play that a lag stands for, which it is not."""
    play = {'effect': 'backlash', 'joint': 'joint_a3', 'width': 8e-4}
    lag = {'effect': 'servo_lag', 'joint': 'joint_a3', 'time_constant': 5e-4}
    case = seen('unknown', [play], [lag], effects=(), contributions=None)
    case = one_cause(case, name=((Site('joint_curve', 'joint_a3'), 0.9),))
    return replace(case, shrink=replace(case.shrink, **shrink))


def parts(one, other):
    """Return causes of which an experiment parts two, each an effect, its joint and on what."""
    sides = [[{'effect': e, 'joint': at, 'at': at, 'on': on}] for e, at, on in (one, other)]
    wanted = {'between': sides, 'reason': 'by 22 standard deviations', 'promise': 0.48}
    return replace(CIRCLE, next_experiment=wanted)


def a_measurement(other=None):
    """Return what is open with a measurement to make, in full, or one that parts it from another."""
    motion = {'static': True, 't': [0.125], 'q': [[0.625]]}
    wanted = {'kind': 'bidirectional', 'sentence': 'Measure base_pose anew.', 'cost': 20.0,
              'reason': 'It shows.', 'expected_separation_sigma': 12.3, 'motion': motion}  # fmt: skip
    if other:
        zero = {'effect': 'joint_offset', 'joint': 'joint_a1'}
        wanted['between'] = [[zero], [{'effect': other, 'joint': 'joint_a1'}]]
    return replace(OPEN, next_experiment=wanted)


def turns_alone():
    """Return a tool that is turned in its socket, and what is told of the angle."""
    off = [{'effect': 'tool_pose', 'xyz': [0.0, 0.0, 0.0], 'rotvec': [0.0, 2e-3, 0.0]}]
    case = seen('identified', off, off, 'ur5', 'spline')
    before = case.shrink.rms_before_m
    shrink = replace(case.shrink, ratio=1.0, rms_after_m=before, orientation_rad=(2e-3, 5e-5))
    return replace(case, shrink=shrink)


def a_gear_ratio():
    gear = {'effect': 'gear_ratio', 'joint': 'joint_2', 'scale': 1.2e-3}
    return seen('identified', [gear], [gear], 'abb_irb1600', 'spline')


def demanding(tolerance, uncertainty=None, case=CIRCLE):
    """Return a case, and a tolerance as a part of its largest deviation."""
    size = max(np.linalg.norm(np.concatenate(case.traces.before), axis=1))
    return case, Sheet(Demand(tolerance * size, uncertainty and uncertainty * size))


def absent(case, **why):
    return replace(case, absent=why)


def clocks(level):
    case = one_cause(unknown(1e-4), dependence=(('speed', 0.8),))
    return replace(case, checks=(Check('clocks', level, 'As they are.'),))


def each_kind_doubted():
    case = whole('calibration')
    causes = tuple(
        replace(c, probability=0.4 if k == 0 else 0.2) for k, c in enumerate(case.causes)
    )
    kinds = dict.fromkeys(each.effect.name for each in case.effects)
    families = tuple(
        Family(kind, (0.2, 0.3), True, ((Site(kind, 'joint_1'), 2e-4),), 2e-4, named=True)
        for kind in kinds
    )
    said = {'causes': causes, 'families': families, 'confidence': 0.2}
    return replace(case, status='ambiguous', indistinguishable=(), **said)


def test_kinds_that_take_nothing_off_are_not_listed_as_found():
    case = each_kind_doubted()
    ripple = next(f for f in case.families if f.effect == 'transmission_ripple')
    less = replace(ripple, rms_m=0.0, growths=(-0.4, -0.3), named=False)
    rest = tuple(f for f in case.families if f is not ripple)
    (before, by_joint), (after,) = (
        Answer(each).found for each in (case, replace(case, families=(*rest, less)))
    )
    assert by_joint.title == 'Transmission ripple by joint'
    assert [row[0] for row in before.rows if row[0] != 'transmission ripple'] == [
        row[0] for row in after.rows
    ]


AT_REST = 'the joint hardly moves (wrist_1_joint)'
LABELS = {'joint_a1': 'A1', 'joint_a3': 'E<3>'}
THIRD = (('joint_a5', 0.29), ('joint_a6', 0.29), ('joint_a4', 0.28))
CASES = {
    'backlash': {
        'rather wrong as a whole is not identified': lambda: replace(PLAY, confidence=0.28),
        'rivals could not be tried': lambda: absent(
            PLAY, friction=AT_REST, joint_coupling=AT_REST, drift='excluded by the user'
        ),
        'samples left out': lambda: (left_out(*range(18)), Sheet(Demand(1e-3))),
        'an outlier far off': lambda: left_out(7, far=0.05),
        'joints that explain little': joints_explain_little,
        'even stretches': lambda: stretches(3.1e-4, 3.5e-4, 3.3e-4),
        'uneven stretches': lambda: stretches(3.1e-4, 5.5e-4, 3.3e-4),
        'all checks passed': lambda: checked('ok', 'ok', 'ok'),
        'one check has a note': lambda: checked('note', 'ok', 'ok'),
        'named beside what has no name': lambda: replace(
            PLAY, status='unknown', reasons=('it has no name here',)
        ),
        'a gear ratio': a_gear_ratio,
        'the tool turns alone': turns_alone,
    },
    'circle': {
        'the whole less sure than its parts': lambda: beliefs(0.7),
        'the whole as sure as its parts': lambda: beliefs(0.98),
        'another maker': lambda: (CIRCLE, Sheet(brand='fanuc')),
        'names of the controller': lambda: (CIRCLE, Sheet(joints=LABELS)),
        'not considered': lambda: absent(
            CIRCLE,
            friction=AT_REST.replace('wrist_1_joint', 'joint_a4, joint_a5'),
            loaded_play='no wrench',
            joint_coupling=AT_REST.replace('wrist_1_joint', 'joint_a3'),
        ),
        'what it depends on is open': lambda: causes_changed(
            dependence=(('load', 0.34), ('constant', 0.34))
        ),
        'fitted and not named': half_of_it_named,
        'a cause without a share': lambda: causes_changed(share=0.0),
        'joints as smooth as a command': lambda: replace(
            CIRCLE, checks=(Check('source of the joints', 'note', 'As smooth as a command.'),)
        ),
        'a poor instrument': lambda: demanding(1.2, 0.3),
        'a good instrument': lambda: demanding(1.2, 0.01),
        'half is allowed': lambda: demanding(0.5),
        'parts two places': lambda: parts(
            ('joint_curve', 'joint_a2', 'speed'), ('joint_curve', 'joint_a3', 'speed')
        ),
        'parts two dependences': lambda: parts(
            ('joint_curve', 'joint_a2', 'speed'), ('joint_curve', 'joint_a2', 'load')
        ),
        'parts a name from a place': lambda: parts(
            ('backlash', 'joint_a2', 'direction'), ('joint_curve', 'joint_a3', 'speed')
        ),
        'bars of rivals have one scale': lambda: fit_alternatives(
            CIRCLE, ('servo_lag', 0.9, 0.8), ('friction', 0.1, 0.5), ('joint_offset', 1.0, 0.2)
        ),
        'zeros against each other': zeros_against_each_other,
    },
    'ambiguous': {
        'one error under two names': with_an_alias,
        'rivals against each other': lambda: fit_alternatives(
            OPEN,
            ('joint_offset', 0.49, 0.5),
            ('axis_parallelism', 0.48, 0.5),
            ('friction', 0.02, 0.5),
            ('backlash', 1e-6, 0.5),
        ),
        'two dependences': open_in_what_it_depends_on,
        'what is certain and largest comes first': a_clock_beside,
        'a measurement in full': a_measurement,
        'a measurement that leaves it open': lambda: a_measurement('backlash'),
    },
    'sure': {
        'alone would do': lambda: allowing(1.5),
        'alone would not do': lambda: allowing(0.9),
    },
    'unknown': {
        'to be measured': lambda: replace(
            diagnoses.unknown(), next_experiment={'kind': 'touches', 'sentence': 'Touch 5 places.'}
        ),
        'tried without one': lambda: absent(
            diagnoses.unknown(), backlash='excluded by the user', drift='no time'
        ),
    },
    'curve': {
        'two places in part': lambda: replace(
            unknown(1e-4),
            contributions=None,
            causes=tuple(
                replace(unknown(1e-4).causes[0], **each)
                for each in (
                    {'share': 0.3},
                    {
                        'share': 0.6,
                        'members': (),
                        'place': (('joint_a5', 0.8),),
                        'dependence': (('constant', 0.9),),
                    },
                )
            ),
        ),
        'a place no likelier than not': lambda: one_cause(
            unknown(1e-4), place=THIRD, dependence=(('constant', 0.33),)
        ),
        'makes the worst spot worse': lambda: unknown(-8e-4),
        'takes hardly anything off': lambda: unknown(1e-6),
        'furthest off at an end': lambda: unknown(4e-4),
        'not to be tried': not_tried,
        'a measurement takes so long': lambda: replace(
            unknown(1e-4), next_experiment={'sentence': 'Run the path.', 'cost': 0.7}
        ),
        'several curves at a place': several_curves,
        'a curve advised against': a_curve_advised_against,
        'most taken off leads': lambda: lags(0.66),
        'dependences that fit alike': lambda: nameless(
            'direction', dependence=(('load', 0.35), ('angle', 0.35), ('time', 0.2))
        ),
        'a constant without a name': lambda: nameless('constant', dependence=(('constant', 0.9),)),
    },
    'clocks': {'not found right': lambda: clocks('note')},
    'imitated': {'by what is of no use': lambda: imitated(ratio=1.0)},
    'calibration': {'each kind doubted': each_kind_doubted},
    'stations': {},
    'nothing': {},
}
"""Sheets kept in full, and others of which words are kept that differ from one of these."""
BESIDE = {
    'sure': open_and_sure,
    'clocks': lambda: clocks('ok'),
    'imitated': imitated,
    'stations': repeated_stations,
}


@cache
def whole(name):
    return unknown(1e-4) if name == 'curve' else BESIDE.get(name, diagnoses.ALL.get(name))()


SECTIONS = Path(__file__).parent / 'kept' / 'sections.txt'


@pytest.fixture(autouse=True)
def sections_that_were_kept(request, monkeypatch):
    """Leave out sections that are newer than the texts; `--keep` keeps them as well."""
    if request.config.getoption('--keep'):
        SECTIONS.write_text(''.join(f'{each.name}\n' for each in sections.sections()))
    names = SECTIONS.read_text().split()
    known = tuple(each for each in sections.sections() if each.name in names)
    monkeypatch.setattr(sections, 'sections', lambda: known)


def told(case):
    """Return what is read of a diagnosis, on the sheet and in the terminal."""
    case, sheet = case if isinstance(case, tuple) else (case, None)
    out = StringIO()
    print_summary(case, Console(file=out, width=400))
    summary = '\n'.join(line.rstrip() for line in out.getvalue().splitlines())
    page = page_text(report_page(case, sheet=sheet))
    return f'{page}{summary}\n'.replace(__version__, 'VERSION')


@cache
def told_of(name):
    """Return what is read of a sheet that is kept in full, and others differ from."""
    return told(whole(name))


def words(text):
    """Return text without what charts and scripts are given."""
    lines = (re.sub(r'\[[\w-]+=[^]]*\]', '', line) for line in text.splitlines())
    return ''.join(f'{line}\n' for line in lines if line and line[0] != '/')


@pytest.mark.parametrize('name', CASES)
def test_a_sheet_is_as_it_was_kept(name, kept):
    file = flat(json.loads(diagnosis_text(whole(name), ())), '')
    lines = (f'{at} {value}\n' for at, value in file if at != '/version')
    kept(name, told_of(name) + ''.join(lines))


@pytest.mark.parametrize(('name', 'other'), [
    (name, other) for name, others in CASES.items() for other in others
])  # fmt: skip
def test_what_is_said_otherwise_is_as_it_was_kept(name, other, kept):
    here, base = words(told(CASES[name][other]())), words(told_of(name))
    kept(f'{name}-{other.replace(" ", "_")}', here, base)


def test_a_curve_is_recommended_by_what_falls(monkeypatch):
    """The worst spot of all samples has the largest noise, and may stay where the whole gets better."""
    case = nameless('angle')
    for largest, words in (
        (0.7e-3, 'the largest deviation goes from 0.900 mm to 0.700 mm.'),
        (0.905e-3, 'the RMS goes from 0.400 mm to 0.300 mm.'),
    ):
        remaining = mending.Remaining(4e-4, 3e-4, 9e-4, largest)
        monkeypatch.setattr(mending, 'remaining_without', lambda *_, kept=remaining: kept)
        said = mending.look_at(case, 0)[-1].replace('\N{NO-BREAK SPACE}', ' ')
        assert said.endswith(f'(weld-twin correct): {words}')
