# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Numbered messages, and what a bag holds of them."""

import numpy as np
import pytest

from weld_twin_msgs_py.bags import BagReader
from weld_twin_msgs_py.messages.to_messages import bag_messages
from weld_twin_msgs_py.messages.topics import JOINT_STATES

SECOND = 1_000_000_000


@pytest.fixture(params=['mcap', 'sqlite3'])
def storage(request):
    return request.param


@pytest.fixture
def numbered():
    """Return a maker of `write_cdr` arguments: the message of a number, 1 ms after the last."""
    from weld_twin_msgs_py.messages.typestore import TYPES

    make = bag_messages()

    def message(number):
        kind = JOINT_STATES.type
        state = make.joint_state(SECOND + number, ('a', 'b'), np.full(2, number * 1e-3))
        data = bytes(TYPES.serialize_cdr(state, kind))
        return JOINT_STATES.name, kind, data, SECOND + number * 1_000_000

    return message


@pytest.fixture
def numbers():
    """Return what tells the numbers of the messages in a bag, in its order."""

    def read(path):
        with BagReader(path) as bag:
            found = bag.messages([JOINT_STATES.name])
            return [m.message.header.stamp.nanosec for m in found]

    return read
