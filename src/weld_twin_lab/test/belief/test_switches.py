# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Mechanisms taken out of the diagnosis for a while, and only for that while."""

from importlib import import_module

import pytest

from weld_twin_core.errors import DataError
from weld_twin_lab.belief.switches import MECHANISMS, ROOMS, without


def functions():
    return {
        name: getattr(import_module(f'{ROOMS}.{own.module}'), own.name)
        for name, own in MECHANISMS.items()
    }


def test_every_mechanism_is_out_while_asked_and_back_afterwards():
    usual = functions()
    with without(tuple(MECHANISMS)):
        out = functions()
    assert all(out[name] != usual[name] for name in MECHANISMS)
    assert functions() == usual


def test_a_mechanism_is_back_after_a_failure():
    usual = functions()
    with pytest.raises(ZeroDivisionError), without(['many']):
        1 / 0  # noqa: B018
    assert functions() == usual


def test_a_name_that_is_none_is_refused_in_a_sentence():
    with (
        pytest.raises(DataError, match="no mechanism 'magic'; they are library_again"),
        without(['magic']),
    ):
        pass
