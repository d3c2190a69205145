# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The study as one HTML file, tolerances in the words of who fits and masters the robot."""

import re
from base64 import b64encode
from collections.abc import Sequence
from math import degrees, sqrt
from typing import Any, NamedTuple

from weld_twin_core import __version__
from weld_twin_core.effects.registry import REGISTRY
from weld_twin_nodes.wording.quantities import millimetres
from weld_twin_nodes.wording.words import capital, cause

from ..report.html import Html, bars, columns, document, joined, section, table, tag
from .figures import Drawing

TIGHTER = 5.0
"""How many times tighter a tolerance is asked for: what remains of it is 4 % of its square, so
that the gain is nearly all that can be had of it."""
_AXES = 'xyz'
_NAME = re.compile(r'(?P<effect>\w+?)(\.(?P<joint>[^.]+))?\.(?P<parameter>\w+)(\[(?P<at>\d)\])?')
_DO = {
    'joint_offset': 'master {joint}',
    'link_length': 'measure the link length of {joint} and enter it',
    'link_offset': 'measure the link offset of {joint} and enter it',
    'link_twist': 'measure the twist of the link of {joint} and enter it',
    'axis_parallelism': 'measure how parallel the axis of {joint} is and enter it',
    'backlash': 'preload or renew the gear of {joint}',
    'gear_ratio': 'measure the gear ratio of {joint} and enter it',
    'joint_compliance': 'measure how far {joint} yields and compensate it',
    'payload': 'weigh the tool and enter it',
}
_FRAMES = {
    ('base_pose', 'rotvec'): 'square up the base about the {axis} axis of the measuring frame',
    ('base_pose', 'xyz'): 'survey the base along the {axis} axis of the measuring frame',
    ('tool_pose', 'rotvec'): 'square up the tool about its {axis} axis',
    (
        'tool_pose',
        'xyz',
    ): "measure the tool centre point along the {axis} axis of the model's flange",
}


class Advice(NamedTuple):
    """What to do about one tolerance: an instruction, from and to what, gain [m] and RMS then [m]."""

    instruction: str
    now: str
    wanted: str
    gain_m: float
    then_m: float


def parameter_words(name: str) -> str:
    """Return the name of a tolerance, such as ``base_pose.rotvec[1]``, as people say it."""
    result = _NAME.fullmatch(name)
    if result is None:
        return name.replace('_', ' ')
    text = cause(result['effect'], result['joint'])
    if result['at'] is None:
        return text
    axis = _AXES[int(result['at']) % 3]
    return f'{text}, {"about" if result["parameter"] == "rotvec" else "along"} {axis}'


def instruction(name: str) -> str:
    """Return what to do to keep a tolerance."""
    result = _NAME.fullmatch(name)
    if result is None:
        return f'tighten {name}'
    if result['at'] is not None and (result['effect'], result['parameter']) in _FRAMES:
        axis = _AXES[int(result['at']) % 3]
        return _FRAMES[result['effect'], result['parameter']].format(axis=axis)
    sentence = _DO.get(result['effect'])
    if sentence is None:
        return f'tighten the {parameter_words(name)}'
    return sentence.format(joint=result['joint'] or 'the robot')


def advised(parameters: Sequence[dict[str, Any]], most: int) -> list[Advice]:
    """
    Return what gains most, largest gain first.

    Tolerances are independent: one that is tightened takes its square off that of the whole.
    """
    whole = sum(row['contribution_m'] ** 2 for row in parameters)
    out = []
    for row in parameters:
        then = sqrt(max(whole - row['contribution_m'] ** 2 * (1.0 - TIGHTER**-2), 0.0))
        size = spread_of(row['tolerance'])
        out.append(
            Advice(
                instruction(row['name']),
                sized(size, row['unit']),
                sized(size / TIGHTER, row['unit']),
                sqrt(whole) - then,
                then,
            )
        )
    return sorted(out, key=lambda advice: -advice.gain_m)[:most]


def spread_of(distribution: dict[str, Any]) -> float:
    """Return how wide a tolerance is: a standard deviation, or half the width of a uniform one."""
    if 'std' in distribution:
        return float(distribution['std'])
    if 'low' in distribution and 'high' in distribution:
        return 0.5 * abs(float(distribution['high']) - float(distribution['low']))
    return max((abs(float(v)) for v in distribution.values() if isinstance(v, float)), default=0.0)


