# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Thousands of numbers are written as the general emitter writes them, and read back the same."""

import numpy as np
import pytest
import yaml

from weld_twin_msgs_py.files.yaml_file import numbers_text, yaml_text


@pytest.mark.parametrize('shape', [(1,), (60,), (40, 6), (3, 1)])
def test_numbers_are_those_of_the_general_emitter(shape):
    rng = np.random.default_rng(1)
    values = rng.normal(size=shape) * 10.0 ** rng.integers(-12, 3, shape)
    values.flat[0] = 1e-5
    if values.size > 3:
        values.flat[1:4] = 0.0, -2e22, 1e16
    text = numbers_text('q', values)
    assert text == yaml_text({'q': values.tolist()})
    np.testing.assert_array_equal(yaml.safe_load(text)['q'], values)
