# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Output folders: new files appear when all of them are made, and nothing of a person's is lost.

A folder that was not there appears whole, in one step. In a folder that is there, ours are replaced one
by one, each whole, and the rest stays; see `owned_files`.
"""

from __future__ import annotations

import fcntl
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.scratch import Scratch, sweep
from weld_twin_msgs_py.files.whole_files import followed, write_text

from . import owned_files
from .owned_files import LIST, MADE

INSIDE = '.weld_twin-'
"""Prefix of scratch directories in a folder that is there already."""


def on_stderr(text: str) -> None:
    """Tell a line on stderr."""
    print(f'weld-twin: {text}', file=sys.stderr)


@contextmanager
def new_directory(
    path: Path | str,  # a folder, new or there already. A link is followed
    *,
    mark: str,  # name of a file that the block makes, and by which the result is known
    force: bool = False,  # what is in the way gets another name; left out, it is refused
    adds: bool = False,  # files of the same result that are not made again stay, too
    # The folder may be anybody's; left out, one that holds other things alone is refused.
    shared: bool = False,
    tell: Callable[[str], None] = on_stderr,  # told which files got another name
) -> Iterator[Path]:
    """
    Yield a hidden directory whose files come to ``path`` when the block succeeds.

    Files of the same result that were there are replaced, those not made again removed. Whatever a
    person has changed, and whatever else lies there, stays.

    Raises DataError: something is in the way, or the place cannot be written.
    """
    target = followed(path)
    try:
        _finish(target, tell)
        _refuse_foreign(target, mark, force or shared)
        if not (force or shared):
            _refuse_before(target, mark)
        scratch = _scratch(target, tell)
    except OSError as error:
        raise _refusal(target, error) from None
    with scratch as place:
        made = place / MADE
        made.mkdir()
        yield made
        try:
            _install(target, scratch, mark, force, adds, tell)
        except OSError as error:
            raise _refusal(target, error) from None


def write_owned(path: Path | str, text: str) -> None:
    """
    Write a text file into a folder that may be anybody's; what is in the way gets another name.

    For what took long to compute: it is never refused.
    """
    with new_file(path, force=True) as file:
        write_text(file, text)


@contextmanager
def new_file(path: Path | str, *, force: bool = False) -> Iterator[Path]:
    """
    Yield where to write what comes to ``path`` when the block succeeds, and more files beside it.

    ``path``: a file, in a folder that may be anybody's. A link is followed. ``force``: as
    `new_directory` takes it.
    Raises DataError: what is there is not ours, or the place cannot be written.
    """
    target = followed(path)
    if target.is_dir():
        raise DataError(f"'{path}' is a folder; give a file")
    with new_directory(target.parent, mark=target.name, force=force, shared=True) as place:
        yield place / target.name


def _refusal(target: Path, error: OSError) -> DataError:
    return DataError(f"'{target}' cannot be written: {error.strerror or error}")


def _scratch(target: Path, tell: Callable[[str], None]) -> Scratch:
    rescue = _rescue(target, tell)
    if target.is_dir():
        return Scratch(target, INSIDE, rescue)
    return Scratch(target.parent, f'.{_name(target)}-', rescue)


def _name(target: Path) -> str:
    return Path(os.path.realpath(target)).name


def _finish(target: Path, tell: Callable[[str], None]) -> None:
    """Sweep what killed runs left, and end what they had decided."""
    rescue = _rescue(target, tell)
    sweep(target.parent, f'.{_name(target)}-', rescue)
    sweep(target, INSIDE, rescue)


def _rescue(target: Path, tell: Callable[[str], None]) -> Callable[[Path], None]:
    """Return what ends a change that a killed run had decided, given its scratch directory."""

    def rescue(scratch: Path) -> None:
        if target.is_dir():
            with _alone(target):
                owned_files.carry_out(target, scratch, _kept_notice(tell))

    return rescue


def _kept_notice(tell: Callable[[str], None]) -> Callable[[str, str], None]:
    return lambda name, new: tell(f"'{name}' was not overwritten and is kept as '{new}'")


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Change a folder while no other process does."""
    held = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with suppress(OSError):  # a file system without locks
            fcntl.flock(held, fcntl.LOCK_EX)
        yield
    finally:
        os.close(held)


def _install(
    target: Path, scratch: Scratch, mark: str, force: bool, adds: bool, tell: Callable[[str], None]
) -> None:
    if not scratch.is_whole:
        raise DataError(f"'{target}' was deleted while it was being written; run it again")
    folder = scratch.path / MADE
    made = owned_files.files_of(folder)
    if not os.path.lexists(target):
        owned_files.write_list(folder, {mark: made})
        with suppress(OSError):  # it has appeared meanwhile
            folder.rename(target)
            return
    if not target.is_dir():
        _refuse_foreign(target, mark, force)
    with _alone(target):
        change = owned_files.change_of(target, made, mark, adds=adds)
        if not force:
            owned_files.refuse(target, mark, list(owned_files.in_the_way(target, change)))
        owned_files.decide(scratch.path, change)
        try:
            owned_files.carry_out(target, scratch.path, _kept_notice(tell))
        except BaseException:
            scratch.leave()  # the next one ends what is begun
            raise


def _refuse_before(target: Path, mark: str) -> None:
    """Refuse what would be refused when all is computed, as far as it is known."""
    own = owned_files.listed(target).get(mark, {})
    unlisted = [mark] if mark not in own and os.path.lexists(target / mark) else []
    owned_files.refuse(target, mark, owned_files.changed(target, own) + unlisted)


def _refuse_foreign(target: Path, mark: str, any_folder: bool) -> None:
    """Refuse a file, and a folder in which other things lie, but not this result."""
    if os.path.lexists(target) and not target.is_dir():
        raise DataError(f"'{target}' is a file; give a folder")
    if any_folder or not target.is_dir() or (target / mark).is_file():
        return
    results = owned_files.listed(target)
    ours = {Path(name).parts[0] for files in results.values() for name in files} | {LIST}
    names = {entry.name for entry in target.iterdir() if not entry.name.startswith(INSIDE)}
    if mark not in results and names - ours:
        raise DataError(
            f"'{target}' holds something else already; choose another place, or write beside it "
            'with --force'
        )
