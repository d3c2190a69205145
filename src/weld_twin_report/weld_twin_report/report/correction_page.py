# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of a corrected program: one HTML file that needs nothing else."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from weld_twin_msgs_py.files.input_files import InputFile

from .footing import inputs_section
from .html import (
    Figure,
    Html,
    columns,
    document,
    figures,
    main,
    said_section,
    section,
    sentences,
    table,
    tag,
)

ROWS = 500
"""Moves in the table of the page at most; correction.json has them all."""


def correction_page(entry: Mapping[str, Any], inputs: Sequence[InputFile] = ()) -> str:
    title = f'{entry["program"]} · {entry["robot"]}'
    tolerance = tolerance_sentences(entry)
    body = main(
        ('Corrected program ', entry['language']),
        title,
        headline(entry),
        _figures(entry),
        section('Tolerance', sentences(tolerance), id_='tolerance') if tolerance else None,
        _first_run(entry),
        _left(entry),
        _outside(entry),
        _moves(entry),
        said_section('What was assumed', entry['notes'], 'notes'),
        inputs_section(inputs),
    )
    return document(f'Corrected program · {title}', body)


def headline(entry: Mapping[str, Any]) -> str:
    """Return in one sentence how many moves were corrected and what is expected of it."""
    moves = entry['moves']
    done = sum(move['corrected'] for move in moves)
    before, after = (entry['expected'][key] for key in ('before', 'after'))
    if before is None or after is None:
        return f'{done} of {len(moves)} moves were corrected.'
    return (
        f'{done} of {len(moves)} moves were corrected: the real tool is expected '
        f'{_rms(before)} from where the program means it, and {_rms(after)} after.'
    )


_DECISIONS = {
    'kept': 'it counts as kept',
    'not kept': 'it counts as not kept',
    'open': 'it counts neither as kept nor as not kept',
}


def tolerance_sentences(entry: Mapping[str, Any]) -> list[str]:
    """Return in sentences whether a tolerance is kept; nothing where none was asked for."""
    if 'tolerance' not in entry:
        return []
    tolerance = entry['tolerance']
    size, before, after = (
        f'{tolerance["tolerance_m"] * 1e3:.3g} mm',
        tolerance['before'],
        tolerance['after'],
    )
    out = [
        f'All along, the tool keeps within {size} of where the program means it with '
        f'{before["probability"]:.0%} probability before and {after["probability"]:.0%} '
        f'after: {_DECISIONS[after["decision"]]} (from 95 % on, with guard bands as ISO 14253-1). '
        f'After, it is 95 % sure to keep within {after["sure_within_m"] * 1e3:.3f} mm.'
    ]
    if after['decision'] != 'kept':
        out.append(_more_measured(entry, tolerance['postures_more']))
    same = after['same_setup']
    if same['sure_within_m'] < after['sure_within_m']:
        out.append(
            'Of points in the frames that were fitted to the recording, as those that were taught with '
            f'this arm: {before["same_setup"]["probability"]:.0%} before and '
            f'{same["probability"]:.0%} after: {_DECISIONS[same["decision"]]}, and it is 95 % sure '
            f'to keep within {same["sure_within_m"] * 1e3:.3f} mm.'
        )
        if same['decision'] != 'kept':
            out.append(_more_measured(entry, same['postures_more']))
    return out


def _more_measured(entry: Mapping[str, Any], postures: int | None) -> str:
    """Return in a sentence how many postures measured more make a tolerance sure."""
    if postures is None:
        return 'No number of postures measured along it makes that sure with this model.'
    return (
        f'{postures} postures measured more along it make it 95 % sure: weld-twin investigate '
        f'--tolerance {entry["tolerance"]["tolerance_m"] * 1e3:g} --model DIAGNOSIS --region '
        f'{entry["program"]} --postures {postures} says which.'
    )


def _rms(accuracy: Mapping[str, Any]) -> str:
    text, ends = f'{accuracy["rms_m"] * 1e3:.3f} mm RMS', _ends(accuracy)
    return f'{text} ({ends})' if ends else text


