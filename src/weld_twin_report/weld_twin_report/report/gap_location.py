# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the gap lies: the joint x regressor map, joints, regimes, directions, stretches."""

from collections.abc import Callable, Sequence

import numpy as np

from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_core.effects import REGISTRY
from weld_twin_nodes.wording.mending import as_it_is
from weld_twin_nodes.wording.quantities import millimetres, percent, seconds
from weld_twin_nodes.wording.words import DEPENDENCES, HALF, REGIMES, likely, listed, place_name

from .answer import Answer
from .cause_answer import CauseAnswer
from .html import Html, bars, joined, section, tag
from .page_data import SEEN, at_rest, components, seen_at, sides_words, worst
from .sections import Content, on_page

_FRAMED = (
    ' Framed: the one that holds the instant looked at, at first the largest single deviation.'
)
_STRIP = (
    f'RMS gap of each stretch, and its time. ▼ the worst stretch by RMS.{_FRAMED} That one can be '
    'in another stretch than the worst.',
    'RMS gap of stations, and their numbers. ▼ the worst by RMS.',
)
"""What stands under the stretches of a motion, and of stations at rest."""
_WHERE = ('the seam', 'the stations')
_EVEN = 1.25
"""Ratio of the worst stretch to the best below which neither stands out: that much a dozen short
stretches of one motion differ by for no other reason than posture and noise."""
_DIRECTION = {'reversal': 'direction of motion'}
"""Words of the causes above for a dependence that the map calls something else."""
_VISIBLE = 0.005
"""Share below which a cell of the map stays empty: it would read 0."""


@on_page('answer', 50)
def where_section(page: Content) -> Html:
    """Return where the causes lie, the same shares as theirs, and the map of each by itself."""
    answer, diagnosis = page.answer, page.diagnosis
    direction = dict(diagnosis.where.direction)
    names = {'along_m': 'along the seam', 'across_m': 'across it', 'normal_m': 'along the tool'}
    if at_rest(diagnosis):
        direction = {key: value for key, value in direction.items() if key != 'along_m'}
        names['across_m'] = 'across the tool'
    largest = max([*direction.values(), 1e-12])
    rows = [
        (names.get(key, key), value / largest, millimetres(value))
        for key, value in direction.items()
    ]
    parts = [_part('By direction', joined([bars(rows), _worst(diagnosis)]))]
    if diagnosis.status != 'none':
        parts[:0] = [
            _part('By place', bars(_places(answer))),
            _part('By what it depends on', bars(_dependences(answer))),
        ]
    return section(
        'Where it lies',
        tag('div.columns', *parts),
        tag('p.note', _whole(answer)),
        _stretches(diagnosis),
        tag('div.detail', _by_itself(diagnosis)),
        id_='where',
    )


def _places(answer: Answer) -> list[tuple[str, float, str]]:
    """Return the shares of the causes by place, then what is left and the noise."""
    if not answer.causes:
        where = answer.diagnosis.where
        return [(name, share, percent(share)) for name, share in where.joints]
    return _summed(answer, _at, place_name)


def _at(item: CauseAnswer) -> Sequence[tuple[str, float]]:
    """Return the places of a cause; where several causes fit alike, theirs, and none is surer."""
    known = [site for site in item.alike if site.joint or site.effect in REGISTRY]
    own = [site.joint or REGISTRY[site.effect].traits.place for site in known]
    places = list(dict.fromkeys(place for place in own if place != 'joint'))
    return [(place, HALF / len(places)) for place in places] or item.cause.place


def _dependences(answer: Answer) -> list[tuple[str, float, str]]:
    diagnosis = answer.diagnosis
    if not answer.causes:
        regimes = sorted(diagnosis.where.regimes.items(), key=lambda item: -item[1])
        return [(REGIMES.get(name, name), share, percent(share)) for name, share in regimes]
    words = {**DEPENDENCES, 'constant': 'constant'}
    return _summed(answer, _on, lambda on: words.get(on, on))


