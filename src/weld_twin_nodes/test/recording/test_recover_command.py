# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The command that recovers a recording which was cut short."""

import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
from command_line import done, refused, weld_twin

from weld_twin_msgs_py.bags import BagReader, GrowingBag
from weld_twin_msgs_py.messages.to_messages import bag_messages
from weld_twin_msgs_py.messages.topics import JOINT_STATES
from weld_twin_msgs_py.messages.typestore import TYPES

FLUSHED = 700


@pytest.fixture(params=['mcap', 'sqlite3'])
def cut_short(request, tmp_path):
    """Return the name of a recording whose recorder died after it had flushed."""
    bag = GrowingBag(tmp_path / 'bag', storage=request.param).open()
    for number in range(FLUSHED):
        state = bag_messages().joint_state(number, ('a', 'b'), np.zeros(2))
        data = bytes(TYPES.serialize_cdr(state, JOINT_STATES.type))
        bag.write_cdr(JOINT_STATES.name, JOINT_STATES.type, data, 1_000_000 * number)
    bag.flush()
    bag.release()
    return tmp_path / 'bag'


def test_the_command_that_is_printed_for_a_full_disk_works(cut_short, monkeypatch):
    """The disk of the recording has no room left for a copy; that of the present directory has."""
    here = cut_short.parent.parent / f'elsewhere_{cut_short.parent.name}'
    here.mkdir()
    monkeypatch.chdir(here)
    room = shutil.disk_usage(here)
    full = room._replace(free=9_000_000)  # enough for it alone, if nobody else wrote there
    usage = lambda place: full if Path(place) == cut_short.parent else room  # noqa: E731
    monkeypatch.setattr(shutil, 'disk_usage', usage)
    said = weld_twin('bag', cut_short)
    printed = re.search(r"'weld-twin (bag recover .*)'", said.err)
    assert printed is not None
    done(*shlex.split(printed[1]))
    with BagReader(here / 'bag') as bag:
        assert len(list(bag.messages([JOINT_STATES.name]))) == FLUSHED


def test_a_recording_that_was_cut_short_and_renamed_is_found_and_recovered(cut_short):
    renamed = cut_short.with_name('tuesday')
    cut_short.with_name('bag.unfinished').rename(renamed)
    assert f"'weld-twin bag recover {renamed}'" in refused('bag', renamed)
    done('bag', 'recover', renamed)
    with BagReader(cut_short.with_name('tuesday_recovered')) as bag:
        assert len(list(bag.messages([JOINT_STATES.name]))) == FLUSHED


def test_the_command_says_what_it_found_and_writes_where_it_is_told(cut_short):
    there = cut_short.parent / 'there'
    said = done('bag', 'recover', cut_short, '--out', there)
    with BagReader(there) as bag:
        count = len(list(bag.messages([JOINT_STATES.name])))
    assert count == FLUSHED
    assert f'{count}  /joint_states' in said
    assert 'the original stays' in said
    assert not cut_short.exists()
    assert 'is not overwritten' in refused('bag', 'recover', cut_short, '--out', there)