def sized(value: float, unit: str) -> str:
    """Return a tolerance in the units of a workshop."""
    if unit == 'm':
        return f'{1e3 * value:.3g} mm'
    if unit == 'rad':
        return f'{degrees(value):.2g}° ({1e3 * value:.2g} mrad)'
    return f'{value:.3g} {unit}'.rstrip(' -')


_ALLOWED = 'img-src data:'
_STYLE = """
figure { margin: 0 0 1.5rem; } figure img { width: 100%; height: auto; background: #fff; }
@media screen and (prefers-color-scheme: dark) {
  figure img { filter: invert(.91) hue-rotate(180deg); }
}
.advice th[scope=row] { min-width: 9rem; }
.claims td:nth-child(4) { font-weight: 600; min-width: 9rem; }
.claims { font-size: .85rem; } table { margin-bottom: 1rem; }
"""
_ADVISED = 5
"""Tolerances to tighten that are listed; the others gain less than these."""
_SHOWN = 12
"""Bars shown; the file has all."""


def study_page(
    study: dict[str, Any] | None, claims: dict[str, Any] | None, drawings: Sequence[Drawing]
) -> str:
    """Return the page of a study, of a claims table, or of both."""
    parts: list[Html] = [] if study is None else [*_study(study)]
    if drawings:
        parts.append(section('Figures', *(_figure(d) for d in drawings), id_='figures'))
    if claims is not None:
        parts.append(_claims(claims))
    if study is not None:
        parts.append(_setting(study['setting']))
    title = 'The claims of the paper'
    if study is not None:
        title = f'Sensitivity of {study["setting"]["robot"]} on {study["setting"]["seam"]}'
    foot = tag('p.note', f'weld_twin {__version__}')
    main = tag('main', tag('h1', title), *parts, foot)
    return document(title, main, allowed=_ALLOWED, style=_STYLE)


def _study(study: dict[str, Any]) -> list[Html]:
    motions = study['motions']
    name, first = next(iter(motions.items()))
    out = [_answer(name, first), _tighten(motions), _stack(motions), _local(first)]
    if 'advice' in study:
        out.append(_advice(study['advice']))
    if study.get('recorded'):
        out.append(_recorded(study['recorded']))
    return out


def _answer(motion: str, study: dict[str, Any]) -> Html:
    result = study['global']
    indices = result['sobol']['parameter']['d_norm']
    rows = sorted(indices['indices'], key=lambda row: -row['ST'])
    settled = 'converged' if indices['converged'] else 'not converged yet'
    first, *others = advised(study['local']['parameters'], _ADVISED)
    gain = millimetres(first.gain_m)
    return section(
        'Which tolerance to tighten',
        tag('p.second', f'{capital(first.instruction)} first: to {first.wanted}, gains {gain}.'),
        _advised([first, *others]),
        tag('h3', f'What drives the largest deviation, {motion} motion'),
        _bars(rows[:_SHOWN]),
        tag(
            'p.note',
            f'Total Sobol indices of the largest deviation with 95 % intervals; '
            f'N = {indices["base_samples"]}, {indices["runs"]} runs, seed {indices["seed"]}, '
            f'{settled} (widest half-width '
            f'{indices["largest_ST_half"]:.3f}, change from half of N '
            f'{indices["largest_ST_change"]:.3f}); sum of first-order indices '
            f'{indices["sum_S1"]:.2f}. The fast model is within {result["model_error"]:.0e} of the '
            'exact twin.',
        ),
        id_='answer',
    )


def _advised(rows: Sequence[Advice]) -> Html:
    shown = {
        'What to do': lambda row: capital(row.instruction),
        'tolerance now': lambda row: row.now,
        'to': lambda row: row.wanted,
        'gains': lambda row: millimetres(row.gain_m),
        'deviation then': lambda row: f'{millimetres(row.then_m)} RMS',
    }
    note = (
        'The gain is in the RMS deviation that is to be expected along the seam, if this tolerance '
        'alone is kept five times tighter. Tolerances are independent, so their squares add up.'
    )
    return joined([columns(rows, shown, 'advice'), tag('p.note', note)])


def _index(row: dict[str, Any]) -> str:
    return f'{row["ST"]:.3f} ± {row["ST_half"]:.3f}'


def _bars(rows: Sequence[dict[str, Any]]) -> Html:
    scale = max(1.0, *(row['ST'] for row in rows))
    return bars(
        [(parameter_words(row['name']), row['ST'] / scale, _index(row)) for row in rows], 'wide'
    )


