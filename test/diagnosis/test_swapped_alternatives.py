# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Alternatives and impossible effects make room for what explains the same and can be."""

import numpy as np
import pytest
from diagnosis_cells import effect, tiny

from weld_twin_core import Beliefs, JointMotion, Measurements, Recording, Twin
from weld_twin_core.diagnosis import pipeline
from weld_twin_core.diagnosis.algebra.fit import fit
from weld_twin_core.diagnosis.algebra.problem import Problem
from weld_twin_core.diagnosis.algebra.workspace import Part, Role, ranking
from weld_twin_core.diagnosis.evidence import Alternative
from weld_twin_core.diagnosis.hypotheses import alternatives, search
from weld_twin_core.diagnosis.hypotheses.other_sets import Other, Sets, reconsidered
from weld_twin_core.diagnosis.hypotheses.selection import implausible
from weld_twin_core.diagnosis.result import Site
from weld_twin_core.effects.plausible import beyond

TRUE = (
    effect('joint_offset', joint='elbow_joint', offset=6e-4),
    effect('link_length', joint='shoulder_lift_joint', da=4e-4),
)
"""What the tool of the cell really does."""
IDLE = effect('gear_ratio', joint='wrist_3_joint')
"""An effect that these data do not show."""


def test_an_alternative_that_earns_no_place_takes_none_from_what_was_found(monkeypatch):
    problem, model = tiny(TRUE)
    work, now = search.workspace(problem, model.with_found(TRUE), (), Beliefs())

    def chosen(work, now, k, others):
        own = Alternative(Site(now.model.found[k].name, now.model.found[k].site), 6.2, now, 0.4)
        if k == 0:
            return (own,)
        idle = work.fitted_with(now.model.without(k), IDLE)
        assert [e.name for e in idle.model.found] == ['joint_offset', 'gear_ratio']
        return Alternative(Site(IDLE.name, IDLE.site), 7.7, idle, 0.6), own

    monkeypatch.setattr(search, 'fit_alternatives', chosen)
    kept, candidate_sets = search.settled(work, now, str)
    assert [e.name for e in kept.model.found] == ['joint_offset', 'link_length']
    assert len(candidate_sets) == 2


def test_alternatives_are_fitted_from_what_the_others_are_beside_what_was_found(monkeypatch):
    # Without the zero the length goes far off to make up for it; an alternative to the zero need not.
    problem, model = tiny(TRUE)
    work, now = search.workspace(problem, model.with_found(TRUE), (), Beliefs())
    beside = now.model.found[1]
    alone = work.without(now, 0).model.found[0]
    assert abs(alone.number('da') - beside.number('da')) > 1e-5
    starts = []
    monkeypatch.setattr(
        type(work), 'fitted_with', lambda self, start, effect: starts.append(start) or now
    )
    alternatives.fit_alternatives(work, now, 0)
    assert starts
    assert all(start.found[0].number('da') == beside.number('da') for start in starts)


def test_what_other_waves_of_a_joint_do_without_has_them_as_an_alternative():
    ratio = effect('gear_ratio', joint='elbow_joint', scale=2e-4)
    third, others = (
        effect('transmission_ripple', joint='elbow_joint', amplitude=a, order=o, phase=0.1)
        for a, o in ((2e-4, 3), ([2e-4, 1e-4], [2, 4]))
    )
    problem, model = tiny((ratio, third))
    work, now = search.workspace(problem, model.with_found((ratio, third)), (), Beliefs())
    instead = Other(Part(Site.of(ratio)), work.fitted(model.with_found((others,))), -0.5)
    sites = [one.site for one in alternatives.fit_alternatives(work, now, 0, [instead])[:2]]
    assert sites == [Site.of(ratio), Site.of(others)]


