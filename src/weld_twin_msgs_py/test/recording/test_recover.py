# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a recording that was cut short gives back."""

import multiprocessing
import os
import resource
import shlex
import shutil
import signal
import sqlite3
import time
from contextlib import closing

import pytest
from mcap.reader import make_reader
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.bags import BagReader, GrowingBag, bag_info, provenance, recover

FLUSHED, WRITTEN = 700, 950


def growing(path, numbered, count=FLUSHED, each=FLUSHED, **options):
    """Return a bag that is being written, its messages flushed so many at a time."""
    bag = GrowingBag(path, **options).open()
    for number in range(count):
        bag.write_cdr(*numbered(number))
        if number % each == each - 1:
            bag.flush()
    return bag


@pytest.fixture
def cut_short(tmp_path, storage, numbered):
    """Return the name of a recording of which some messages were flushed and others not."""
    path = tmp_path / 'bag'
    options = {'split_bytes': 30_000, 'provenance': {'seed': 7}}
    bag = growing(path, numbered, storage=storage, **options)
    for number in range(FLUSHED, WRITTEN):
        bag.write_cdr(*numbered(number))
    bag.release()
    return path


def last_file(folder):
    """Return the file that was growing."""
    return next(
        file
        for item in folder.iterdir()
        if item.is_dir()
        for file in item.iterdir()
        if file.suffix in ('.mcap', '.db3')
    )


