# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A bag from what is whole of another: of one whose recorder died, or that was damaged since."""

import json
import os
import shutil
import sqlite3
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, Any
from zlib import crc32

from mcap.records import Channel as ChannelRecord
from mcap.records import Chunk, Footer, Message, Schema
from mcap.stream_reader import StreamReader
from rosbags.interfaces import Qos
from rosbags.rosbag2.metadata import parse_qos

from weld_twin_core.errors import DataError

from ..files.whole_files import followed
from ..messages.typestore import TYPES, decode, types_with
from .reader import SET_BACK, look, storage_files, unlz4, unzstd
from .segment import SUFFIXES, Channel, Segments, clear_write_errors, sync
from .writers import NOTES, UNFINISHED, custom_data, is_growing, lock, unfinished

Salvaged = tuple[Channel, int, bytes]
"""Channel, time of recording [ns] and serialised message."""


class Damage:
    """What was wrong with the files."""

    def __init__(self) -> None:
        self.sentences: list[str] = []

    def tell(self, path: Path, what: str) -> None:
        """Note something, once for each file."""
        sentence = f"'{path.name}' {what}"
        if sentence not in self.sentences:
            self.sentences.append(sentence)


def channel_of(topic: str, kind: str, definition: str, qos: Any) -> Channel:
    """Return the channel of a topic; of a definition nobody understands only the name is kept."""
    if kind in TYPES.types:
        return Channel(topic, kind, qos=_qos(qos))
    try:
        digest = types_with(kind, definition).hash_rihs01(kind)
        return Channel(topic, kind, definition, digest, _qos(qos))
    except Exception:  # a grammar and a type system, each with its own errors
        return Channel(topic, kind)


def _qos(text: Any) -> tuple[Qos, ...]:
    try:
        return tuple(parse_qos(text))
    except Exception:  # it is YAML from a broken file
        return ()


_UNPACK = {'': lambda data, _: data, 'zstd': unzstd, 'lz4': unlz4}


def salvage_mcap(path: Path, damage: Damage) -> Iterator[Salvaged]:
    """
    Yield messages in the order of the file, up to the first record that is not whole.

    A chunk whose content does not match its checksum is passed over and reported.
    """
    channels: dict[int, Channel] = {}
    schemas: dict[int, Schema] = {}
    complete = False
    with path.open('rb') as file:
        for record in _records(file, path.stat().st_size):
            complete = complete or isinstance(record, Footer)
            for inner in _opened(record, path, damage):
                if isinstance(inner, Schema):
                    schemas[inner.id] = inner
                elif isinstance(inner, ChannelRecord) and inner.id not in channels:
                    channels[inner.id] = _channel(inner, schemas)
                elif isinstance(inner, Message) and inner.channel_id in channels:
                    yield channels[inner.channel_id], inner.log_time, bytes(inner.data)
    if not complete:
        damage.tell(path, 'ends early')


class _Bounded:
    """A file that is never asked for more than it has, whatever length a record claims."""

    def __init__(self, file: IO[bytes], size: int) -> None:
        self._file = file
        self._remaining = size

    def read(self, size: int) -> bytes:
        """Return the next bytes, all of them."""
        if size > self._remaining:
            raise EOFError
        self._remaining -= size
        return self._file.read(size)


def _records(file: IO[bytes], size: int, *, inside: bool = False) -> Iterator[Any]:
    """Yield whole records, of a file or from inside a chunk, up to the first that is not."""
    bounded: Any = _Bounded(file, size)
    reader = StreamReader(bounded, skip_magic=inside, emit_chunks=True, record_size_limit=size)
    with suppress(Exception):  # a cut or flipped byte surfaces as anything from EOFError on
        yield from reader.records


def _opened(record: Any, path: Path, damage: Damage) -> Iterator[Any]:
    """Yield a record, or those inside when it is a chunk."""
    if not isinstance(record, Chunk):
        yield record
        return
    try:
        data = _UNPACK[record.compression](record.data, record.uncompressed_size)
        whole = len(data) == record.uncompressed_size
    except Exception:  # every compressor has its own errors
        whole = False
    if not whole or (record.uncompressed_crc and crc32(data) != record.uncompressed_crc):
        damage.tell(path, 'holds a damaged chunk, which is left out')
        return
    yield from _records(BytesIO(data), len(data), inside=True)


