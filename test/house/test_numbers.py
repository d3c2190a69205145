# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Few tuned numbers decide whether data are sound, and what counts as one is told."""

import sys

from import_graph import ROOT

sys.path.insert(0, str(ROOT / 'tools'))

from numbers_tuned import CORE, tuned

SOUNDNESS = 40
"""Tuned numbers of all checks of data and set-up together."""


def test_units_and_indices_are_no_tuned_numbers_and_defaults_are(tmp_path):
    source = tmp_path / 'some.py'
    source.write_text(
        'FAR = 0.05\nSHAPE = np.zeros((5, 7))\nDEGREE = 0.0174\nEACH = a[4:9] + 1e-3**2\n'
        'def f(x, few=12):\n    return f"{x * 7.5} mm" + str(x / 2.0 - 3 * x) + g(x, axis=5, b=0.7)\n'
    )
    assert list(tuned(source)) == [(1, 0.05), (5, 12.0), (6, 0.7)]


def test_checks_of_data_and_set_up_share_few_numbers():
    found = {path.name: list(tuned(path)) for path in (CORE / 'diagnosis/soundness').glob('*.py')}
    assert sum(map(len, found.values())) <= SOUNDNESS, found
