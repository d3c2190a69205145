# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Broken files, and ones made to do harm, are read within bounds of time and memory."""

from __future__ import annotations

import faulthandler
import os
import resource
import shutil
import signal
import sqlite3
import struct
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from random import Random
from typing import Any

from lz4.frame import compress as lz4_compress

from weld_twin_core.errors import TwinError
from weld_twin_msgs_py.bags import bag_info, read_recording, recover
from weld_twin_msgs_py.bags.reader import zstd
from weld_twin_msgs_py.files.diagnosis_model import load_model
from weld_twin_msgs_py.files.path_file import read_path
from weld_twin_msgs_py.robots import load_robot

from .broken_files import ROBOT, Target, mutate, targets

CPU_LIMIT = 10.0
"""Seconds of computing a file may cost."""
WALL_LIMIT = 120.0
"""Seconds after which a reader that computes nothing is taken to hang."""
MEMORY_LIMIT = 1_000_000_000
"""Bytes a file may cost."""
BATCH = 400
"""Files read by one process."""


class Hang(BaseException):
    """The file has cost too much time; no `except Exception` takes it for damage."""


@dataclass
class Finding:
    """What a file did that it should not."""

    target: str
    case: int
    """With the seed of the campaign it makes the same file again."""
    what: str
    """Exception and the place in this project's code where it came from."""
    times: int = 1


@dataclass
class Tally:
    """How many files were read, refused in a sentence, or went wrong."""

    right: int = 0
    refused: int = 0
    wrong: int = 0


def case_bytes(target: Target, seed: int, name: str, case: int) -> bytes:
    """Return the broken file of a number."""
    rng = Random(f'{seed}/{name}/{case}')
    return mutate(rng, rng.choice(target.seeds), target.kind)


def hunt(name: str, seed: int, cases: int, known: dict[str, Finding]) -> Tally:
    """Read so many broken files of a kind; add what went wrong to what is known."""
    tally = Tally()
    done = 0
    while done < cases:
        last = min(done + BATCH, cases)
        with forked(_batch, name, seed, done, last) as here:
            done = _follow(here, name, done, last, tally, known)
    return tally


@contextmanager
def forked(work: Callable[..., None], *given: Any) -> Iterator[Connection]:
    """Yield what a process of its own sends; it gets the other end as its last argument."""
    context = get_context('fork')
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=work, args=(*given, there))
    process.start()
    there.close()
    try:
        yield here
    finally:
        process.kill()
        process.join()


def next_outcome(here: Connection) -> str:
    """Return what a process sends next, or why nothing came."""
    try:
        return str(here.recv()) if here.poll(WALL_LIMIT) else 'hangs without computing'
    except EOFError:
        return 'ends the process'


def _follow(
    here: Connection, name: str, case: int, last: int, tally: Tally, known: dict[str, Finding]
) -> int:
    """Take the results of a process until it ends; return the next case."""
    while case < last:
        outcome = next_outcome(here)
        if outcome == 'right':
            tally.right += 1
        elif outcome == 'refused':
            tally.refused += 1
        else:
            tally.wrong += 1
            finding = known.setdefault(f'{name}: {outcome}', Finding(name, case, outcome, 0))
            finding.times += 1
        case += 1
        if outcome.startswith(('hangs', 'ends', 'takes')):
            return case
    return case


def _batch(name: str, seed: int, first: int, last: int, out: Connection) -> None:
    target = targets()[name]
    guard()
    before = peak()
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / f'case{target.suffix}'
        for case in range(first, last):
            path.write_bytes(case_bytes(target, seed, name, case))
            outcome = read(target, path)
            if peak() - before > MEMORY_LIMIT:
                outcome = f'takes more than {MEMORY_LIMIT / 1e6:.0f} MB'
            out.send(outcome)
            if outcome.startswith('takes'):
                break
    out.close()
    os._exit(0)


def guard() -> None:
    """Bound what this process may take from now on."""
    faulthandler.disable()
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # the URDF parser comments on what it passes over
    warnings.simplefilter('ignore')
    signal.signal(signal.SIGPROF, _stop)
    pages = int(Path('/proc/self/statm').read_text().split()[0])
    limit = MEMORY_LIMIT * 2 + pages * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def read(target: Target, path: Path) -> str:
    """Return 'right' or 'refused', or what is wrong with how the file was taken."""
    signal.setitimer(signal.ITIMER_PROF, CPU_LIMIT)
    try:
        target.read(path)
    except TwinError as error:
        text = str(error)
        if '\n' in text or not text:
            return f'is refused in more than a sentence: {text[:80]!r}'
        return 'refused'
    except Hang:
        return f'hangs for {CPU_LIMIT:g} s of computing'
    except Exception as error:
        return f'{type(error).__name__} at {_place(error)}'
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    return 'right'