def _tighten(motions: dict[str, Any]) -> Html:
    parts: list[Html] = []
    for motion, result in motions.items():
        sobol = result['global']['sobol']
        columns = [
            tag(
                'div',
                tag('h3', f'By {by}, {motion}'),
                _bars(sorted(outputs['d_norm']['indices'], key=lambda row: -row['ST'])),
            )
            for by, outputs in sobol.items()
            if by != 'parameter'
        ]
        parts.append(tag('div.columns', *columns))
    return section('Groups', *parts, id_='groups')


def _stack(motions: dict[str, Any]) -> Html:
    parts: list[Html] = []
    for motion, result in motions.items():
        stack, halved = result['global']['stack'], result['global']['halved']
        percentiles, limits = stack['percentiles'], stack['tolerance']
        names = {
            'max_m': 'largest deviation',
            'across_m': 'across the seam',
            'stickout_m': 'stick-out',
        }
        rows = [
            [name, *(f'{1e3 * row["value"]:.3f} mm' for row in percentiles[key])]
            for key, name in names.items()
        ]
        rows.append(['D_norm', *(f'{row["value"]:.2e}' for row in percentiles['d_norm'])])
        inside = {'as given': stack}
        inside |= {f'{name.replace("_", " ")} halved': half for name, half in halved.items()}
        heads = (
            'probability that the whole seam is inside',
            f'across ± {1e3 * limits["across_m"]:.2f} mm',
            f'stick-out ± {1e3 * limits["stickout_m"]:.2f} mm',
            'both',
        )
        of_runs = (f'{row["percent"]:.0f} %' for row in percentiles['max_m'])
        parts += [
            tag('h3', f'{motion}, {stack["runs"]} runs'),
            table(('of all runs', *of_runs), rows),
            table(heads, ([name, *_inside(one)] for name, one in inside.items())),
        ]
    return section('The tolerance stack', *parts, id_='stack')


def _inside(stack: dict[str, Any]) -> list[str]:
    return [
        f'{100 * p["value"]:.1f} % ({100 * p["low"]:.1f} to {100 * p["high"]:.1f})'
        for p in (stack['inside'][key] for key in ('across', 'stickout', 'both'))
    ]


def _local(motion: dict[str, Any]) -> Html:
    shown = {
        'parameter': lambda r: parameter_words(r['name']),
        'S analytic': lambda r: f'{r["S_analytic_peak_m"]:.4f} m/{r["unit"]}',
        'S by difference': lambda r: f'{r["S_difference_peak_m"]:.4f}',
        'differ by': lambda r: f'{r["disagreement"]:.0e}',
        'at one tolerance': lambda r: f'{r["disagreement_at_tolerance"]:.0e}',
        'S of D_norm': lambda r: f'{r["S_norm"]:.3f} /{r["unit"]}',
        'one tolerance makes': lambda r: f'{_mm(r["contribution_m"])} rms',
    }
    lead = (
        'Slope of the largest deviation at no error, where D is the tip of a cone and only the '
        'slope to one side exists, and agreement of dD/dp at an error of one tolerance.'
    )
    rows = columns(motion['local']['parameters'], shown)
    return section('One error at a time', rows, id_='local', lead=lead)


def _mm(metres: float) -> str:
    return f'{1e3 * metres:.3f} mm'


def _advice(advice: dict[str, Any]) -> Html:
    return section(
        'Trajectory advice',
        tag('h3', 'Time laws on the same seam, over equal arc length'),
        _time_laws(advice['profiles']),
        tag('h3', 'Free torch rotation and base placement'),
        _placements(advice['placement']),
        id_='advice',
    )


def _time_laws(profiles: list[dict[str, Any]]) -> Html:
    shown = {
        'time law': lambda r: r['profile'],
        'takes': lambda r: f'{r["duration_s"]:.1f} s',
        'expected, geometry and play': lambda r: _mm(r['expected_without_lag_m']),
        'and a lag of every joint': lambda r: _mm(r['expected_m']),
        'the same, all as slow as the slowest': lambda r: _mm(r['same_time_m']),
    }
    return columns(profiles, shown)