def test_what_stands_for_several_gives_way_to_them():
    problem, model = tiny(TRUE)
    stand_ins = (effect('base_pose'), effect('tool_pose'))
    work, now = search.workspace(problem, model.with_found(stand_ins), (), Beliefs())
    kept, candidate_sets = search.settled(work, now, str)
    assert {(e.name, e.site) for e in kept.model.found} == {(e.name, e.site) for e in TRUE}
    assert kept.rss < 0.1 * now.rss
    assert len(candidate_sets) == 2


@pytest.mark.parametrize(
    ('amplitude', 'order'), [([6e-4, 1e-3, 3e-4, 1.4e-3], [4, 1, 5, 3]), (1.2e-3, 2)]
)
def test_wrong_waves_give_way_to_a_zero_and_the_right_wave(amplitude, order):
    joint = 'elbow_joint'
    zero, wave = (
        effect('joint_offset', joint=joint, offset=-1e-3),
        effect('transmission_ripple', joint=joint, amplitude=1.9e-3, order=3, phase=-0.75),
    )
    problem, model = tiny((zero, wave))
    stand_in = {'amplitude': amplitude, 'order': order, 'phase': 0.1}
    ripple = effect('transmission_ripple', joint=joint, **stand_in)
    work, now = search.workspace(problem, model.with_found((ripple,)), (), Beliefs())
    kept, _ = search.settled(work, now, str)
    found = {e.name: e for e in kept.model.found}
    assert found.keys() == {'joint_offset', 'transmission_ripple'}
    assert found['transmission_ripple'].order == 3
    assert found['joint_offset'].number('offset') == pytest.approx(-1e-3, abs=5e-5)


@pytest.mark.parametrize(('order', 'wrong'), [(3, 2), (2, 1)])
def test_a_single_wave_gives_way_to_one_of_another_order(order, wrong):
    right, stand_in = (
        effect(
            'transmission_ripple', joint='shoulder_pan_joint', amplitude=3e-4, order=o, phase=0.1
        )
        for o in (order, wrong)
    )
    problem, model = tiny((right,), align=('base', 'tool'))
    work, now = search.workspace(problem, model.with_found((stand_in,)), (), Beliefs())
    kept, _ = reconsidered(work, now, Sets.about(work, now))
    assert [e.order for e in kept.model.found] == [order]


@pytest.mark.parametrize(('back', 'rounds'), [(0.0, 3), (0.4, 3), (0.0, 1)])
def test_the_model_holds_the_likeliest_of_twins_and_not_the_one_that_came_first(
    monkeypatch, back, rounds
):
    problem, model = tiny(TRUE)
    first = effect('gear_ratio', joint='elbow_joint')
    work, now = search.workspace(problem, model.with_found((first, TRUE[1])), (), Beliefs())

    def chosen(work, now, k, others):
        own, other = (
            now.model.found[k],
            TRUE[0] if now.model.found[k].name == first.name else first,
        )
        sites = Site(own.name, own.site), Site(other.name, other.site)
        if own.name == TRUE[1].name:
            return (Alternative(sites[0], 9.0, now, 1.0),)
        instead = work.fitted_with(now.model.without(k), other)
        ahead = 0.4 if own.name == first.name else back
        order = (
            Alternative(sites[1], 9.0, instead, 0.55),
            Alternative(sites[0], 9.0 - ahead, now, 0.45),
        )
        return order if ahead else order[::-1]

    monkeypatch.setattr(search, 'fit_alternatives', chosen)
    monkeypatch.setattr(search, 'reconsidered', lambda work, now, sets: (now, ()))
    monkeypatch.setattr(search, 'ROUNDS', rounds)
    kept, candidate_sets = search.settled(work, now, str)
    assert {(e.name, e.site) for e in kept.model.found} == {(e.name, e.site) for e in TRUE}
    assert len(candidate_sets) == len(kept.model.found)  # of each, however late one was exchanged


