# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A study that was stopped goes on where it stopped, and takes no folder of somebody else."""

from argparse import Namespace

import pytest

from weld_twin_core.errors import DataError
from weld_twin_lab.study import Parts, Study


def test_a_study_that_was_stopped_makes_only_what_is_missing(tmp_path):
    made = []

    def make(name):
        made.append(name)
        if made == ['a', 'b']:
            raise KeyboardInterrupt
        return {'name': name}

    def study():
        part = Parts(tmp_path / 'parts')
        return [part(name, lambda name=name: make(name)) for name in 'abc']

    with pytest.raises(KeyboardInterrupt):
        study()
    assert [entry['name'] for entry in study()] == ['a', 'b', 'c']
    assert made == ['a', 'b', 'b', 'c']


def test_a_folder_with_something_else_in_it_is_refused(tmp_path):
    Study(Namespace(out=tmp_path / 'not there yet')).refuse_foreign('parts')
    ours = Study(Namespace(out=tmp_path))
    (tmp_path / 'parts').mkdir()
    ours.write('result', {})  # and is made again when it was done
    ours.refuse_foreign('parts', 'result.json')
    (tmp_path / 'thesis.tex').touch()
    with pytest.raises(DataError, match='something else'):
        ours.refuse_foreign('parts', 'result.json')
