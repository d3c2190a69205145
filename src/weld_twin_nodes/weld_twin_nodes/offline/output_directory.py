# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Output folders: new files appear when all of them are made, and nothing of a person's is lost.

A file is ours as long as its digest is the one in the list of the folder (`LIST`). New files are made
in a scratch directory, together with a note of what is to happen with them. From the moment the note is
whole, the change is decided: who is killed while files are moved into place has the rest of them moved
by the next one who works in the folder. docs/folders.md says more.
"""

import fcntl
import json
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from functools import partial
from itertools import count
from pathlib import Path, PurePosixPath
from typing import Any

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.input_files import hashed
from weld_twin_msgs_py.files.scratch import Scratch, sweep
from weld_twin_msgs_py.files.whole_files import followed, write_text

LIST = '.weld_twin_files.json'
"""The list, in the folder that it speaks of."""
NOTE = 'change.json'
"""What is to happen with the files of a scratch directory; not there while they are being made."""
MADE = 'made'
"""Where they are made, in the scratch directory."""
SCHEMA = 'weld_twin/files/1'
_ABOUT = (
    'What weld-twin wrote here, with SHA-256. It replaces these files as long as nobody has changed '
    'them, and no others. Without this list it replaces nothing.'
)

LARGEST = 50_000_000
"""Bytes of a list or a note that are read; a list of 100,000 files has 15 million."""
_DAMAGED = (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError)
"""What reading a list or a note raises that somebody or something has changed."""

Digests = dict[str, str]
"""SHA-256 by the name of a file, relative to the folder, with slashes."""


@dataclass(frozen=True)
class Change:
    """What is to happen in a folder; plain values, for it is written down."""

    mark: str  # name of the result that the files belong to
    place: Mapping[str, str | None]
    """New files, in order, and the digest of what each may replace; None for nothing."""
    drop: Mapping[str, str]  # files of ours that were not made again, and their digests
    listed: Mapping[str, str]  # files of this result afterwards, and their digests


def files_of(folder: Path) -> Digests:
    """Return the digests of all files below a folder, but for the list itself."""
    names = [
        (Path(where) / name).relative_to(folder).as_posix()
        for where, _, files in os.walk(folder)
        for name in files
    ]
    return {name: digest(folder / name) for name in sorted(names) if name != LIST}


def digest(file: Path) -> str:
    """Return the SHA-256 of a file; of anything else, a word that no file has."""
    if file.is_symlink() or not file.is_file():
        return 'no file'
    return hashed('', file).sha256


def listed(folder: Path) -> dict[str, Digests]:
    """
    Return what the list of a folder holds: the files of every result, by its mark.

    A list that is damaged, of another version, or with a name that leads out of the folder lists
    nothing: what it may have meant is not ours.
    """
    try:
        content = _read(folder / LIST)
        results = content['results'] if content['schema'] == SCHEMA else {}
        return {str(mark): _digests(files) for mark, files in results.items()}
    except _DAMAGED:
        return {}


def write_list(folder: Path, results: Mapping[str, Mapping[str, str]]) -> None:
    content = {'schema': SCHEMA, 'about': _ABOUT, 'results': results}
    write_text(folder / LIST, json.dumps(content, indent=1) + '\n', overwrite=True)


def change_of(folder: Path, made: Mapping[str, str], mark: str, *, adds: bool) -> Change:
    """
    Return what is to happen in a folder so that it has the files made, by their digests.

    ``adds``: whether files of this result that were not made again stay.
    """
    own = listed(folder).get(mark, {})
    # The mark comes last: who finds the new one finds all the others.
    names = sorted(made, key=lambda name: (name == mark, name))
    place = {name: own.get(name) for name in names if digest(folder / name) != made[name]}
    remaining = {name: own[name] for name in own if name not in made}
    return Change(mark, place, {} if adds else remaining, {**(remaining if adds else {}), **made})


def in_the_way(folder: Path, change: Change) -> Iterator[str]:
    """Yield the files of a folder that a change would replace or drop, and that are not ours."""
    if _is_no_list(folder):
        yield LIST
    for name, ours in change.place.items():
        foreign = _foreign(folder, name, ours)
        if foreign is not None:
            yield foreign
    yield from changed(folder, change.drop)


def changed(folder: Path, own: Mapping[str, str]) -> list[str]:
    """Return the files that are there and are not what was written."""
    there = (_foreign(folder, name, own[name]) for name in own if _there(folder / name))
    return [name for name in dict.fromkeys(there) if name is not None]


def decide(scratch: Path, change: Change) -> None:
    """Write the note: from now on the change happens, whoever carries it out."""
    write_text(scratch / NOTE, json.dumps(asdict(change)) + '\n')


def carry_out(folder: Path, scratch: Path) -> None:
    """Do what the note of a scratch directory says and is not done; tell what was kept."""
    try:
        change = _decided(scratch / NOTE)
    except _DAMAGED:
        return
    made = scratch / MADE
    for name, ours in change.place.items():
        new = change.listed[name]
        if not _there(made / name) or _foreign(made, name, new) is not None:
            continue  # moved before the one who began was killed, or not what was made
        foreign = _foreign(folder, name, ours, new)
        if foreign is not None:
            _keep(folder, foreign)
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        os.replace(made / name, folder / name)
    for name, ours in change.drop.items():
        if not _there(folder / name):
            continue
        foreign = _foreign(folder, name, ours)
        if foreign is None:
            (folder / name).unlink()
            with suppress(OSError):
                for above in Path(name).parents:
                    if above != Path('.'):
                        (folder / above).rmdir()
        else:
            _keep(folder, foreign)
    if _is_no_list(folder):
        _keep(folder, LIST)
    write_list(scratch, {**listed(folder), change.mark: change.listed})
    os.replace(scratch / LIST, folder / LIST)


def sentence(folder: Path, mark: str, names: list[str]) -> str:
    """Return what stands in the way, and how to go on."""
    what = 'is there already, and no list says that weld-twin wrote it'
    if names[0] in listed(folder).get(mark, {}):
        what = 'was changed after weld-twin wrote it'
    more = f' (so it is with {len(names) - 1} more)' if len(names) > 1 else ''
    return (
        f"'{folder / names[0]}' {what}{more}; choose another --out, or give --force, which keeps it "
        f"as '{_kept_name(folder, names[0])}'"
    )


def _there(path: Path) -> bool:
    return os.path.lexists(path)


def _read(file: Path) -> Any:
    """Return what a file of ours holds; it may have come with a folder from anybody."""
    if file.is_symlink() or not file.is_file() or file.stat().st_size > LARGEST:
        raise ValueError('it is none of ours')
    return json.loads(file.read_text(encoding='utf-8'))


def _decided(note: Path) -> Change:
    change = Change(**_read(note))
    place = {name: None if ours is None else str(ours) for name, ours in change.place.items()}
    new = _digests(change.listed)
    if not place.keys() <= new.keys():
        raise ValueError('it places what it does not list')
    return Change(str(change.mark), place, _digests(change.drop), new)


def _digests(entries: Mapping[str, object]) -> Digests:
    """Return digests by names that stay in their folder, refused if one does not."""
    for name in entries:
        path = PurePosixPath(name)
        if not path.parts or path.is_absolute() or '..' in path.parts or '\0' in name:
            raise ValueError(f'{name!r} is no name of a file in this folder')
    return {name: str(value) for name, value in entries.items()}


def _is_no_list(folder: Path) -> bool:
    """Tell whether something else has the name of the list."""
    list_ = folder / LIST
    return _there(list_) and (list_.is_symlink() or not list_.is_file())


def _foreign(folder: Path, name: str, *ours: str | None) -> str | None:
    """Return what is not ours where a file of ours should be; None where nothing is."""
    blocking = _blocking(folder, name)
    if blocking is None and _there(folder / name) and digest(folder / name) not in ours:
        return name
    return blocking


def _blocking(folder: Path, name: str) -> str | None:
    """Return what stands where a folder of ours should be: a link or a file; None for nothing."""
    parts = Path(name).parts
    for k in range(1, len(parts)):
        above = folder / Path(*parts[:k])
        if above.is_symlink() or (_there(above) and not above.is_dir()):
            return above.relative_to(folder).as_posix()
    return None


def _keep(folder: Path, name: str) -> None:
    """Give a file that is not ours another name, and tell it."""
    new = _kept_name(folder, name)
    os.rename(folder / name, folder / new)
    print(f"weld-twin: '{name}' was not overwritten and is kept as '{new}'", file=sys.stderr)


def _kept_name(folder: Path, name: str) -> str:
    path = Path(name)
    names = (path.with_name(f'{path.stem}.kept-{k}{path.suffix}') for k in count(1))
    return next(new for new in names if not _there(folder / new)).as_posix()


def refuse(folder: Path, mark: str, names: list[str]) -> None:
    """Refuse a change that files are in the way of."""
    if names:
        raise DataError(sentence(folder, mark, names))


INSIDE = '.weld_twin-'
"""Prefix of scratch directories in a folder that is there already."""


@contextmanager
def new_directory(
    path: Path | str,  # a folder, new or there already. A link is followed
    *,
    mark: str,  # name of a file that the block makes, and by which the result is known
    force: bool = False,  # what is in the way gets another name; left out, it is refused
    adds: bool = False,  # files of the same result that are not made again stay, too
    # The folder may be anybody's; left out, one that holds other things alone is refused.
    shared: bool = False,
) -> Iterator[Path]:
    """
    Yield a hidden directory whose files come to ``path`` when the block succeeds.

    Files of the same result that were there are replaced, those not made again removed. Whatever a
    person has changed, and whatever else lies there, stays.
    """
    target = followed(path)
    rescue = partial(_rescue, target)
    try:
        # What killed runs left is swept, and what they had decided is done.
        sweep(target.parent, f'.{_name(target)}-', rescue)
        sweep(target, INSIDE, rescue)
        _refuse_foreign(target, mark, force or shared)
        if not (force or shared):
            # What would be refused when all is computed is refused now, as far as it is known.
            own = listed(target).get(mark, {})
            unlisted = [mark] if mark not in own and os.path.lexists(target / mark) else []
            refuse(target, mark, changed(target, own) + unlisted)
        place = (target, INSIDE) if target.is_dir() else (target.parent, f'.{_name(target)}-')
        scratch = Scratch(*place, rescue)
    except OSError as error:
        raise _refusal(target, error) from None
    with scratch as hidden:
        made = hidden / MADE
        made.mkdir()
        try:
            yield made
        except DataError as error:  # of a full disk, say: people know the place that they gave
            error.args = (str(error).replace(str(made), str(path)),)
            raise
        try:
            _install(target, scratch, mark, force, adds)
        except OSError as error:
            raise _refusal(target, error) from None


def write_owned(path: Path | str, text: str) -> None:
    """Write a text into a folder that may be anybody's; what is in the way gets another name."""
    with new_file(path, force=True) as file:
        write_text(file, text)


