# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""An oracle that knows the plant is sure of what the data tell, and of nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from weld_twin_lab.belief import oracle
from weld_twin_lab.belief.trial import SEVERAL, drawn

pytest.importorskip('mujoco')


@pytest.fixture
def case():
    """One cause at stations: a twist, of a size that shows."""
    case = drawn(4401, 330, SEVERAL).case
    assert (case.lot.motion, case.lot.families) == ('stations', ('link_twist',))
    return case


def sure_of(case, times):
    """How sure the oracle is of the case's cause at so many times its size, against few others."""
    grown = replace(case, causes=[oracle.scaled(case.causes[0], times)])
    return oracle.of_one(grown, 0, SEVERAL, np.random.default_rng(1))


def test_what_shows_is_sure_and_what_does_not_is_shared(case, monkeypatch):
    monkeypatch.setattr(oracle, 'FAMILIES', ('link_twist', 'joint_offset', 'axis_parallelism'))
    monkeypatch.setattr(oracle, 'DRAWS', 1)
    monkeypatch.setattr(oracle, 'STRATA', ((1e-3, 1.0), (1.0, 100.0)))
    plain, faint = sure_of(case, 1.0), sure_of(case, 0.02)
    assert plain > 0.99
    assert faint > 0.99  # what differs by less than the noise predicts as well
    monkeypatch.setattr(oracle, 'AS_WELL', 0.0)
    assert sure_of(case, 0.02) < 0.2  # any of the others does as well
