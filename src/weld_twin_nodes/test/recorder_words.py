# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a recorder has heard of the nodes beside it, and what it has recorded."""

import json

from weld_twin_msgs_py.bags import BagReader


def heard_of(cell, recorder_process):
    """Wait until every node has told of itself to the recorder at least once."""
    assert recorder_process.code is None
    own = {cell.node.get_name(), 'recorder'}

    def silent():
        told = json.loads(cell.trigger('/recorder/counts').message)['told_by']
        return {f'/{name}' for name in set(cell.node.get_node_names()) - own} - set(told)

    cell.wait(lambda: not silent(), lambda: f'the recorder to hear of {silent()}')


def numbers(path):
    """Return the numbers of the messages in a bag, in its order: their nanoseconds."""
    with BagReader(path) as bag:
        return [m.message.header.stamp.nanosec for m in bag.messages(['/joint_states'])]
