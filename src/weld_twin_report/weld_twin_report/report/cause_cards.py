# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The causes, largest share of the gap first, each on a card: what, how much, what to do."""

from __future__ import annotations

import numpy as np

from weld_twin_core.diagnosis.advice import actions
from weld_twin_core.diagnosis.result import Cause, Diagnosis, Site
from weld_twin_core.metrics.conformity import Rule
from weld_twin_nodes.wording.mending import (
    against,
    curve_fault,
    left_without,
    look_at,
    taken_by_curve,
    warning,
)
from weld_twin_nodes.wording.quantities import counted, ends_to, millimetres, percent
from weld_twin_nodes.wording.switches import (
    MOST,
    alternatives,
    as_it_is,
    cause_name,
    switches,
    trusted,
)
from weld_twin_nodes.wording.words import same_words, unnamed

from .acceptance import mark
from .belief import sure_entry
from .cause_levels import LEVEL_HEADS, level_row, spreads
from .cause_values import effects_of, furthest_off, one_of, values
from .charts import Axis, Line, chart
from .controllers import BRANDS, UNNAMED, correction, gearing
from .curve_plot import curve_figure
from .directions import components, rms_words, sides_words
from .html import Child, Html, joined, section, table, tag
from .page_data import along, drawn, static
from .remainder import places, remainder
from .seam_view import at_rest, seen_at
from .to_do import TOGETHER
from .warned import warned

_TRIVIAL = 1e-4
"""Share of the squared gap below which a cause has no card: it moves nothing anybody sees."""
_APART = 0.03
"""Share of the squared gap by which a cause moves the tool beyond its share, to be told."""
_LATE = {'servo_lag', 'time_delay'}
"""Causes that read otherwise where the joints were commanded, not measured."""
_SOURCE = 'source of the joints'
"""Name of the check that tells so."""
_BY_CURVE = 'That is with programs corrected by the curve.'
_SHORT = ' That curve follows only part of what happens here, so it takes off less than the share.'
_VALUES = 4
"""Parameters told on a card; effects.yaml has all."""


def causes_cards(diagnosis: Diagnosis, brand: str | None, rule: Rule) -> Html | None:
    """Return the shares of the gap and a card for every cause; None without any."""
    shown = [k for k in range(len(diagnosis.causes)) if _matters(diagnosis, k)][:MOST]
    if not shown:
        return None
    rest = [c for k, c in enumerate(diagnosis.causes) if k not in shown]
    cards = [_card(diagnosis, k, rank, brand, rule) for rank, k in enumerate(shown, 1)]
    return section(
        'What causes it',
        _shares(diagnosis, shown),
        tag('div', *cards, class_='cards'),
        _smaller(rest),
        id_='cards',
        lead='How much of the gap each cause makes, counted in squares so that all shares, with what '
        f'is left and the noise, add up to 100\N{NO-BREAK SPACE}%. In brackets: where the true share '
        f'lies, 90\N{NO-BREAK SPACE}% sure.{_against(diagnosis, shown)}',
    )


def _matters(diagnosis: Diagnosis, k: int) -> bool:
    """Tell whether a cause holds a share, or at least moves the tool so that mending it shows."""
    return max(diagnosis.causes[k].share, _own_square(diagnosis, k)) >= _TRIVIAL


def _own_square(diagnosis: Diagnosis, k: int) -> float:
    """Return how far a cause moves the tool by itself, as a part of the squared gap."""
    told = diagnosis.contributions
    if told is None or diagnosis.contacts is not None:
        return 0.0
    good = [trusted(diagnosis, run) for run in range(len(told.parts))]
    own = sum(float((p[k][g] ** 2).sum()) for p, g in zip(told.parts, good, strict=True))
    every = zip(range(len(good)), good, strict=True)
    whole = sum(float((as_it_is(diagnosis, run)[g] ** 2).sum()) for run, g in every)
    return own / max(whole, 1e-300)


def _against(diagnosis: Diagnosis, shown: list[int]) -> str:
    """Return how to read a share that is far smaller than what its cause moves."""
    if all(_own_square(diagnosis, k) < diagnosis.causes[k].share + _APART for k in shown):
        return ''
    return (
        ' Causes that move the tool at the same instants share what they explain together: a small '
        'share can belong to a cause whose mending is worth it. Its card says what that brings.'
    )