@pytest.mark.parametrize('source', ['shoulder_lift_joint', 'wrist_1_joint'])
def test_a_joint_at_rest_may_be_turned_by_whichever_neighbour_could(source):
    """Near zero the one had to turn it by more than gears leak; at rest either does it alike."""
    problem, model = tiny()
    q = problem.recordings[0].joints.q.copy()
    q[:, 1:4] = -1.0, 1.2, 0.01
    still = Recording('still', JointMotion(np.arange(float(len(q))), q, static=True))
    zero = effect('joint_offset', joint='elbow_joint', offset=1e-3)
    seen = Twin(model.robot, [zero]).poses(still).position
    seen = seen + np.random.default_rng(5).normal(scale=2e-5, size=seen.shape)
    problem = Problem((still.with_measured(Measurements(still.joints.t, seen)),))
    work, now = search.workspace(problem, model, (), Beliefs())
    seeds = [seed for unit in work.library.units for seed in unit.seeds]
    mine = [
        (s.name, s.site, getattr(s, 'source', '')) == ('joint_coupling', 'elbow_joint', source)
        for s in seeds
    ]
    systems, units = work.beside(now), work.library.units
    (choice,) = ranking(systems, units, 100.0, roles=tuple(Role), open_to=np.array(mine))
    possible = alternatives._possible(work, now.model, choice, now, 100.0)
    assert possible.rss < 0.01 * now.rss
    assert beyond(model.robot, *possible.model.found) == []


LINK = effect('link_length', joint='shoulder_lift_joint', da=4e-4)


def looked_for(frequency, damping, gain):
    """Return what a search finds, and refuses, of a link and a swing of the elbow."""
    swing = effect(
        'vibration', joint='elbow_joint', frequency=frequency, damping=damping, gain=gain
    )
    problem, model = tiny((swing, LINK), static=False, count=300)
    work, now = search.workspace(problem, model, (), Beliefs())
    found, refused = search.forward(work, now, 8)
    return {(e.name, e.site) for e in found.model.found}, {(e.name, e.site) for e in refused}


@pytest.mark.parametrize('frequency', [3.8, 4.0])
def test_a_swing_that_is_damped_as_none_is_hides_no_link(frequency):
    found, _ = looked_for(frequency, 0.85, 0.3)
    assert ('link_length', 'shoulder_lift_joint') in found


def test_a_swing_that_is_larger_than_any_ends_the_search():
    found, refused = looked_for(4.0, 0.1, 12.0)
    # What would explain the rest is a wave that no machine has, either.
    swing, wave = ('vibration', 'elbow_joint'), ('transmission_ripple', 'shoulder_lift_joint')
    assert (found, refused) == (set(), {swing, wave})


def test_what_stands_in_for_several_makes_room_when_one_of_them_drives_it_beyond_its_limits():
    wave = {'joint': 'elbow_joint', 'amplitude': 8e-4, 'order': 20, 'phase': 0.4}
    true = (
        effect('backlash', joint='elbow_joint', width=1.2e-3),
        effect('transmission_ripple', **wave),
    )
    problem, model = tiny(true, static=False, count=400)
    first = effect('hysteresis', joint='elbow_joint', amplitude=6e-4, travel=2.5e-3)
    work, now = search.workspace(problem, model.with_found((first,)), (), Beliefs())
    assert not implausible(now.model)
    found, refused = search.forward(work, now, 8)
    assert {e.name for e in found.model.found} == {e.name for e in true}
    assert not refused


@pytest.mark.parametrize(('offset', 'put_back'), [(2e-3, True), (2.0, False)])
def test_frames_stay_where_putting_them_back_takes_what_no_machine_has(
    monkeypatch, offset, put_back
):
    zero = effect('joint_offset', joint='elbow_joint', offset=6e-4)
    problem, model = tiny((zero,))
    found = search.search(problem, model, (), Beliefs(), str)
    other = effect('joint_offset', joint='elbow_joint', offset=offset)
    moved = fit(problem, found.final.model.with_found((other,)), found.scale, None, 0)
    monkeypatch.setattr(pipeline, 'keep_open_directions', lambda *asked: moved)
    assert (pipeline._near_given_frames(found, model.robot).final is moved) == put_back
