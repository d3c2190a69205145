# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What closes an investigation was learned from the table that is kept, and is judged on other cells."""

import json
from pathlib import Path

import numpy as np
import pytest

from weld_twin_lab.experiments.study import closing_page as page
from weld_twin_lab.experiments.study import heard, reached, unseen, weights
from weld_twin_nodes.offline.investigation import AGAINST, BEGIN, FOR, OWN

KEPT = Path(__file__).parents[4] / 'docs/results/investigate/learned.json'


def answer(own, same, against, right):
    return {'signs': [own, same, against], 'stated': True, 'right': right}


def test_the_weights_are_those_of_the_table():
    found = weights(heard(json.loads(KEPT.read_text(encoding='utf-8'))['cases']))
    kept = (OWN, FOR, AGAINST, BEGIN)
    assert [*found.slopes, found.bias] == pytest.approx(kept, abs=0.006)


def test_the_first_answer_that_is_believed_counts_and_what_says_nothing_does_not():
    silent = {'signs': [9.0, 9.0, 0.0], 'stated': False, 'right': False}
    cells = [
        {'rounds': [{'heard': {'together': answer(1, 0, 0, False)}}, {'heard': {}}]},
        {
            'rounds': [
                {'heard': {'together': answer(2, 2, 0, True), 'alone': answer(3, 2, 0, True)}},
                {'heard': {'together': answer(4, 3, 0, False), 'alone': silent}},
            ]
        },
        {'rounds': [{'heard': {'together': answer(4, 4, 0, False)}}]},
    ]
    all_ = heard(cells)
    assert len(all_.right) == 5
    believed = np.array([0.5, 0.9, 0.96, 0.99, 0.97])
    assert reached(all_, believed, 0.95) == (1, 1)
    assert reached(all_, believed, 0.98) == (0, 1)


def test_agreement_is_learned_and_judged_on_cells_that_were_not_learned_from():
    rng = np.random.default_rng(2)
    cells = []
    for _ in range(120):
        right = bool(rng.random() < 0.6)
        same = float(rng.normal(3.0 if right else 0.5)) if rng.random() < 0.9 else 0.0
        told = answer(float(rng.normal(0.5)), max(same, 0.0), 0.0, right)
        cells.append({'rounds': [{'heard': {'together': told}}]})
    all_ = heard(cells)
    own, same, _ = weights(all_).slopes
    assert same > own > 0.0
    probability = unseen(all_)
    assert probability[all_.right].mean() > probability[~all_.right].mean() + 0.3
    assert '120 answers of 120 cells' in page(cells)
