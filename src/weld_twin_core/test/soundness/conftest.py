# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Fixtures of the soundness tests."""

import numpy as np
import pytest


@pytest.fixture
def rng():
    return np.random.default_rng(7)
