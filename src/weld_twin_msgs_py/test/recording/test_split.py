# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Bags of several files: written here and elsewhere, and a writer that never waits."""

import shutil
import threading
import tracemalloc

import pytest
import yaml
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.bags import BackgroundBag, BagReader, GrowingBag, bag_info
from weld_twin_msgs_py.messages.typestore import TYPES

COUNT = 1200


def write(path, numbered, storage, **options):
    bag = GrowingBag(path, storage=storage, **options).open()
    for number in range(COUNT):
        bag.write_cdr(*numbered(number))
    bag.close()


def files(path):
    return sorted(item.name for item in path.iterdir())


def test_a_bag_is_split_by_size(tmp_path, storage, numbered, numbers):
    write(tmp_path / 'bag', numbered, storage, split_bytes=30_000)
    suffix = {'mcap': 'mcap', 'sqlite3': 'db3'}[storage]
    parts = [file for file in (tmp_path / 'bag').iterdir() if file.suffix != '.yaml']
    assert files(tmp_path / 'bag')[0] == f'bag_0.{suffix}'
    assert len(parts) > 2
    assert max(part.stat().st_size for part in parts) < 60_000
    assert numbers(tmp_path / 'bag') == list(range(COUNT))


def test_a_bag_is_split_by_time(tmp_path, storage, numbered):
    write(tmp_path / 'bag', numbered, storage, split_ns=500_000_000)
    listed = yaml.safe_load((tmp_path / 'bag' / 'metadata.yaml').read_text())
    listed = listed['rosbag2_bagfile_information']
    assert [file['message_count'] for file in listed['files']] == [500, 500, 200]
    assert listed['message_count'] == COUNT
    assert listed['duration'] == {'nanoseconds': (COUNT - 1) * 1_000_000}
    assert [file['path'] for file in listed['files']] == listed['relative_file_paths']


def test_another_reader_takes_the_split_bag_for_one(tmp_path, storage, numbered):
    write(tmp_path / 'bag', numbered, storage, split_bytes=30_000)
    with Reader(tmp_path / 'bag') as reader:
        assert reader.message_count == COUNT
        assert [c.msgcount for c in reader.connections] == [COUNT]
    with AnyReader([tmp_path / 'bag'], default_typestore=TYPES) as reader:
        stamps = [stamp for _, stamp, _ in reader.messages()]
    assert stamps == sorted(stamps)
    assert len(stamps) == COUNT


def test_a_split_bag_reads_in_the_order_of_its_numbers_without_metadata(
    tmp_path, numbered, numbers
):
    write(tmp_path / 'bag', numbered, 'mcap', split_ns=100_000_000)
    assert len(files(tmp_path / 'bag')) == 13
    (tmp_path / 'bag' / 'metadata.yaml').unlink()
    assert numbers(tmp_path / 'bag') == list(range(COUNT))


def rosbag2_bag(tmp_path, storage, numbered, mode):
    """Make a bag as `ros2 bag record --max-bag-duration` does: NAME_0, NAME_1, one listing."""
    plugin = {'mcap': StoragePlugin.MCAP, 'sqlite3': StoragePlugin.SQLITE3}[storage]
    (tmp_path / 'bag').mkdir()
    listings = []
    for part in range(2):
        writer = Writer(tmp_path / f'bag_{part}', version=8, storage_plugin=plugin)
        if mode is not None:
            writer.set_compression(mode, CompressionFormat.ZSTD)
        with writer as bag:
            topic, kind, _, _ = numbered(0)
            connection = bag.add_connection(topic, kind, typestore=TYPES)
            for number in range(part * 50, part * 50 + 50):
                _, _, data, log_ns = numbered(number)
                bag.write(connection, log_ns, data)
        text = (tmp_path / f'bag_{part}' / 'metadata.yaml').read_text()
        listings.append(yaml.safe_load(text)['rosbag2_bagfile_information'])
        (tmp_path / f'bag_{part}' / 'metadata.yaml').unlink()
        for file in (tmp_path / f'bag_{part}').iterdir():
            shutil.move(file, tmp_path / 'bag')
    paths = [path for listing in listings for path in listing['relative_file_paths']]
    made = {**listings[0], 'relative_file_paths': paths, 'message_count': 100}
    made['topics_with_message_count'][0]['message_count'] = 100
    text = yaml.safe_dump({'rosbag2_bagfile_information': made})
    (tmp_path / 'bag' / 'metadata.yaml').write_text(text)


@pytest.mark.parametrize('mode', [None, CompressionMode.FILE, CompressionMode.MESSAGE])
def test_split_bags_of_rosbag2_read_compressed_or_not(tmp_path, storage, numbered, numbers, mode):
    rosbag2_bag(tmp_path, storage, numbered, mode)
    assert numbers(tmp_path / 'bag') == list(range(100))
    assert bag_info(tmp_path / 'bag').topics[0].count == 100


def test_a_file_of_a_split_bag_that_is_gone_is_named(tmp_path, numbered):
    write(tmp_path / 'bag', numbered, 'mcap', split_ns=500_000_000)
    (tmp_path / 'bag' / 'bag_1.mcap').unlink()
    with pytest.raises(DataError, match=r"lists 'bag_1\.mcap', which is not there"):
        BagReader(tmp_path / 'bag').__enter__()


class SlowBag(GrowingBag):
    """A disk that stands still until it is let go."""

    def __init__(self, *args, **options):
        super().__init__(*args, **options)
        self.go = threading.Event()

    def write_cdr(self, *args):
        self.go.wait(60.0)
        super().write_cdr(*args)


def test_a_slow_disk_costs_messages_that_are_counted_and_no_memory(tmp_path, numbered, numbers):
    bag = SlowBag(tmp_path / 'bag')
    writer = BackgroundBag(bag, flush_every=0.1, most_bytes=100_000)
    tracemalloc.start()
    taken = [writer.put(*numbered(number)) for number in range(20_000)]
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    bag.go.set()
    writer.close()
    written, dropped = writer.counts()
    assert written == {'/joint_states': taken.count(True)}
    assert dropped == {'/joint_states': taken.count(False)}
    assert written['/joint_states'] + dropped['/joint_states'] == 20_000
    assert 0 < written['/joint_states'] < 1000
    assert peak < 1e6
    assert numbers(tmp_path / 'bag') == [n for n, took in enumerate(taken) if took]


class FullBag(GrowingBag):
    """A disk that is full after some messages."""

    def write_cdr(self, *args):
        if args[3] > 1_100_000_000:
            raise DataError('no space left')
        super().write_cdr(*args)


def test_a_bag_that_can_no_longer_be_written_counts_what_it_loses(tmp_path, numbered):
    writer = BackgroundBag(FullBag(tmp_path / 'bag'), flush_every=0.1, most_bytes=10_000_000)
    for number in range(COUNT):
        writer.put(*numbered(number))
    with pytest.raises(DataError, match='no space left'):
        writer.close()
    assert not writer.put(*numbered(0))
    written, dropped = writer.counts()
    assert written.get('/joint_states', 0) + dropped['/joint_states'] == COUNT + 1
    assert (tmp_path / 'bag.unfinished').is_dir()


def test_a_bag_that_cannot_be_opened_says_so_at_once(tmp_path):
    (tmp_path / 'bag').mkdir()
    with pytest.raises(DataError, match='exists already'):
        BackgroundBag(GrowingBag(tmp_path / 'bag'), flush_every=0.1, most_bytes=1000)
