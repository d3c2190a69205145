# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What nodes tell of their messages, who is still to be met, and types nobody here knows."""

import json

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

pytest.importorskip('rclpy', reason='needs ROS 2')

from rosbags.highlevel import AnyReader

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.bags import BackgroundBag, GrowingBag
from weld_twin_msgs_py.bags.segment import Channel
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.to_messages import Status, bag_messages
from weld_twin_msgs_py.messages.typestore import TYPES
from weld_twin_nodes.live.recorded import NEW, SentBook, definition, shortfall
from weld_twin_nodes.live.trajectory_generator import apart, beyond
from weld_twin_nodes.live.words import Book, Sent, word

TWIN, INJECTOR = '/forward_kinematics_twin', '/error_injector'


def health(node, run='1', sent=None, **reached):
    values = {'sent': json.dumps(sent or {}), 'reached': json.dumps(reached), 'run': run}
    return {**values, 'node': node}


def take(book, values, at):
    """Give a book what a node tells with its health, if it is one of the project's."""
    told = word({values.get('node', 'somebody'): values}, at)
    if told is not None:
        book.take(told)


def test_the_last_word_of_every_start_of_every_node_counts():
    book = SentBook()
    take(book, health('/a', '1', {'/x': [10, 100, 900]}), 0.0)
    take(book, health('/a', '1', {'/x': [20, 100, 1900]}), 1.0)
    take(book, health('/a', '2', {'/x': [5, 2000, 2400]}), 2.0)
    take(book, health('/b', '1', {'/x': [3, 50, 60], '/y': [1, None, None]}), 2.0)
    assert book.sent('/x') == Sent(28, 50, 2400)
    assert book.sent('/y') == Sent(1)
    assert book.sent('/z') is None


@pytest.mark.parametrize('values', [{}, {'sent': 'x'}, {'sent': '[1]'}, {'sent': '{"/x": 3}'}])
@pytest.mark.parametrize('node', [{}, {'node': '/somebody'}])
def test_health_of_somebody_else_counts_nothing(values, node):
    book = SentBook()
    take(book, {**values, **node}, 0.0)
    assert book.sent('/x') is None
    assert apart(book, ['/somebody']) == []


def test_a_node_is_waited_for_until_it_has_told_or_never_will():
    book = SentBook()
    book.meet('/new', 10.0)
    assert book.silent_since(10.5) == ['/new']
    for look in np.arange(0.2, NEW + 0.3, 0.2):
        book.meet('/new', 10.0 + look)
    assert book.silent_since(10.5) == []  # a driver of somebody else
    take(book, health('/new', sent={'/x': [1, 1, 1]}), 10.2)
    assert book.silent_since(10.5) == ['/new']
    take(book, health('/new', sent={'/x': [2, 1, 2]}), 10.6)
    assert book.silent_since(10.5) == []


def test_a_node_of_the_project_is_never_taken_for_somebody_else():
    book = SentBook()
    for look in np.arange(0.0, 2 * NEW, 0.2):
        book.meet(TWIN, 10.0 + look)
        book.meet('/driver', 10.0 + look)
    assert book.silent_since(10.5) == book.silent_nodes() == [TWIN]


def test_a_node_that_did_not_hear_all_is_named():
    def listens(count, run='1'):
        return {**health(TWIN, run), 'heard': json.dumps({'/x': [1, count], '/y': [0, 0]})}

    book = SentBook()
    take(book, health('/a', sent={'/x': [100, 1, 100]}), 0.0)
    take(book, listens(0), 0.1)
    assert book.unheard([TWIN]) == []  # they may be under way
    take(book, health('/a', sent={'/x': [150, 1, 150]}), 1.0)
    take(book, listens(30), 1.1)
    assert book.unheard([INJECTOR]) == []
    assert book.unheard([TWIN]) == [
        f"{TWIN} has received 30 of 100 messages on '/x': what it publishes lacks the others"
    ]
    take(book, listens(150), 2.1)
    assert book.unheard([TWIN]) == []
    take(book, listens(3, '2'), 3.1)
    assert book.unheard([TWIN]) == []  # it was started anew, and counts anew


def test_time_in_which_the_recorder_stood_still_is_not_time_to_tell_in():
    book = SentBook()
    book.meet('/new', 10.0)
    book.meet('/new', 10.0 + 10 * NEW)
    assert book.silent_since(10.5) == ['/new']


