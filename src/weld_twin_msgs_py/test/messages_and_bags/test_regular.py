# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A bag read by the thousand against the same bag read message by message."""

import numpy as np
import pytest

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.assembly import Intake, Role
from weld_twin_msgs_py.bags import BagReader, BagWriter, from_bag, read_recording, write_recording
from weld_twin_msgs_py.bags.from_bag import Stream, fill_regular
from weld_twin_msgs_py.messages.topics import TopicNames

ROLES = {
    TopicNames().joints: Role.JOINTS,
    TopicNames().pose: Role.POSE,
    TopicNames().wrench: Role.WRENCH,
    TopicNames().temperature: Role.TEMPERATURE,
}


@pytest.fixture
def messages(tmp_path, recording, robot):
    """Topic, type, time and bytes of the first half second of a usual bag."""
    write_recording(tmp_path / 'usual', recording, robot)
    with BagReader(tmp_path / 'usual') as bag:
        return list(bag.raw(bag.topics))[:100]


def write(path, messages, storage='mcap'):
    with BagWriter(path, storage=storage) as bag:
        for topic, kind, log_ns, data in messages:
            bag.write_cdr(topic, kind, bytes(data), log_ns)
    return path


def everything(path, robot):
    """Return what reading a bag gives, refusals included, as something that compares."""
    try:
        got = read_recording(path, robot)
    except DataError as error:
        return str(error)
    arrays = [got.joints.t, got.joints.q, got.joints.qd]
    if got.measured is not None:
        seen = got.measured
        arrays += [seen.t, seen.position, seen.rotation, seen.sigma]
    for signal in (got.wrench, got.temperature):
        arrays += [] if signal is None else [signal.t, signal.value]
    numbers = [None if each is None else each.tobytes() for each in arrays]
    return numbers, got.notes, got.incomplete, got.wrench_frame, got.epoch_ns, got.joints.static


def at_once(path, robot):
    with BagReader(path) as bag:
        streams = {role: Stream(topic, Intake.width(role, robot)) for topic, role in ROLES.items()}
        return fill_regular(bag, ROLES, streams, Intake(robot, limits=False))


def one_by_one(path, robot, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(from_bag, 'fill_regular', lambda *_: False)
        return everything(path, robot)


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_the_usual_bag_is_read_at_once_and_alike(tmp_path, robot, messages, storage, monkeypatch):
    bag = write(tmp_path / 'bag', messages, storage)
    assert at_once(bag, robot)
    assert everything(bag, robot) == one_by_one(bag, robot, monkeypatch)


def _flip(data, rng):
    data[rng.integers(len(data))] ^= 1 << rng.integers(8)


def _not_a_number(data, rng):
    data[-8:] = np.array(rng.choice([np.nan, np.inf, -np.inf, 1e300])).tobytes()


def _unset_stamp(data, _):
    data[4:12] = bytes(8)


def _stamp_of_another_time(data, rng):
    data[4:8] = int(rng.integers(-5, 2**31 - 1)).to_bytes(4, 'little', signed=True)


def _big_endian(data, _):
    data[1] = 0


def _rubbish_in_padding(data, _):
    data[2:4] = b'\x5a\x5a'


def _shorter(data, rng):
    del data[int(rng.integers(len(data))) :]


def _longer(data, rng):
    data += bytes(int(rng.integers(1, 9)))


CHANGES = (_flip, _not_a_number, _unset_stamp, _stamp_of_another_time)
CHANGES += (_big_endian, _rubbish_in_padding, _shorter, _longer)


@pytest.mark.parametrize('seed', range(2))
@pytest.mark.parametrize('change', CHANGES)
def test_changed_messages_give_the_same_samples_or_the_same_refusal(
    tmp_path, robot, messages, monkeypatch, change, seed
):
    rng = np.random.default_rng(seed)
    changed = [(topic, kind, ns, bytearray(data)) for topic, kind, ns, data in messages]
    for _ in range(rng.integers(1, 4)):
        change(changed[rng.integers(len(changed))][3], rng)
    bag = write(tmp_path / 'bag', changed)
    assert everything(bag, robot) == one_by_one(bag, robot, monkeypatch)


@pytest.mark.parametrize('seed', range(2))
def test_messages_in_another_order_are_read_alike(tmp_path, robot, messages, monkeypatch, seed):
    """Recorded late, twice, or not at all: each topic then has gaps, repeats or steps back."""
    rng = np.random.default_rng(seed)
    order = np.arange(len(messages))
    first, second = rng.integers(len(messages), size=2)
    order[first], order[second] = order[second], order[first]
    times = sorted(message[2] for message in messages)
    shuffled = [(*messages[k][:2], ns, messages[k][3]) for k, ns in zip(order, times, strict=True)]
    del shuffled[int(rng.integers(len(shuffled)))]
    shuffled.insert(int(first) // 2, shuffled[int(first) // 2])
    bag = write(tmp_path / 'bag', shuffled)
    assert everything(bag, robot) == one_by_one(bag, robot, monkeypatch)


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_damaged_files_are_read_alike(tmp_path, robot, messages, storage, monkeypatch):
    bag = write(tmp_path / 'bag', messages, storage)
    file = next(path for path in bag.iterdir() if path.suffix != '.yaml')
    whole = file.read_bytes()
    for place in np.random.default_rng(2).integers(0, len(whole), 12):
        damaged = bytearray(whole)
        damaged[place] ^= 0xFF
        file.write_bytes(damaged)
        assert everything(bag, robot) == one_by_one(bag, robot, monkeypatch)


def test_of_a_bag_that_is_only_looked_through_the_last_samples_are_kept_alone():
    kept, passing = (Stream('/joint_states', 2, kept=keep) for keep in (True, False))
    for stream in (kept, passing):
        for k in range(100):
            stream.extend(np.arange(10 * k, 10 * k + 10), np.full((10, 2), float(k)))
        stream.append(1000, (7.0, 8.0))
    assert (len(kept), len(passing)) == (1001, 1)
    np.testing.assert_array_equal(passing.samples().rows, kept.samples().rows[-1:])