def _shares(diagnosis: Diagnosis, shown: list[int]) -> Html:
    """Return one row for each cause, for what is left and for the noise: a whole of 100 %."""
    causes = diagnosis.causes
    rows: list[tuple[str, float, str, str]] = []
    decimals = places(diagnosis)
    for rank, k in enumerate(shown, 1):
        value, ends = ends_to(decimals, causes[k].share, *causes[k].share_ci90)
        label = f'{rank}. {cause_name(diagnosis, causes[k])}'
        rows.append((label, causes[k].share, f'{value} ({ends})', 'cause'))
    smaller = sum(c.share for k, c in enumerate(causes) if k not in shown)
    if smaller > 0.0:
        rows.append(('smaller causes', smaller, percent(smaller, decimals), 'cause'))
    rows += [
        (name, share, percent(share, decimals), 'rest') for name, share in remainder(diagnosis)
    ]
    items = [
        tag(
            'li',
            tag('span', label, class_='label'),
            tag('span', tag('i', style=f'width:{100.0 * share:.2f}%'), class_='track'),
            tag('span', text, class_='figure'),
            class_=kind,
        )
        for label, share, text, kind in rows
    ]
    return tag('ul', *items, class_='bars wide shares')


_EFFECT = ('Effect on the seam', 'Effect at the stations')
"""What a cause does, along a motion and at stations at rest."""


def _card(diagnosis: Diagnosis, k: int, rank: int, brand: str | None, rule: Rule) -> Html:
    cause = diagnosis.causes[k]
    name = cause_name(diagnosis, cause)
    entries = [
        ('How sure', sure_entry(diagnosis, cause)),
        ('By how much', _off_by(diagnosis, cause)),
        ('Stands on', _commanded(diagnosis, cause)),
        (_EFFECT[at_rest(diagnosis)], _effect(diagnosis, k)),
        ('If only this is mended', _mended(diagnosis, k, rule)),
        ('What to do', _action(diagnosis, k)),
        *_at_the_controller(diagnosis, k, brand),
    ]
    pairs = [part for head, text in entries if text for part in (tag('dt', head), tag('dd', text))]
    return tag(
        'article',
        tag('h3', tag('span', str(rank), class_='rank'), f'{name[:1].upper()}{name[1:]}'),
        tag(
            'p',
            tag('b', percent(cause.share, places(diagnosis))),
            ' of the gap',
            class_='share',
        ),
        _box(diagnosis, k),
        _picture(diagnosis, k),
        tag('dl', *pairs, class_='pairs'),
        class_='card',
        id_=f'cause-{rank}',
    )


def _box(diagnosis: Diagnosis, k: int) -> Html | None:
    """Return the switch that thinks this cause mended."""
    for at, switch in enumerate(switches(diagnosis)):
        if switch.members == (k,):
            box = tag('input', type='checkbox', data_switch=at, checked='')
            return tag('label', box, ' take as mended', class_='one-switch')
    return None


def _off_by(diagnosis: Diagnosis, cause: Cause) -> Html | None:
    rows = values(diagnosis, cause)
    if not rows:
        return None
    if alternatives(diagnosis, cause):
        rows = [f'should it be {one_of(diagnosis, cause)}:', *rows]
    more = [f'and {len(rows) - _VALUES} more'] if len(rows) > _VALUES else []
    return tag('span', *(tag('span', row) for row in [*rows[:_VALUES], *more]), class_='lines')


def _commanded(diagnosis: Diagnosis, cause: Cause) -> str | None:
    """Return what was noted of the joints, where a cause is a matter of command and arm."""
    late = {effect.name for effect in effects_of(diagnosis, cause)} | {
        s.effect for s, _ in cause.name
    }
    if not late & _LATE:
        return None
    noted = [c.sentence for c in diagnosis.checks if c.name == _SOURCE and c.level != 'ok']
    return ' '.join(noted) or None


def _part(diagnosis: Diagnosis, k: int) -> tuple[int, np.ndarray, np.ndarray] | None:
    """Return the recording where a cause moves the tool most, its samples and how far [m]."""
    told = diagnosis.contributions
    if told is None or diagnosis.contacts is not None or not diagnosis.causes[k].members:
        return None
    best: tuple[int, np.ndarray, np.ndarray] | None = None
    for run, parts in enumerate(told.parts):
        size = np.linalg.norm(parts[k], axis=1)
        good = np.flatnonzero(trusted(diagnosis, run))
        if good.size and (best is None or size[good].max() > best[2].max()):
            best = run, good, size[good]
    return best


def _effect(diagnosis: Diagnosis, k: int) -> Html | None:
    most = _part(diagnosis, k)
    if most is None:
        return None
    run, good, size = most
    peak = int(np.argmax(size))
    text = (
        f'moves the tool by {millimetres(float(np.sqrt((size**2).mean())))} RMS, at most '
        f'{seen_at(diagnosis, run, int(good[peak]), float(size[peak]))}'
    )
    return joined([text, *_along(diagnosis, k, run, good, int(good[peak]))])


def _along(diagnosis: Diagnosis, k: int, run: int, good: np.ndarray, worst: int) -> list[Child]:
    """Return how much of it goes in which direction, and to which side where it is largest."""
    told = diagnosis.contributions
    parts = None if told is None else components(diagnosis, run, told.parts[run][k])
    if parts is None:
        return ['.']
    sides = sides_words(parts[worst])
    return [
        f' ({sides}).' if sides else '.',
        tag('span', f' RMS {rms_words(parts[good])}.', class_='detail'),
    ]


