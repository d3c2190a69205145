# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How many readings may be called strays before they are structure."""

import numpy as np
import pytest

from weld_twin_core.diagnosis.algebra.fit import trusted


@pytest.mark.parametrize(('strays', 'few', 'left_out'), [(2, 1, 1), (2, 3, 2), (5, 3, 3)])
def test_only_a_few_of_seventy_stations_are_left_out(strays, few, left_out):
    weights = np.ones(70)
    weights[:strays] = np.linspace(0.01, 0.1, strays)
    good = trusted([weights], few)[0]
    assert (~good).sum() == left_out
    assert good[strays:].all()
