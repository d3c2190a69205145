# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What no machine has: a search passes it over, and goes back to it where it still explains the rest.

Frames are not put back to where they were given if that takes an effect so large.
"""

import pytest
from diagnosis_cells import effect, tiny

from weld_twin_core.diagnosis import pipeline
from weld_twin_core.diagnosis.algebra.fit import fit
from weld_twin_core.diagnosis.beliefs import Beliefs
from weld_twin_core.diagnosis.hypotheses import search
from weld_twin_core.diagnosis.hypotheses.selection import implausible

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
    assert (found, refused) == (set(), {('vibration', 'elbow_joint')})


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