def _mended(diagnosis: Diagnosis, k: int, rule: Rule) -> Html | None:
    """Return the gap that would be left if only this were mended, and whether that passes."""
    left = left_without(diagnosis, k)
    if left is None:
        return None
    told = (
        f'RMS {"falls" if left.rms_after < left.rms else "rises"} from '
        f'{millimetres(left.rms)} to {millimetres(left.rms_after)}, the largest '
        f'{"grows" if left.grows else "goes"} from {millimetres(left.largest)} to '
        f'{millimetres(left.largest_after)}'
    )
    parts: list[Child] = [told, mark(rule, left.largest_after, ', '), '.']
    if unnamed(diagnosis.causes[k]):
        parts.append(f' {_BY_CURVE}{_SHORT * (taken_by_curve(diagnosis, k) is not None)}')
    return joined(parts)


def _action(diagnosis: Diagnosis, k: int) -> Html | str | None:
    cause = diagnosis.causes[k]
    effects = effects_of(diagnosis, cause)[:_VALUES]
    if diagnosis.families and len(effects) > 1:
        return TOGETHER
    if not effects and not unnamed(cause):
        return 'Measure as told under "What to measure next".'
    if unnamed(cause):
        sentences = look_at(diagnosis, k)
    else:
        told = dict.fromkeys(actions(effects, diagnosis.model.robot, diagnosis.model.mends))
        ways = dict.fromkeys(map(gearing, effects))
        sites = [Site(effect.name, effect.site) for effect in effects]
        twins = same_words(diagnosis, *sites)
        sentences = [*told, *twins, *filter(None, [*ways, warning(diagnosis, k)])]
    if effects and alternatives(diagnosis, cause):
        sentences = [
            'Which of them it is must be measured first. Should it be '
            f'{one_of(diagnosis, cause)}:',
            *sentences,
        ]
    return tag('span', *(tag('span', *warned(text)) for text in sentences), class_='lines')


def _at_the_controller(
    diagnosis: Diagnosis, k: int, brand: str | None
) -> list[tuple[str, str | None]]:
    cause = diagnosis.causes[k]
    effects = effects_of(diagnosis, cause)
    head = 'At the controller' if brand is None else f'At the {BRANDS[brand]} controller'
    if not effects:
        return [(head, 'Nothing can be entered before the cause is known.')]
    fault = curve_fault(diagnosis, k)
    if fault:
        return [(head, f'Nothing is to be entered: the curve {fault}.')]
    robot = diagnosis.model.robot
    told = (
        f'{UNNAMED}{_taken_out(diagnosis)}'
        if unnamed(cause)
        else correction(effects[0], brand, robot)
    )
    if alternatives(diagnosis, cause):
        which = one_of(diagnosis, cause)
        told = f'Nothing before it is known which it is. Should it be {which}: {told}'
    return [(head, told)]


def _taken_out(diagnosis: Diagnosis) -> str:
    """Return how a correction is made without the curves that are advised against."""
    others = against(diagnosis)
    if not others:
        return ''
    return f' Its model is a copy of diagnosis.json without the entries of {others} under found.'


def _picture(diagnosis: Diagnosis, k: int) -> Html | None:
    """Return how far the cause moves the tool along the recording, or its curve."""
    curve = _curve(diagnosis, diagnosis.causes[k])
    if curve is not None:
        return curve
    most = _part(diagnosis, k)
    told = diagnosis.contributions
    if most is None or told is None:
        return None
    run = most[0]
    index = drawn(diagnosis, run)
    size = 1e3 * np.linalg.norm(told.parts[run][k][index], axis=1)
    dots = static(diagnosis, run)
    return chart(
        'How far it moves the tool',
        along(diagnosis, run)[index],
        [Line('moves the tool', size, 'accent', points=dots)],
        (Axis('station') if dots else Axis('time', 's'), Axis('by', 'mm')),
        key=f'run{run}',
        from_zero=True,
        height=120,
    )


def _curve(diagnosis: Diagnosis, cause: Cause) -> Html | None:
    """Return the picture of the curve that is furthest off, of those that stand for a cause."""
    chosen = furthest_off(diagnosis, cause)
    # A constant is one value, and no picture.
    if chosen is None or chosen[1].over == 'constant':
        return None
    m, curve = chosen
    robot = diagnosis.model.robot
    return curve_figure(curve, spreads(diagnosis)[m], robot.index(curve.joint))


def _smaller(rest: list[Cause]) -> Html | None:
    if not rest:
        return None
    rows = [level_row(cause) for cause in rest]
    return tag(
        'details',
        tag('summary', counted(len(rest), 'smaller cause')),
        table(LEVEL_HEADS, rows, 'levels'),
        class_='detail',
    )
