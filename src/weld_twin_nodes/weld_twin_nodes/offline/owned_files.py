# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which files of a folder are ours, and how ours are replaced while all others stay.

A list in the folder (`LIST`) holds the names and digests of what was written there. A file is ours as
long as its digest is the one in the list: once a person has changed it, it is theirs. Nothing that is
not ours is ever deleted or overwritten; at the most it gets another name.

New files are made in a scratch directory, together with a note of what is to happen with them. From
the moment the note is whole, the change is decided: who is killed while files are moved into place has
the rest of them moved by the next one who works in the folder.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from itertools import count
from pathlib import Path

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.input_files import hashed
from weld_twin_msgs_py.files.whole_files import write_text

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

Digests = dict[str, str]
"""SHA-256 by the name of a file, relative to the folder, with slashes."""


@dataclass(frozen=True)
class Change:
    """
    What is to happen in a folder; plain values, for it is written down.

    Attributes
    ----------
    mark : str
        Name of the result that the files belong to.
    place : mapping of str to str or None
        New files, in order, and the digest of what each may replace; None for nothing.
    drop : mapping of str to str
        Files of ours that were not made again, and their digests.
    listed : mapping of str to str
        Files of this result afterwards, and their digests.

    """

    mark: str
    place: Mapping[str, str | None]
    drop: Mapping[str, str]
    listed: Mapping[str, str]


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

    A list that is damaged, or of another version, lists nothing: what it may have meant is not ours.
    """
    try:
        content = json.loads((folder / LIST).read_text(encoding='utf-8'))
        results = content['results'] if content['schema'] == SCHEMA else {}
        return {str(k): {str(n): str(d) for n, d in v.items()} for k, v in results.items()}
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return {}


def write_list(folder: Path, results: Mapping[str, Mapping[str, str]]) -> None:
    """Write a list into a folder."""
    content = {'schema': SCHEMA, 'about': _ABOUT, 'results': results}
    write_text(folder / LIST, json.dumps(content, indent=1) + '\n', overwrite=True)


def change_of(folder: Path, made: Mapping[str, str], mark: str, *, adds: bool) -> Change:
    """
    Return what is to happen in a folder so that it has the files made.

    Parameters
    ----------
    folder : Path
    made : mapping of str to str
        Digests of the new files by name.
    mark : str
    adds : bool
        Whether files of this result that were not made again stay.

    """
    own = listed(folder).get(mark, {})
    # The mark comes last: who finds the new one finds all the others.
    names = sorted(made, key=lambda name: (name == mark, name))
    place = {name: own.get(name) for name in names if digest(folder / name) != made[name]}
    left = {name: own[name] for name in own if name not in made}
    return Change(mark, place, {} if adds else left, {**(left if adds else {}), **made})


def in_the_way(folder: Path, change: Change) -> Iterator[str]:
    """Yield the files of a folder that a change would replace or drop, and that are not ours."""
    for name, ours in change.place.items():
        blocking = _blocking(folder, name)
        if blocking is not None:
            yield blocking
        elif _there(folder / name) and digest(folder / name) != ours:
            yield name
    yield from changed(folder, change.drop)


def changed(folder: Path, own: Mapping[str, str]) -> list[str]:
    """Return the files that are there and are not what was written."""
    return [n for n, ours in own.items() if _there(folder / n) and digest(folder / n) != ours]


def decide(scratch: Path, change: Change) -> None:
    """Write the note: from now on the change happens, whoever carries it out."""
    write_text(scratch / NOTE, json.dumps(asdict(change)) + '\n')


def carry_out(folder: Path, scratch: Path, kept: Callable[[str, str], object]) -> None:
    """
    Do what the note of a scratch directory says, as far as it is not done; nothing without a note.

    Parameters
    ----------
    folder, scratch : Path
    kept : callable
        Told every file that was not ours: its name, and the name that it has now.

    """
    try:
        change = Change(**json.loads((scratch / NOTE).read_text(encoding='utf-8')))
    except (OSError, ValueError, TypeError):
        return
    for name, ours in change.place.items():
        new = scratch / MADE / name
        if not new.exists():
            continue  # moved before the one who began was killed
        blocking = _blocking(folder, name)
        if blocking is not None:
            kept(blocking, _keep(folder, blocking))
        elif _there(folder / name) and digest(folder / name) not in (ours, digest(new)):
            kept(name, _keep(folder, name))
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        os.replace(new, folder / name)
    for name, ours in change.drop.items():
        if digest(folder / name) == ours:
            _drop(folder, name)
        elif _there(folder / name):
            kept(name, _keep(folder, name))
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


def _blocking(folder: Path, name: str) -> str | None:
    """Return what stands where a folder of ours, or a file, should be: a file, or a folder."""
    parts = Path(name).parts
    for k in range(1, len(parts)):
        above = Path(*parts[:k])
        if _there(folder / above) and not (folder / above).is_dir():
            return above.as_posix()
    return name if (folder / name).is_dir() else None


def _keep(folder: Path, name: str) -> str:
    """Give a file that is not ours another name, and return it."""
    new = _kept_name(folder, name)
    os.rename(folder / name, folder / new)
    return new


def _kept_name(folder: Path, name: str) -> str:
    path = Path(name)
    names = (path.with_name(f'{path.stem}.kept-{k}{path.suffix}') for k in count(1))
    return next(new for new in names if not _there(folder / new)).as_posix()


def _drop(folder: Path, name: str) -> None:
    """Remove a file of ours, and folders that are empty then."""
    (folder / name).unlink()
    with suppress(OSError):
        for above in Path(name).parents:
            if above != Path('.'):
                (folder / above).rmdir()


def refuse(folder: Path, mark: str, names: list[str]) -> None:
    """
    Refuse a change that files are in the way of.

    Raises
    ------
    DataError
        There are some.

    """
    if names:
        raise DataError(sentence(folder, mark, names))