def _channel(record: ChannelRecord, schemas: dict[int, Schema]) -> Channel:
    schema = schemas.get(record.schema_id)
    kind = '' if schema is None else schema.name
    text = ''
    if schema is not None and schema.encoding == 'ros2msg':
        with suppress(UnicodeDecodeError):
            text = schema.data.decode()
    return channel_of(record.topic, kind, text, record.metadata.get('offered_qos_profiles', ''))


JOURNALS = ('-journal', '-wal')
"""Files beside a database in which a writer that died has left a step half done."""


def salvage_sqlite(path: Path, damage: Damage) -> Iterator[Salvaged]:
    """Yield messages in the order they were written, up to the first that cannot be read."""
    with ExitStack() as stack:
        try:
            base = _open(path, stack)
            channels = _channels(base)
            rows = base.execute('SELECT topic_id, timestamp, data FROM messages ORDER BY id')
            for number, log_ns, data in rows:
                if number in channels and isinstance(log_ns, int) and isinstance(data, bytes):
                    yield channels[number], log_ns, data
                else:
                    damage.tell(path, 'holds rows that are no messages, which are left out')
        except (sqlite3.Error, OverflowError) as error:
            damage.tell(path, f'is damaged ({error})')


def _open(path: Path, stack: ExitStack) -> sqlite3.Connection:
    """
    Open a database as it is, or as a copy that can be mended.

    Half a page at the end is cut off, for it would read as half a message and zeros.
    """
    journals = [file for file in _beside(path) if file.exists()]
    partial_page = path.stat().st_size % _page(path)
    mode = 'immutable=1'
    if journals or partial_page:
        folder = Path(
            stack.enter_context(TemporaryDirectory(dir=path.parent, prefix='.recovering-'))
        )
        for file in (path, *journals):
            shutil.copy(file, folder / file.name)
        path, mode = folder / path.name, 'mode=rw'
        os.truncate(path, path.stat().st_size - partial_page)
    base = sqlite3.connect(f'{path.resolve().as_uri()}?{mode}', uri=True)
    stack.enter_context(closing(base))
    base.execute('PRAGMA trusted_schema = OFF')
    base.execute('PRAGMA writable_schema = ON')  # or a file that lacks its last page is refused
    return base


def _page(path: Path) -> int:
    with path.open('rb') as file:
        size = int.from_bytes(file.read(18)[16:18], 'big')
    return 65536 if size == 1 else max(size, 512)


def _beside(path: Path) -> list[Path]:
    return [path.with_name(path.name + suffix) for suffix in JOURNALS]


def _channels(base: sqlite3.Connection) -> dict[Any, Channel]:
    listed = base.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
    tables = {name for (name,) in listed}
    if not {'messages', 'topics'} <= tables:  # a view of that name might never end
        raise sqlite3.DatabaseError('it lacks the tables of a bag')
    texts: dict[str, str] = {}
    if 'message_definitions' in tables:
        texts = dict(
            base.execute(
                'SELECT topic_type, encoded_message_definition FROM message_definitions '
                "WHERE encoding = 'ros2msg'"
            )
        )
    known = {row[1] for row in base.execute('PRAGMA table_info(topics)')}
    qos = 'offered_qos_profiles' if 'offered_qos_profiles' in known else "''"
    return {
        number: channel_of(str(topic), str(kind), str(texts.get(kind, '')), text)
        for number, topic, kind, text in base.execute(f'SELECT id, name, type, {qos} FROM topics')
    }


_STORAGE = {'.mcap': ('mcap', salvage_mcap), '.db3': ('sqlite3', salvage_sqlite)}
_SCRATCH = '.recovering'
_PARTED = (
    'was recorded while the clock was set back by {:.3f} s: what came after that is in a file of its '
    'own; where they are refused together, give each file as a recording'
)


@dataclass(frozen=True)
class Recovery:
    source: Path
    path: Path  # where from, and the new bag
    messages: dict[str, int]  # how many of each topic
    damage: tuple[str, ...]  # what was wrong, a sentence each