def _on(item: CauseAnswer) -> Sequence[tuple[str, float]]:
    """Return what a cause depends on; where several causes fit alike, what each of them does."""
    effects = [REGISTRY.get(site.effect) for site in item.alike]
    on = list(dict.fromkeys(effect.traits.depends_on for effect in effects if effect is not None))
    return [(each, HALF / len(on)) for each in on] if len(on) > 1 else item.cause.dependence


def _summed(
    answer: Answer,
    beliefs: Callable[[CauseAnswer], Sequence[tuple[str, float]]],
    word: Callable[[str], str],
) -> list[tuple[str, float, str]]:
    """Return shares by what is most probable of each cause; with the rest they make a whole."""
    sums: dict[str, float] = {}
    for item in answer.causes:
        name = likely(beliefs(item), word) or 'not found'
        sums[name] = sums.get(name, 0.0) + item.cause.share
    rows = sorted(sums.items(), key=lambda item: -item[1])
    rows = [row for row in rows if row[1] >= SEEN] + list(answer.remainder)
    return [(name, share, answer.percent(share)) for name, share in rows]


def _whole(answer: Answer) -> str:
    """Return why what is found explains less than the whole."""
    diagnosis = answer.diagnosis
    if diagnosis.status == 'none':
        return 'All of it is at the level of the noise, so it lies nowhere in particular.'
    if not diagnosis.causes:
        return 'Nothing was named, so these are what each joint could explain by itself.'
    shares = [cause.share for cause in diagnosis.causes if not cause.rest]
    remaining = [cause.share for cause in diagnosis.causes if cause.rest]
    explained, remaining = sum(shares or remaining), remaining if shares else []
    rows = [*(('without a name', share) for share in remaining), *answer.remainder]
    rest = [f'{answer.percent(share)} is {name}' for name, share in rows]
    subject = 'The causes explain' if diagnosis.effects else 'The places found hold'
    return (
        f'{subject} {answer.percent(explained)} of the squared gap; '
        f'{listed(rest)}. So a place can be certain and still hold less than the whole.'
    )


def _by_itself(diagnosis: Diagnosis) -> Html | None:
    picture = _map(diagnosis)
    if picture is None:
        return None
    return joined(
        [
            tag('h3', 'Each joint by itself'),
            tag(
                'p.note',
                'What share of the squared gap each joint could explain alone, as a function of '
                'what, on stretches not used for fitting. Several can explain the same part, so '
                'cells need not add up, and the darkest need not be the cause: above, all are '
                'weighed together.',
            ),
            picture,
        ]
    )


def _part(title: str, content: Html) -> Html:
    return tag('div', tag('h3', title), content)


def _map(diagnosis: Diagnosis) -> Html | None:
    """Return the map without columns in which nothing stands, and which those are."""
    where = diagnosis.where
    if not where.map_shares:
        return None
    shares = np.array(where.map_shares)
    full = [k for k in range(shares.shape[1]) if (shares[:, k] >= _VISIBLE).any()]
    rows = []
    robot = diagnosis.model.robot
    for i, name in enumerate(robot.joint_names):
        cells = [_cell(float(shares[i, k])) for k in full]
        unit = 'mm' if robot.prismatic[i] else '°'
        cells.append(tag('td.now', '', data_joint=i, data_unit=unit))
        rows.append(tag('tr', tag('th', name, scope='row'), *cells))
    whole = tag(
        'div.scroll',
        tag('table.map', _heads([where.map_regressors[k] for k in full]), tag('tbody', *rows)),
        tabindex='0',
        role='region',
        aria_label='Share by joint and regressor'
    )  # fmt: skip
    empty = [
        _DIRECTION.get(name, name.replace(', ', ' of '))
        for k, name in enumerate(where.map_regressors)
        if k not in full
    ]
    blank = 'A cell is blank below 0.5 %.' if full else ''
    none = f'No joint alone could explain 0.5 % by {listed(empty, "or")}.' if empty else ''
    note = ' '.join(filter(None, [blank, none]))
    return joined([whole, tag('p.note', note) if note else None])