def record(path, storage, messages, told, limit):
    """Record in a process whose files may have so many bytes, and wait for its end."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    bag = GrowingBag(path, storage=storage).open()
    try:
        for k, message in enumerate(messages):
            bag.write_cdr(*message)
            if k % 50 == 49:
                bag.flush()
                told.send(k + 1)
        told.send('all')
        time.sleep(60.0)
    except DataError as error:
        bag.release()
        told.send(str(error))


def recorded_beside(path, storage, messages, limit=resource.RLIM_INFINITY):
    """Record in another process; return it, how much it had flushed, and what it said then."""
    context = multiprocessing.get_context('fork')
    here, there = context.Pipe()
    process = context.Process(target=record, args=(path, storage, messages, there, limit))
    process.start()
    flushed, said = 0, here.recv()
    while isinstance(said, int):
        flushed, said = said, here.recv()
    return process, flushed, said


def test_a_killed_process_has_kept_what_it_had_flushed(tmp_path, storage, numbered, numbers):
    messages = [numbered(number) for number in range(FLUSHED + 49)]
    process, flushed, said = recorded_beside(tmp_path / 'bag', storage, messages)
    os.kill(process.pid, signal.SIGKILL)
    process.join()
    recover(tmp_path / 'bag')
    found = numbers(tmp_path / 'bag')
    assert said == 'all' and len(found) >= flushed == FLUSHED
    assert found == list(range(len(found)))


def test_what_was_flushed_is_recovered_and_the_original_stays(cut_short, storage, numbers):
    unfinished = cut_short.with_name('bag.unfinished')
    before = {file: file.read_bytes() for file in unfinished.rglob('*') if file.is_file()}
    done = recover(cut_short)
    found = numbers(cut_short)
    assert FLUSHED <= len(found) <= WRITTEN
    assert found == list(range(len(found)))
    assert done.messages == {'/joint_states': len(found)}
    assert provenance(cut_short)['seed'] == 7
    assert any('recovered' in key for key in provenance(cut_short))
    assert {file: file.read_bytes() for file in unfinished.rglob('*') if file.is_file()} == before
    assert {item.name for item in cut_short.parent.iterdir()} == {'bag', 'bag.unfinished'}
    if storage == 'mcap':  # which another tool reads, too
        count = 0
        for file in cut_short.glob('*.mcap'):
            with file.open('rb') as stream:
                count += sum(1 for _ in make_reader(stream, validate_crcs=True).iter_messages())
        assert count == len(found)


@pytest.mark.parametrize('tail', [b'', b'\0' * 5000, os.urandom(5000), b'\x06\xff' * 500])
def test_a_tail_the_disk_never_got_costs_only_itself(tmp_path, storage, numbered, numbers, tail):
    """After a power cut a file may have grown by blocks whose content was never written."""
    bag = growing(tmp_path / 'bag', numbered, storage=storage)
    bag.release()
    file = last_file(bag.folder)
    with file.open('ab') as stream:
        stream.write(tail)
    recover(tmp_path / 'bag')
    assert numbers(tmp_path / 'bag') == list(range(FLUSHED))


def test_a_chunk_with_a_flipped_bit_is_left_out_and_told(tmp_path, numbered, numbers):
    bag = growing(tmp_path / 'bag', numbered, 300, 100)
    bag.release()
    file = last_file(bag.folder)
    whole = bytearray(file.read_bytes())
    whole[len(whole) // 2] ^= 0x10
    file.write_bytes(whole)
    done = recover(tmp_path / 'bag')
    assert numbers(tmp_path / 'bag') == [*range(100), *range(200, 300)]
    assert any('damaged chunk' in sentence for sentence in done.damage)


@pytest.mark.parametrize('share', [0.6, 0.9])
def test_a_bag_cut_anywhere_gives_what_lies_before_the_cut(
    tmp_path, storage, numbered, numbers, share
):
    growing(tmp_path / 'bag', numbered, each=50, storage=storage).close()
    file = next(item for item in (tmp_path / 'bag').iterdir() if item.suffix != '.yaml')
    file.write_bytes(file.read_bytes()[: int(share * file.stat().st_size)])
    done = recover(tmp_path / 'bag')
    assert done.path == tmp_path / 'bag_recovered'
    found = numbers(done.path)
    assert 0.3 * FLUSHED < len(found) < FLUSHED
    assert done.damage
    # Pages of a database are not in the order of its rows, so a cut may fall between some.
    prefix = list(range(len(found)))
    assert found == (prefix if storage == 'mcap' else sorted(set(found) & set(range(FLUSHED))))


def test_a_step_a_database_was_in_is_undone(tmp_path, numbered, numbers):
    bag = growing(tmp_path / 'bag', numbered, storage='sqlite3')
    file = last_file(bag.folder)
    committed = file.read_bytes()
    bag.release()
    with closing(sqlite3.connect(file, isolation_level=None)) as base:
        base.execute('PRAGMA journal_mode = DELETE')
        base.execute('PRAGMA cache_size = 1')
        base.execute('BEGIN')
        base.execute('UPDATE messages SET data = zeroblob(500)')
        # What a kill leaves here: pages of the update in the file, what they were in a journal.
        journal = file.with_name(file.name + '-journal').read_bytes()
        half_done = file.read_bytes()
    assert half_done != committed
    file.write_bytes(half_done)
    file.with_name(file.name + '-journal').write_bytes(journal)
    recover(tmp_path / 'bag')
    assert numbers(tmp_path / 'bag') == list(range(FLUSHED))


def test_every_reader_leads_to_the_command(cut_short):
    command = f"'weld-twin bag recover {cut_short}'"
    for path in (cut_short, cut_short.with_name('bag.unfinished')):
        with pytest.raises(DataError, match='cut short') as caught:
            bag_info(path)
        assert command in str(caught.value)
    with pytest.raises(DataError, match='is not overwritten') as caught:
        GrowingBag(cut_short).open()
    assert command in str(caught.value)


def test_a_recording_that_still_runs_is_left_alone(tmp_path, numbered):
    bag = growing(tmp_path / 'bag', numbered, 1, 1)
    with pytest.raises(DataError, match='is still being recorded'):
        recover(tmp_path / 'bag')
    bag.close()


def test_nothing_stays_of_a_recovery_that_finds_nothing(tmp_path):
    (tmp_path / 'bag').mkdir()
    (tmp_path / 'bag' / 'bag_0.mcap').write_bytes(b'\x89MCAP0\r\n')
    with pytest.raises(DataError, match='holds no whole message'):
        recover(tmp_path / 'bag')
    assert [item.name for item in tmp_path.iterdir()] == ['bag']
    with pytest.raises(DataError, match='there is no bag at'):
        recover(tmp_path / 'nowhere')


def test_types_nobody_here_knows_are_recovered_too(tmp_path, storage):
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg('float64 current\n', 'their_msgs/msg/Arc'))
    plugin = {'mcap': StoragePlugin.MCAP, 'sqlite3': StoragePlugin.SQLITE3}[storage]
    with Writer(tmp_path / 'bag', version=9, storage_plugin=plugin) as bag:
        arc = bag.add_connection('/arc', 'their_msgs/msg/Arc', typestore=store)
        bag.write(arc, 5, b'\0\1\0\0' + b'\0' * 8)
    (tmp_path / 'bag' / 'metadata.yaml').unlink()
    assert recover(tmp_path / 'bag').messages == {'/arc': 1}
    with BagReader(tmp_path / 'bag_recovered') as reader:
        assert list(reader.raw(['/arc'])) == [
            ('/arc', 'their_msgs/msg/Arc', 5, b'\0\1\0\0' + b'\0' * 8)
        ]


def test_a_full_disk_is_told_in_a_sentence_and_keeps_what_was_on_it(
    tmp_path, storage, numbered, numbers
):
    messages = [numbered(number) for number in range(4000)]
    process, flushed, said = recorded_beside(tmp_path / 'bag', storage, messages, 200_000)
    process.join()
    assert process.exitcode == 0
    assert f"bag '{tmp_path}/bag' cannot be written: " in said
    assert f"'weld-twin bag recover {tmp_path}/bag'" in said
    recover(tmp_path / 'bag')
    found = numbers(tmp_path / 'bag')
    assert len(found) >= flushed > 0
    assert found == list(range(len(found)))


def test_what_happens_to_a_recording_from_outside_is_told_and_the_command_works(
    tmp_path, storage, numbered
):
    bags = [GrowingBag(tmp_path / name, storage=storage).open() for name in ('gone', 'taken')]
    for bag in bags:
        bag.write_cdr(*numbered(1))
    shutil.rmtree(bags[0].folder)
    with pytest.raises(DataError, match=r'was removed while it was written$'):
        bags[0].flush()
    bags[1].path.mkdir()
    with pytest.raises(DataError, match='appeared meanwhile; what was recorded') as told:
        bags[1].close()
    command = shlex.split(str(told.value).partition("kept: '")[2].rstrip("'"))
    assert command[3] == str(bags[1].folder)
    assert recover(command[3], command[5]).messages == {'/joint_states': 1}