def _place(error: BaseException) -> str:
    """Return the last line of this project's own code in a traceback."""
    own = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if 'weld_twin' in frame.filename and 'campaigns' not in frame.filename
    ]
    if not own:
        return 'an unknown place'
    return f'{Path(own[-1].filename).name}:{own[-1].lineno} {own[-1].name}'


def _stop(*_: Any) -> None:
    raise Hang


def peak() -> int:
    """Return the most memory this process has held [bytes]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


GIGABYTE = 1_000_000_000
"""Bytes."""
Make = Callable[[Path], Path]


def harms() -> dict[str, tuple[Make, Callable[[Path], Any]]]:
    """Return what makes each file in a folder, and what reads it."""
    nested = '<robot name="x">' + '<link name="a">' * 60_000
    return {
        'URDF with entities that expand': (_laughs, load_robot),
        'URDF that names a file of the machine': (_outside, load_robot),
        'URDF nested deeply': (partial(_file, 'robot.urdf', nested), load_robot),
        'URDF with a chain of ten thousand links': (_long_chain, load_robot),
        'YAML aliases that expand': (_aliases, load_robot),
        'YAML nested deeply': (partial(_file, 'robot.yaml', '[' * 500_000), load_robot),
        'YAML that asks for a Python object': (_object, load_robot),
        'YAML path of a device': (_device, read_path),
        'JSON nested deeply': (
            partial(_file, 'diagnosis.json', '[' * 1_000_000),
            partial(load_model, ROBOT),
        ),
        'mcap chunk of zstd, a gigabyte of zeros': (partial(_bomb, 'zstd'), _bag),
        'mcap chunk of lz4, a gigabyte of zeros': (partial(_bomb, 'lz4'), _bag),
        'the same chunk with a small size declared': (partial(_bomb, 'zstd', declared=1000), _bag),
        'the same chunk, recovered': (partial(_bomb, 'zstd'), _recovered),
        'mcap record that claims 2^62 bytes': (_claim, _bag),
        'the same record, recovered': (_claim, _recovered),
        'bag file of zstd, gigabytes of zeros': (_packed_file, _bag),
        'message of zstd, a gigabyte of zeros': (_packed_message, _bag),
        'metadata.yaml that lists ../outside.mcap': (partial(_listing, '../outside.mcap'), _bag),
        'metadata.yaml that lists /etc/passwd': (partial(_listing, '/etc/passwd'), _bag),
        'metadata.yaml that lists a directory': (partial(_listing, '..'), _bag),
        'metadata.yaml nested deeply': (_nested_listing, _bag),
        'sqlite3 bag whose table is an endless query': (_endless, _bag),
        'the same bag, recovered': (_endless, _recovered),
    }


def try_all() -> dict[str, str]:
    """Return what became of each, each in a process of its own."""
    return {name: try_one(name) for name in harms()}


def try_one(name: str) -> str:
    """Return 'refused' with the sentence, or what went wrong."""
    with forked(_attempt, name) as here:
        return next_outcome(here)


def _attempt(name: str, out: Connection) -> None:
    make, reads = harms()[name]
    with tempfile.TemporaryDirectory() as place:
        path = make(Path(place))
        said: list[str] = []

        def tell(path: Path) -> None:
            try:
                reads(path)
            except TwinError as error:
                said.append(str(error).replace(place, ''))
                raise

        guard()
        before = peak()
        outcome = read(Target(path.suffix, '', (), tell), path)
        if peak() - before > MEMORY_LIMIT:
            outcome = f'takes more than {MEMORY_LIMIT / 1e6:.0f} MB'
        out.send(f'{outcome}: {said[0]}' if outcome == 'refused' else outcome)


def _bag(path: Path) -> Any:
    return bag_info(path), read_recording(path, ROBOT)


def _recovered(path: Path) -> Any:
    return recover(path, path.with_name('recovered'))


def _file(name: str, content: str | bytes, folder: Path) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def _laughs(folder: Path) -> Path:
    levels = ''.join(f'<!ENTITY a{k} "{f"&a{k - 1};" * 10}">' for k in range(1, 11))
    text = f'<!DOCTYPE robot [<!ENTITY a0 "ha">{levels}]><robot name="&a10;"/>'
    return _file('robot.urdf', text, folder)


def _outside(folder: Path) -> Path:
    text = '<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="&x;"/>'
    return _file('robot.urdf', text, folder)


def _long_chain(folder: Path) -> Path:
    links = ''.join(f'<link name="l{k}"/>' for k in range(10_000))
    joints = ''.join(
        f'<joint name="j{k}" type="fixed"><parent link="l{k}"/><child link="l{k + 1}"/></joint>'
        for k in range(9_999)
    )
    return _file('robot.urdf', f'<robot name="x">{links}{joints}</robot>', folder)


def _aliases(folder: Path) -> Path:
    lines = ['a0: &a0 [x, x, x, x, x, x, x, x, x, x]']
    for k in range(1, 10):
        aliases = ', '.join([f'*a{k - 1}'] * 10)
        lines.append(f'a{k}: &a{k} [{aliases}]')
    return _file('robot.yaml', '\n'.join(lines), folder)


def _object(folder: Path) -> Path:
    text = f'!!python/object/apply:os.system ["touch {folder}/done"]'
    return _file('robot.yaml', text, folder)


def _device(folder: Path) -> Path:
    (folder / 'path.yaml').symlink_to('/dev/zero')
    return folder / 'path.yaml'


def _zeros(pack: str) -> bytes:
    if pack == 'lz4':
        return bytes(lz4_compress(bytes(GIGABYTE)))
    packer = zstd.ZstdCompressor()
    out = [packer.compress(bytes(10_000_000)) for _ in range(GIGABYTE // 10_000_000)]
    return b''.join([*out, packer.flush()])


def _bomb(pack: str, folder: Path, declared: int = GIGABYTE) -> Path:
    data = _zeros(pack)
    name = pack.encode()
    chunk = struct.pack('<QQQI', 1, 2, declared, 0) + struct.pack('<I', len(name)) + name
    chunk += struct.pack('<Q', len(data)) + data
    return _mcap(folder, b'\x06' + struct.pack('<Q', len(chunk)) + chunk)


def _claim(folder: Path) -> Path:
    return _mcap(folder, b'\x05' + struct.pack('<Q', 1 << 62) + bytes(100))


def _mcap(folder: Path, record: bytes) -> Path:
    """Return an mcap without a summary that holds a record."""
    magic = b'\x89MCAP0\r\n'
    header = b'\x01' + struct.pack('<Q', 8 + 4) + struct.pack('<I', 4) + b'ros2'
    header += struct.pack('<I', 0)
    footer = b'\x02' + struct.pack('<Q', 20) + bytes(20)
    return _file('bag.mcap', magic + header + record + footer + magic, folder)


def _sample(folder: Path, storage: str = 'mcap') -> tuple[Path, str]:
    """Return a directory with a bag in it, and its metadata."""
    kinds = targets()
    bag = folder / 'bag'
    bag.mkdir()
    _file(f'bag{kinds[storage].suffix}', kinds[storage].seeds[0], bag)
    return bag, kinds['metadata'].seeds[0].decode()


def _listing(path: str, folder: Path) -> Path:
    bag, text = _sample(folder)
    shutil.copy(bag / 'bag.mcap', folder / 'outside.mcap')
    _file('metadata.yaml', text.replace('- bag.mcap', f"- '{path}'"), bag)
    return bag


def _nested_listing(folder: Path) -> Path:
    bag, _ = _sample(folder)
    _file('metadata.yaml', 'rosbag2_bagfile_information: ' + '[' * 1_000_000, bag)
    return bag


def _packed_file(folder: Path) -> Path:
    bag, text = _sample(folder)
    _file('bag.mcap.zstd', _zeros('zstd') * 3, bag)
    return _said_packed(bag, text.replace('- bag.mcap', '- bag.mcap.zstd'), 'file')


def _packed_message(folder: Path) -> Path:
    bag, text = _sample(folder, 'sqlite3')
    with closing(sqlite3.connect(bag / 'bag.db3')) as base, base:
        base.execute('UPDATE messages SET data = ?', (_zeros('zstd'),))
    text = text.replace('- bag.mcap', '- bag.db3').replace(': mcap', ': sqlite3')
    return _said_packed(bag, text, 'message')


def _said_packed(bag: Path, text: str, mode: str) -> Path:
    """Write the metadata of a bag that was packed by file or by message."""
    text = text.replace("compression_mode: ''", f'compression_mode: {mode}')
    _file('metadata.yaml', text.replace("compression_format: ''", 'compression_format: zstd'), bag)
    return bag


def _endless(folder: Path) -> Path:
    bag, _ = _sample(folder, 'sqlite3')
    with closing(sqlite3.connect(bag / 'bag.db3')) as base, base:
        base.execute('DROP TABLE messages')
        base.execute(
            'CREATE VIEW messages AS WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL SELECT id + 1 '
            'FROM n) SELECT id, 1 AS topic_id, id AS timestamp, zeroblob(100) AS data FROM n'
        )
    return bag / 'bag.db3'
