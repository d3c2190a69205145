# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A table of joint angles and what was touched, English or German, to a recording of stations."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.contacts import Artefact, Contact, Contacts
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Recording

from ..files.csv_text import csv_text
from ..files.whole_files import write_text
from .build import Table, own_epoch
from .cells import Cells, read_cells
from .header import CONTACTS, joint_columns, unit_of
from .joint_readings import JointColumns, counted
from .unit_guess import METRES, factor
from .words import TableOptions, shortened

WORDS = {
    'contact': CONTACTS,
    'kind': {'kind', 'type', 'art', 'typ'},
    'value': {'value', 'length', 'distance', 'wert', 'laenge', 'länge', 'abstand'},
    'sigma': {'sigma', 'std', 'uncertainty', 'unsicherheit', 'streuung'},
}
"""Names of the columns besides the joints."""
KINDS = {
    'punkt': 'point',
    'kugel': 'sphere',
    'ebene': 'plane',
    'flaeche': 'plane',
    'fläche': 'plane',
    'linie': 'line',
    'gerade': 'line',
    'kante': 'line',
    'laenge': 'length',
    'länge': 'length',
}
"""German words for the kinds of contact."""
ARM = 5.0
"""Length [m] beyond which a value is taken for millimetres: no bar of a cell is longer."""


def write_touches(path: Path, motion: Mapping[str, Any]) -> None:
    """
    Write postures and what each touches, as `read_contacts` reads them.

    motion: 'joint_names', 'q' [rad, m] and 'contact', one label per posture.
    """
    rows = [
        (*(f'{value:.7f}' for value in q), label)
        for q, label in zip(motion['q'], motion['contact'], strict=True)
    ]
    header = (*motion['joint_names'], 'contact')
    write_text(path, csv_text(header, rows), overwrite=True)


def read_contacts(
    path: Path | str,
    robot: Robot,
    artefact: Artefact | None = None,
    options: TableOptions | None = None,
) -> Table:
    """
    Read a table of joint angles and contacts.

    Parameters
    ----------
    path : Path or str
        A text file with a header line: joint columns, ``contact`` unless the artefact is one thing,
        and where they apply ``kind``, ``value`` and ``sigma``; or ``Kontakt``, ``Art``, ``Wert``,
        ``Unsicherheit``.
    robot : Robot
        Its joint names pick the columns.
    artefact : Artefact, optional
        What is touched; labels that it does not have are refused. Left out, the table's kinds say.
    options : TableOptions, optional
        What the user knows.

    Raises
    ------
    DataError
        The table cannot be read; the message names line or column.

    """
    options = options or TableOptions()
    cells = read_cells(path, options.delimiter, options.decimal)
    said = list(cells.said)
    alone = None if artefact is None or len(artefact.contacts) > 1 else artefact.contacts[0].label
    columns = _columns(cells, alone)
    joints = joint_columns(cells.header, robot, options)
    said.append('joint columns are ' + ', '.join(joints))
    kept = cells.taken(k for k in range(len(cells.rows)) if k + 1 not in options.skip_rows)
    cells = _once(kept, [*joints, *columns.values()], said)
    q = JointColumns(robot, joints, options, said).stations(cells)
    labels = _labels(cells, columns, alone)
    value = _lengths(cells, columns.get('value'), options, said)
    sigma = _lengths(cells, columns.get('sigma'), options, said)
    kinds = _kinds(cells, columns.get('kind'), labels, value)
    known = _artefact(path, artefact, kinds)
    contacts = Contacts(
        known,
        labels,
        None if value is None else np.nan_to_num(value),
        None if sigma is None or not np.isfinite(sigma).all() else sigma,
    )
    said += _touched(contacts, known)
    recording = Recording(
        cells.path.stem,
        JointMotion(np.arange(float(len(q))), q, static=True),
        epoch_ns=own_epoch(cells.path),
        notes=tuple(said),
        contacts=contacts,
        counted=counted(robot, options),
    )
    return Table(recording, tuple(said))


def _labels(cells: Cells, columns: Mapping[str, str], alone: str | None) -> tuple[str, ...]:
    if 'contact' not in columns:
        return (alone or '',) * len(cells.rows)
    labels = tuple(cells.column(columns['contact']))
    if '' in labels:
        line = cells.lines[labels.index('')]
        raise DataError(f"table '{cells.path}' line {line} names no contact")
    return labels


def _once(cells: Cells, names: list[str], said: list[str]) -> Cells:
    """
    Return the table with one row of every posture.

    Logs with a row for everything noted repeat joints to the last digit; touches never do.
    """
    _, first = cells.alike(names)
    more = len(cells.rows) - len(first)
    if not more:
        return cells
    said.append(f'{more} rows repeat a posture to the last digit; each counts once')
    return cells.taken(first)


def _touched(contacts: Contacts, known: Artefact) -> list[str]:
    return [
        f'{contacts.of(label).size} postures touch {label!r}, a {known.named(label).kind}'
        for label in dict.fromkeys(contacts.labels)
    ]


def _columns(cells: Cells, alone: str | None) -> dict[str, str]:
    """Return the columns by use; what all touches have in common is ``alone``."""
    out = cells.by_words(WORDS)
    if 'contact' not in out and alone is None:
        raise DataError(
            f"table '{cells.path}' has no column 'contact' that says what each posture touched; "
            f'its columns are {shortened(cells.header)}. Where there is one thing to touch, an '
            'artefact file with it alone will do'
        )
    return out


def _lengths(
    cells: Cells, name: str | None, options: TableOptions, said: list[str]
) -> Array | None:
    """Return a column of lengths [m]; millimetres where its name or its size says so."""
    if name is None:
        return None
    values = cells.numbers(name)
    if np.isnan(values).all():
        return None
    unit = options.length_unit or unit_of(name)
    if unit is None:
        unit = 'mm' if np.nanmax(np.abs(values)) > ARM else 'm'
        said.append(f'{name} is in {unit}; --length-unit decides')
    return values * factor(METRES, unit, name, 'a length')


def _kinds(
    cells: Cells, name: str | None, labels: tuple[str, ...], value: Array | None
) -> dict[str, str]:
    texts = ['' for _ in labels] if name is None else cells.column(name)
    out: dict[str, str] = {}
    for k, (label, text) in enumerate(zip(labels, texts, strict=True)):
        kind = KINDS.get(text.lower(), text.lower())
        if not kind:
            kind = 'length' if value is not None and np.isfinite(value[k]) else 'point'
        if out.setdefault(label, kind) != kind:
            raise DataError(
                f"table '{cells.path}' line {cells.lines[k]}: contact {label!r} is a {kind} here "
                f'and a {out[label]} above'
            )
    return out


def _artefact(path: Path | str, given: Artefact | None, kinds: dict[str, str]) -> Artefact:
    if given is None:
        return Artefact(tuple(Contact(label, kind) for label, kind in kinds.items()))
    for label in kinds:
        try:
            given.named(label)
        except DataError as error:
            raise DataError(f"table '{path}': {error}") from None
    return given