def _placements(placements: list[dict[str, Any]]) -> Html:
    given = placements[0]['expected_m']
    shown = {
        'free': lambda r: r['free'],
        'torch about the wire': lambda r: f'{57.29578 * r["rotation_rad"]:+.1f} deg',
        'base x': lambda r: f'{1e3 * r["x_m"]:+.0f} mm',
        'base y': lambda r: f'{1e3 * r["y_m"]:+.0f} mm',
        'base yaw': lambda r: f'{57.29578 * r["yaw_rad"]:+.1f} deg',
        'expected': lambda r: _mm(r['expected_m']),
        'gain': lambda r: f'{100 * (1 - r["expected_m"] / given):.1f} %',
    }
    return columns(placements, shown)


def _recorded(recorded: dict[str, Any]) -> Html:
    rows = [
        (name, _mm(recorded[f'{key}_m']), f'{100 * below:.1f} % of the runs stay below')
        for name, key, below in (
            ('largest deviation', 'max', recorded['share_of_runs_below']['max']),
            ('rms', 'rms', recorded['share_of_runs_below']['rms']),
        )
    ]
    rows += [
        (name, _mm(recorded[f'{key}_m']), 'inside' if inside else 'outside the tolerance')
        for name, key, inside in (
            ('across the seam', 'across', recorded['inside']['across']),
            ('stick-out', 'stickout', recorded['inside']['stickout']),
        )
    ]
    heads = ('what', 'recorded', 'beside the tolerances')
    return section('What was recorded', table(heads, rows), id_='recorded')


def _figure(drawing: Drawing) -> Html:
    # As an image, neither the page's style nor another figure's glyphs can get into it.
    data = b64encode(drawing.svg.encode()).decode()
    picture = tag('img', src=f'data:image/svg+xml;base64,{data}', alt=drawing.caption)
    return tag('figure', picture, tag('figcaption', drawing.caption))


def _claims(claims: dict[str, Any]) -> Html:
    shown = {
        'claim': lambda c: c['statement'],
        'in the paper': lambda c: c['where'],
        'holds as written': lambda c: f'{c["held"]} of {c["cases"]}',
        'verdict': lambda c: c['verdict'],
        'why, as measured': lambda c: c['reason'],
    }
    lead = f'Measured on {", ".join(claims["robots"])}; seams {", ".join(claims["seams"])}.'
    content = columns(claims['claims'], shown, 'claims')
    return section('The claims of the paper', content, id_='claims', lead=lead)


def _setting(setting: dict[str, Any]) -> Html:
    shown = {
        'tolerance': lambda t: parameter_words(_name_of(t)),
        'size': lambda t: sized(spread_of(t), _unit_of(t)),
        'distribution': lambda t: t['distribution'],
    }
    plain = [
        [_ASKED.get(k, k.replace('_', ' ')), _plain(k, v)]
        for k, v in setting.items()
        if k != 'tolerances'
    ]
    note = (
        'The size is the standard deviation of a normal distribution, and half the width of a uniform '
        'one.'
    )
    return section(
        'What was asked',
        table(('asked', 'value'), plain),
        tag('h3', f'The {len(setting["tolerances"])} tolerances'),
        columns(setting['tolerances'], shown),
        tag('p.note', note),
        id_='setting',
    )


def _name_of(tolerance: dict[str, Any]) -> str:
    parts = [tolerance['effect'], tolerance.get('joint'), tolerance['parameter']]
    at = f'[{tolerance["index"]}]' if 'index' in tolerance else ''
    return '.'.join(part for part in parts if part) + at


def _unit_of(tolerance: dict[str, Any]) -> str:
    parameters = REGISTRY[tolerance['effect']].parameters
    return next(p.unit for p in parameters if p.name == tolerance['parameter'])


_ASKED = {
    'tool': 'tool of the cell, in the flange',
    'length_m': 'length of the seam',
    'across_m': 'allowed across the seam',
    'stickout_m': 'allowed in stick-out',
}
_LENGTHS = ('length_m', 'across_m', 'stickout_m')


def _plain(key: str, value: Any) -> str:
    if key in _LENGTHS and isinstance(value, float):
        return f'{1e3 * value:.4g} mm'
    if key == 'tool' and isinstance(value, dict):
        x, y, z = (f'{1e3 * v:.4g}' for v in value['xyz'])
        turn = ', '.join(f'{v:.4g}' for v in value['quat_xyzw'])
        return f'({x}, {y}, {z}) mm, quaternion x y z w ({turn})'
    if isinstance(value, dict):
        return '; '.join(f'{name} {_plain("", item)}' for name, item in value.items())
    if isinstance(value, list):
        return ', '.join(_plain('', item) for item in value) or 'none'
    return f'{value:.6g}' if isinstance(value, float) else str(value)