def recover(path: Path | str, out: Path | str | None = None) -> Recovery:
    """
    Make a bag of all messages that are whole; the source stays as it is.

    Parameters
    ----------
    path : Path or str
        What the recorder was told to write, its unfinished directory, or any broken bag.
    out : Path or str, optional
        Must not exist. Left out, the name the recorder was to give, or ``NAME_recovered``.

    Raises
    ------
    DataError
        Nothing is there, it is still being recorded, it holds no whole message, or the place
        cannot be written.

    """
    source = _source(Path(path))
    target = _target(source) if out is None else followed(out)
    if target.exists():
        raise DataError(f"'{target}' exists already and is not overwritten; choose with --out")
    damage = Damage()
    with _locked(source), clear_write_errors(target, _elsewhere), _scratch(target) as folder:
        counts = _copy(source, folder, target.name, damage)
        if not counts:
            said = '; '.join(damage.sentences) or 'there is none'
            raise DataError(f"'{source}' holds no whole message: {said}")
        if target.exists():
            raise DataError(f"'{target}' has appeared meanwhile and is not overwritten")
        folder.rename(target)
        sync(target.parent)
    return Recovery(source, target, dict(counts), tuple(damage.sentences))


def _elsewhere() -> str:
    """Return what may help where the copy cannot be written."""
    return '; say a place on another disk with --out'


def _source(path: Path) -> Path:
    if not path.exists() and unfinished(path).is_dir():
        return unfinished(path)
    if not path.exists():
        raise DataError(f"there is no bag at '{path}'")
    if path.is_file() and path.suffix not in SUFFIXES:
        raise DataError(f"'{path}' is no bag: expected a directory, a .mcap or a .db3 file")
    return path


def _target(source: Path) -> Path:
    name = source.stem if source.is_file() else source.resolve().name
    if name.endswith(UNFINISHED):
        return source.resolve().with_name(name[: -len(UNFINISHED)])
    return source.resolve().with_name(f'{name}_recovered')


def _files(source: Path) -> list[Path]:
    """Return the storage files; the last of a growing bag lies in a directory of its own."""
    if source.is_file():
        return [source]
    files = storage_files(source)
    if is_growing(source):
        folders = (item for item in source.iterdir() if item.is_dir())
        files += [file for folder in folders for file in storage_files(folder)]
    if not files:
        raise DataError(f"'{source}' is no bag: it holds no .mcap or .db3 file")
    return files


@contextmanager
def _locked(source: Path) -> Iterator[None]:
    """Keep the recorder, and another recovery, off an unfinished bag."""
    lock_file = lock(source) if is_growing(source) else -1
    try:
        yield
    finally:
        if lock_file >= 0:
            os.close(lock_file)


@contextmanager
def _scratch(target: Path) -> Iterator[Path]:
    """Yield a new hidden directory, which is gone afterwards unless it was renamed."""
    target.parent.mkdir(parents=True, exist_ok=True)
    folder = target.with_name(f'.{target.name}{_SCRATCH}')
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _copy(source: Path, folder: Path, name: str, damage: Damage) -> Counter[str]:
    counts: Counter[str] = Counter()
    files = _files(source)
    storage = _STORAGE[files[0].suffix][0]
    segments = Segments(folder, name, storage)
    latest: dict[str, int] = {}
    try:
        for k, file in enumerate(files):
            if k:
                segments.split()
            for result in _STORAGE[file.suffix][1](file, damage):
                topic, log_ns = result[0].topic, result[1]
                back = latest.get(topic, log_ns) - log_ns
                if back > SET_BACK:
                    segments.split()
                    latest.clear()
                    damage.tell(file, _PARTED.format(back * 1e-9))
                latest[topic] = log_ns
                _write(segments, result, file, counts, damage)
        custom: dict[str, str] = {}
        with suppress(Exception):  # it is beside a broken bag and may be broken itself
            if (source / NOTES).is_file():
                custom = custom_data(json.loads((source / NOTES).read_bytes()))
            else:
                custom = {str(key): str(value) for key, value in look(source).custom.items()}
        segments.finish(custom | custom_data({'recovered': damage.sentences}))
    finally:
        segments.growing.abort()
    return counts


def _write(
    segments: Segments, result: Salvaged, file: Path, counts: Counter[str], damage: Damage
) -> None:
    channel, log_ns, data = result
    try:
        if channel.type in TYPES.types:
            decode(data, channel.type)
    except Exception:  # half a message surfaces as anything
        damage.tell(file, 'holds broken messages, which are left out')
        return
    try:
        segments.growing.write(channel, data, log_ns)
    except DataError as error:
        damage.tell(file, f'is recovered without some of its messages: {error}')
    else:
        counts[channel.topic] += 1
