# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is gained on parts that take turns in being unseen, worked out by hand."""

import numpy as np
import pytest

from weld_twin_core.diagnosis.unseen.folds import gain, growth, jackknife


def test_a_gain_counts_parts_and_not_samples():
    # Two parts of four samples; the error falls from 4 to 1 in one and from 4 to 3 in the other.
    before, labels = np.full(8, 4.0), np.repeat([0, 1], 4)
    after = np.where(labels == 0, 1.0, 3.0)
    told = gain(before, after, labels)
    assert (told.share, told.rms_m) == (0.5, pytest.approx(np.sqrt(2.0)))
    # Falls of 3 and 1: mean 2, standard error sqrt(2) / sqrt(2).
    assert told.steady == pytest.approx(2.0)
    assert gain(np.repeat(before, 9), np.repeat(after, 9), np.repeat(labels, 9)) == told


def test_where_other_samples_are_trusted_parts_are_still_compared_with_themselves():
    before, after = np.array([2.0, 2.0, 8.0]), np.array([1.0, 4.0])
    told = gain(before, after, np.array([0, 0, 1]), np.array([0, 1]))
    assert told.steady == pytest.approx(np.mean([1.0, 4.0]) / (1.5 * np.sqrt(2.0) / np.sqrt(2.0)))


def test_leaving_one_out_gives_the_variance_of_a_mean():
    values = np.array([1.0, 4.0, -2.0, 3.0, 0.5])
    tries = np.array([np.delete(values, k).mean() for k in range(values.size)])
    assert jackknife(tries) == pytest.approx(values.var(ddof=1) / values.size)


def test_an_error_grows_by_what_it_does_and_falls_only_where_that_is_no_chance():
    before = np.array([1.0, 1.0, 4.0, 4.2, 1.0, 3.0, 9.0])
    after = np.array([4.0, 4.0, 1.0, 1.1, 3.0, 0.5, 16.0])
    parts = np.array([0, 0, 1, 1, 2, 2, 3])
    expected = [1.0, np.sqrt(2.1 / 8.2) - 1.0, 0.0, 1.0 / 3.0]
    np.testing.assert_allclose(growth(before, after, parts), expected)