def _ends(accuracy: Mapping[str, Any]) -> str:
    """Return in which interval nine of ten lie [mm], and in which for points in fitted frames."""
    ends, same = accuracy['rms_ci90_m'], accuracy['rms_ci90_same_setup_m']
    if ends is None:
        return ''
    whole, fitted = (' to '.join(f'{value * 1e3:.3f}' for value in each) for each in (ends, same))
    return whole if fitted == whole else f'{fitted} in the frames fitted, else {whole}'


def _figures(entry: Mapping[str, Any]) -> Html:
    moved = [move for move in entry['moves'] if move['corrected']]
    cells: list[Figure] = []
    for key, name in (('before', 'Before'), ('after', 'After')):
        value = entry['expected'][key]
        if value is not None:
            ends, worst = _ends(value), f'at worst {value["worst_m"] * 1e3:.3f} mm'
            span = f'in nine of ten cases {ends} mm' if ends else worst
            cells.append((name, f'{value["rms_m"] * 1e3:.3f} mm', span))
    most = max((move['moved_m'] for move in moved), default=0.0)
    turn = max((move['turned_rad'] for move in moved), default=0.0)
    cells.append(
        ('Moved', f'{most * 1e3:.3f} mm', f'at most, and turned by {_degrees(turn)} at most')
    )
    return figures(cells)


def _first_run(entry: Mapping[str, Any]) -> Html:
    limit = entry['max_correction']
    steps = [
        'Keep the program as it was: the corrected one has the same name in another folder.',
        'Compare both on the controller. Only the coordinates of points differ.',
        'Run it first without welding, in manual mode at reduced speed, and watch the torch.',
        'Measure some points again. Where it is not better, the arm has changed: diagnose anew.',
    ]
    lead = (
        f'No point was moved by more than {limit["length_m"] * 1e3:g} mm and '
        f'{_degrees(limit["turn_rad"])}. A seam is corrected whole or not at all.'
    )
    return section(
        'Before it runs', tag('ol', *(tag('li', step) for step in steps)), id_='run', lead=lead
    )


def _left(entry: Mapping[str, Any]) -> Html | None:
    if not entry['left']:
        return None
    rows = []
    for remaining in entry['left']:
        places = [m['where'] for m in entry['moves'] if m['seam'] == remaining['seam']]
        span = places[0] if len(places) == 1 else f'{places[0]} to {places[-1]}'
        rows.append((span, remaining['why']))
    return section(
        'Left as it was',
        table(('moves', 'why'), rows),
        id_='left',
        lead='These moves are not corrected. Their points are as in the program given.',
    )


def _outside(entry: Mapping[str, Any]) -> Html | None:
    moves = [move for move in entry['moves'] if move['outside']]
    if not moves:
        return None
    rows = [(move['where'], move['outside']) for move in moves[:ROWS]]
    return section(
        'Outside what the model knows',
        table(('move', 'why'), rows),
        id_='outside',
        lead='Nothing was recorded there, so the correction is less sure. Record such postures.',
    )


def _moves(entry: Mapping[str, Any]) -> Html:
    shown: dict[str, Callable[[Any], str]] = {
        'line': lambda move: move['where'],
        'move': lambda move: move['kind'],
        'point': lambda move: move['point'] or '',
        'moved, mm': lambda m: f'{m["moved_m"] * 1e3:.3f}' if m['corrected'] else 'left',
        'turned, deg': lambda m: f'{m["turned_rad"] * 57.29578:.4f}' if m['corrected'] else 'left',
        'before, mm': lambda move: _millimetres(move['before_m']),
        'after, mm': lambda move: _millimetres(move['after_m']),
        '±, mm': lambda move: _millimetres(move['sigma_m']),
    }
    more = len(entry['moves']) - ROWS
    lead = (
        'How far the place of each move was moved, and how far off the real tool is there by the '
        'model. ±: how sure the model is of that (one standard deviation).'
    )
    if more > 0:
        lead += f' {more} more are in correction.json.'
    return section('Moves', columns(entry['moves'][:ROWS], shown), id_='moves', lead=lead)


def _millimetres(value: float | None) -> str:
    return '' if value is None else f'{value * 1e3:.3f}'


def _degrees(turn: float) -> str:
    return f'{turn * 57.29578:.3g}°'