def _heads(names: Sequence[str]) -> Html:
    heads = [tag('th', tag('span', _DIRECTION.get(name, name)), scope='col') for name in names]
    heads.append(tag('th.now', tag('span', 'position at the instant looked at'), scope='col'))
    first = tag('th', 'Joint', tag('span.narrow', ' [%]'), scope='col')
    return tag('thead', tag('tr', first, *heads))


def _cell(share: float) -> Html:
    strength = min(max(share, 0.0), 1.0)
    number, gap, unit = percent(share).rpartition('\N{NO-BREAK SPACE}')
    text = (number, tag('span.unit', gap, unit)) if share >= _VISIBLE else ()
    return tag('td', *text, style=f'--share:{strength:.3f}')


def _worst(diagnosis: Diagnosis) -> Html | None:
    """Return to which side the tool is off where it is off most."""
    result = worst(diagnosis)
    if result is None or diagnosis.contacts is not None:
        return None
    k, sample, size = result
    parts = components(diagnosis, k, as_it_is(diagnosis, k))
    if parts is None:
        return None
    words = f'RMS. The largest, {seen_at(diagnosis, k, sample, size)}'
    if sides := sides_words(parts[sample]):
        words += f': {sides}'
    keys = 'Left is as seen from the tool, looking along it; out is away from the flange.'
    return tag('p.note', f'{words}. {keys}')


def _stretches(diagnosis: Diagnosis) -> Html | None:
    path = diagnosis.where.path
    # Contacts have a table of their own, and no time.
    if len(path) < 2 or diagnosis.contacts is not None:
        return None
    sizes = [rms for *_, rms in path]
    largest = max(*sizes, 1e-12)
    even = largest < _EVEN * max(min(sizes), 1e-12)
    strips: dict[int, list[Html]] = {}
    run, last = 0, path[0][0]
    for piece in path:
        run, last = _run_of(diagnosis, piece, run, last), piece[0]
        strips.setdefault(run, []).append(_stretch(diagnosis, run, piece, largest, even))
    where = _WHERE[at_rest(diagnosis)]
    spread = f'{millimetres(min(sizes))} to {millimetres(largest)} RMS'
    note = (
        f'Evenly along {where}: {spread}, so no stretch stands out.{_FRAMED * (not at_rest(diagnosis))}'
        if even
        else _STRIP[at_rest(diagnosis)]
    )
    return _part(
        'Along the recording',
        tag('div', *(tag('ol.strip', *cells) for cells in strips.values()), tag('p.note', note)),
    )


def _run_of(
    diagnosis: Diagnosis, piece: tuple[float, float, float, float], run: int, last: float
) -> int:
    """Return the recording of a stretch, which follows one of a recording that began before."""
    start, end = piece[:2]
    stamps = diagnosis.traces.t
    for k in range(run + (start < last), len(stamps)):
        if stamps[k].size and stamps[k][0] <= start and end <= stamps[k][-1]:
            return k
    return run


def _stretch(
    diagnosis: Diagnosis,
    run: int,
    piece: tuple[float, float, float, float],
    largest: float,
    even: bool,
) -> Html:
    start, end, share, rms = piece
    most = rms >= largest and not even
    stamps = diagnosis.traces.t[run] if run < len(diagnosis.traces.t) else np.zeros(0)
    zero = float(stamps[0]) if stamps.size else 0.0
    when = f'{start - zero:.1f} to {seconds(end - zero)}'
    if at_rest(diagnosis):
        first, final = np.searchsorted(stamps, [start, end]) + 1
        when = f'{first} to {final}'
    return tag(
        'li',
        tag('span.figure', '▼ ' if most else '', millimetres(rms)),
        tag('span.when', when),
        style=f'--share:{rms / largest:.3f};flex-grow:{max(end - start, 1e-3):.3f}',
        title=f'{when}: {millimetres(rms)}, {percent(share)} of the squared gap',
        class_='most' if most else None,
        data_run=run,
        data_from=f'{start - zero:.3f}',
        data_to=f'{end - zero:.3f}',
    )