@pytest.mark.parametrize(
    ('recorded', 'where'),
    [
        (Sent(9, 20, 100), 'at the start'),
        (Sent(9, 10, 90), 'at the end'),
        (Sent(8, 20, 90), 'at both ends'),
        (Sent(9, 10, 100), 'in between'),
        (Sent(0), 'from the first to the last'),
    ],
)
def test_where_messages_are_missing_shows_in_the_stamps(recorded, where):
    found = shortfall(Sent(10, 10, 100), recorded)
    assert found is not None
    assert found.where == where
    assert found.to_mapping()['missing'] == 10 - recorded.number


def test_nothing_is_missing_where_all_is_there_or_nobody_told():
    assert shortfall(Sent(10, 10, 100), Sent(10, 10, 100)) is None
    assert shortfall(Sent(10), Sent(12)) is None  # somebody else publishes there too
    assert shortfall(None, Sent(3)) is None


def told(book, node, inputs=(), heard=(), **reached):
    make = bag_messages()
    hears = json.dumps({topic: [count, 0] for topic, count in heard})
    own = Status(node, 0, '', {**health(node), 'reached': json.dumps(reached), 'heard': hears})
    others = [Status(f'{node}: {topic}', 0, '', {}) for topic in inputs]
    book.take(word(from_messages.diagnostics(make.statuses(1, [own, *others])), 1.0))


def test_nodes_have_met_when_each_reaches_all_who_listen():
    there, book = [TWIN, INJECTOR, '/recorder', '/driver'], Book()
    assert apart(book, there) == [
        f'{node} to tell of itself' for node in (TWIN, INJECTOR, '/recorder')
    ]
    told(book, '/recorder', ['/pose', '/joints'])
    told(book, INJECTOR, ['/joints'])
    told(book, TWIN, ['/joints'], **{'/pose': 0})
    assert apart(book, there) == [f'{TWIN} to reach /recorder on /pose']
    told(book, TWIN, ['/joints'], **{'/pose': 1})
    assert apart(book, there) == []
    assert apart(book, [INJECTOR]) == []
    told(book, '/recorder', ['/pose'], heard=[('/pose', 0)])
    assert apart(book, there) == [f'/recorder to hear {TWIN} on /pose']
    told(book, '/recorder', ['/pose'], heard=[('/pose', 1)])
    assert apart(book, there) == []


def test_whom_others_have_met_is_waited_for():
    book = Book()
    told(book, '/recorder', ['/pose'], heard=[('/pose', 2)], **{'/counts': 1})

    def seen(topic):
        return {'/pose': 2, '/counts': 1}[topic]

    def nothing(_):
        return 0

    assert beyond(book, ['/recorder'], seen, seen) == []
    assert beyond(book, ['/recorder'], nothing, seen) == [
        'somebody to be seen who sends /pose to /recorder'
    ]
    assert beyond(book, ['/recorder'], seen, nothing) == [
        'somebody to be seen who takes /counts from /recorder'
    ]
    assert beyond(book, [TWIN], nothing, nothing) == []


def test_the_definition_of_a_type_holds_all_it_is_made_of():
    for kind in ('sensor_msgs/msg/JointState', 'diagnostic_msgs/msg/DiagnosticArray'):
        store = get_typestore(Stores.EMPTY)
        store.register(get_types_from_msg(definition(kind), kind))
        assert store.hash_rihs01(kind) == TYPES.hash_rihs01(kind)
    with pytest.raises(DataError, match='install the package their_msgs'):
        definition('their_msgs/msg/Arc')


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_a_type_no_bag_here_knows_is_written_with_its_definition(tmp_path, storage):
    bag = BackgroundBag(
        GrowingBag(tmp_path / 'bag', storage=storage), flush_every=0.1, most_bytes=10_000
    )
    kind, data = 'their_msgs/msg/Arc', b'\0\1\0\0' + b'\0' * 8
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg('float64 current\n', kind))
    digest = store.hash_rihs01(kind)
    bag.announce(Channel('/arc', kind, 'float64 current\n', digest))
    assert bag.put('/arc', kind, data, 7)
    bag.close()
    with AnyReader([tmp_path / 'bag']) as reader:
        (connection,) = reader.connections
        assert connection.digest == digest
        assert [raw for _, _, raw in reader.messages()] == [data]
