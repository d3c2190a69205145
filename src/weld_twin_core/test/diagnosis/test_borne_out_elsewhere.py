# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Rivals that are alike on the recordings fitted, and part on one held out."""

from dataclasses import dataclass, field
from types import SimpleNamespace

import pytest

from weld_twin_core.diagnosis.beliefs import Beliefs
from weld_twin_core.diagnosis.hypotheses.rivals import Rival
from weld_twin_core.diagnosis.result import Site
from weld_twin_core.diagnosis.unseen import held_out_shrink as room
from weld_twin_core.diagnosis.unseen.held_out_shrink import borne_out

TWIST, BASE, PLAY = Site('link_twist', 'a'), Site('base_pose', None), Site('backlash', 'b')


def fitted(*sites, left=0.0):
    """Return a fit of effects at some sites that leaves something on held-out data [m]."""
    found = tuple(SimpleNamespace(name=site.effect, site=site.joint) for site in sites)
    return SimpleNamespace(model=SimpleNamespace(found=found), left=left)


@dataclass(frozen=True)
class Found:
    """A search of which only slots and fits are asked; one effect was refused, so none is exchanged."""

    slots: tuple
    final: object = field(default_factory=lambda: fitted(TWIST))
    small: object = field(default_factory=lambda: fitted(TWIST, PLAY))


def parted(monkeypatch, *slot):
    """Return what is left of a slot, given sites, probabilities and what each leaves [m]."""
    monkeypatch.setattr(room, 'left_on', lambda found, holdout, beliefs: found.final.left)
    rivals = tuple(Rival(site, 0.0, fitted(site, left=left), p) for site, p, left in slot)
    found = borne_out(Found((rivals,)), ['held out'], Beliefs())
    return {r.site: r.probability for r in found.slots[0]}


def test_a_rival_that_fails_where_the_leader_holds_is_not_its_like(monkeypatch):
    told = parted(monkeypatch, (TWIST, 0.6, 1e-4), (BASE, 0.2, 1.06e-4), (PLAY, 0.2, 1e-4))
    assert told == pytest.approx({TWIST: 0.75, PLAY: 0.25})


def test_a_rival_that_leaves_five_percent_more_is_still_alike(monkeypatch):
    told = parted(monkeypatch, (TWIST, 0.6, 1e-4), (BASE, 0.4, 1.04e-4))
    assert told == {TWIST: 0.6, BASE: 0.4}


def test_a_leader_that_fails_itself_rules_nothing_out(monkeypatch):
    told = parted(monkeypatch, (TWIST, 0.6, 3e-4), (BASE, 0.4, 1e-4))
    assert told == {TWIST: 0.6, BASE: 0.4}


def test_what_looked_likelier_here_and_fails_there_is_out_however_sure_it_was(monkeypatch):
    told = parted(monkeypatch, (BASE, 0.9, 3e-4), (TWIST, 0.08, 1e-4), (PLAY, 0.02, 9e-4))
    assert told == pytest.approx({TWIST: 0.8, PLAY: 0.2})


def test_a_sure_leader_and_a_diagnosis_without_held_out_data_are_not_asked():
    slots = ((Rival(TWIST, 0.0, fitted(TWIST), 0.9), Rival(BASE, 0.0, fitted(BASE), 0.1)),)
    assert borne_out(Found(slots), ['held out'], Beliefs()).slots == slots
    unsure = Found(((Rival(TWIST, 0.0, fitted(TWIST), 0.6), Rival(BASE, 0.0, fitted(BASE), 0.4)),))
    assert borne_out(unsure, [], Beliefs()) == unsure