@contextmanager
def new_file(path: Path | str, *, force: bool = False) -> Iterator[Path]:
    """Yield where to write what comes to ``path``, and beside it, when the block succeeds."""
    target = followed(path)
    if target.is_dir():
        raise DataError(f"'{path}' is a folder; give a file")
    with new_directory(target.parent, mark=target.name, force=force, shared=True) as place:
        yield place / target.name


def _refusal(target: Path, error: OSError) -> DataError:
    return DataError(f"'{target}' cannot be written: {error.strerror or error}")


def _name(target: Path) -> str:
    return Path(os.path.realpath(target)).name


def _rescue(target: Path, scratch: Path) -> None:
    """End a change that a killed run had decided."""
    if target.is_dir():
        with _alone(target):
            carry_out(target, scratch)


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Change a folder while no other process does."""
    lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with suppress(OSError):  # a file system without locks
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield
    finally:
        os.close(lock)


def _install(target: Path, scratch: Scratch, mark: str, force: bool, adds: bool) -> None:
    if not scratch.is_whole:
        raise DataError(f"'{target}' was deleted while it was being written; run it again")
    folder = scratch.path / MADE
    made = files_of(folder)
    if not os.path.lexists(target):
        write_list(folder, {mark: made})
        with suppress(OSError):  # it has appeared meanwhile
            folder.rename(target)
            return
    if not target.is_dir():
        _refuse_foreign(target, mark, force)
    with _alone(target):
        change = change_of(target, made, mark, adds=adds)
        if not force:
            refuse(target, mark, list(in_the_way(target, change)))
        decide(scratch.path, change)
        try:
            carry_out(target, scratch.path)
        except BaseException:
            scratch.leave()  # the next one ends what is begun
            raise


def _refuse_foreign(target: Path, mark: str, any_folder: bool) -> None:
    """Refuse a file, and a folder in which other things lie, but not this result."""
    if os.path.lexists(target) and not target.is_dir():
        raise DataError(f"'{target}' is a file; give a folder")
    if any_folder or not target.is_dir() or (target / mark).is_file():
        return
    results = listed(target)
    ours = {Path(name).parts[0] for files in results.values() for name in files} | {LIST}
    names = {entry.name for entry in target.iterdir() if not entry.name.startswith(INSIDE)}
    if mark not in results and names - ours:
        raise DataError(
            f"'{target}' holds something else already; choose another place, or write beside it "
            'with --force'
        )
