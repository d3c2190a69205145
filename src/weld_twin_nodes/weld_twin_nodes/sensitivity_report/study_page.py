# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The study as one HTML file that needs nothing else."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from typing import Any

from weld_twin_core import __version__

from ..report.html import Html, bars, document, section, table, tag
from .figures import Drawing

_ALLOWED = 'img-src data:'
_STYLE = """
figure { margin: 0 0 1.5rem; } figure img { width: 100%; height: auto; background: #fff; }
.claims td:nth-child(4) { font-weight: 600; min-width: 9rem; }
.claims { font-size: .85rem; } table { margin-bottom: 1rem; }
"""
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
    title = (
        'The claims of the paper'
        if study is None
        else (f'Sensitivity of {study["setting"]["robot"]} on {study["setting"]["seam"]}')
    )
    foot = tag('p', f'weld_twin {__version__}', class_='note')
    main = tag('main', tag('h1', title), *parts, foot)
    return document(title, main, allowed=_ALLOWED, style=_STYLE)


def _study(study: dict[str, Any]) -> list[Html]:
    motions = study['motions']
    first = next(iter(motions))
    found = motions[first]['global']
    out = [_answer(first, found), _tighten(motions), _stack(motions), _local(motions[first])]
    if 'advice' in study:
        out.append(_advice(study['advice']))
    if study.get('recorded'):
        out.append(_recorded(study['recorded']))
    return out


def _answer(motion: str, found: dict[str, Any]) -> Html:
    indices = found['sobol']['parameter']['d_norm']
    rows = sorted(indices['indices'], key=lambda row: -row['ST'])
    best = rows[0]
    settled = 'converged' if indices['converged'] else 'not converged yet'
    return section(
        'Which tolerance to tighten',
        tag(
            'p',
            f'{best["name"]} first: its total index is {_index(best)} on the {motion} motion.',
            class_='second',
        ),
        _bars(rows[:_SHOWN]),
        tag(
            'p',
            f'Total Sobol indices of the largest deviation with 95 % intervals; '
            f'N = {indices["base_samples"]}, {indices["runs"]} runs, seed {indices["seed"]}, '
            f'{settled} (widest half-width '
            f'{indices["largest_ST_half"]:.3f}, change from half of N '
            f'{indices["largest_ST_change"]:.3f}); sum of first-order indices '
            f'{indices["sum_S1"]:.2f}. The fast model is within {found["model_error"]:.0e} of the '
            'exact twin.',
            class_='note',
        ),
        id_='answer',
    )


def _index(row: dict[str, Any]) -> str:
    return f'{row["ST"]:.3f} ± {row["ST_half"]:.3f}'


def _bars(rows: Sequence[dict[str, Any]]) -> Html:
    scale = max(1.0, *(row['ST'] for row in rows))
    return bars([(row['name'], row['ST'] / scale, _index(row)) for row in rows], 'wide')


def _tighten(motions: dict[str, Any]) -> Html:
    parts: list[Html] = []
    for motion, found in motions.items():
        sobol = found['global']['sobol']
        columns = [
            tag(
                'div',
                tag('h3', f'By {by}, {motion}'),
                _bars(sorted(outputs['d_norm']['indices'], key=lambda row: -row['ST'])),
            )
            for by, outputs in sobol.items()
            if by != 'parameter'
        ]
        parts.append(tag('div', *columns, class_='columns'))
    return section('Groups', *parts, id_='groups')


def _stack(motions: dict[str, Any]) -> Html:
    parts: list[Html] = []
    for motion, found in motions.items():
        stack = found['global']['stack']
        heads = ('', *(f'{row["percent"]:.0f} %' for row in stack['percentiles']['max_m']))
        names = {
            'max_m': 'largest deviation',
            'across_m': 'across the seam',
            'stickout_m': 'stick-out',
        }
        rows = [
            [name, *(f'{1e3 * row["value"]:.3f} mm' for row in stack['percentiles'][key])]
            for key, name in names.items()
        ]
        d_norm = [f'{row["value"]:.2e}' for row in stack['percentiles']['d_norm']]
        inside = [['as given', *_inside(stack)]]
        inside += [[f'{k} halved', *_inside(v)] for k, v in found['global']['halved'].items()]
        limits = stack['tolerance']
        parts += [
            tag('h3', f'{motion}, {stack["runs"]} runs'),
            table(heads, [*rows, ['D_norm', *d_norm]]),
            table(
                (
                    'probability that the whole seam is inside',
                    f'across ± {1e3 * limits["across_m"]:.2f} mm',
                    f'stick-out ± {1e3 * limits["stickout_m"]:.2f} mm',
                    'both',
                ),
                inside,
            ),
        ]
    return section('The tolerance stack', *parts, id_='stack')


def _inside(stack: dict[str, Any]) -> list[str]:
    return [
        f'{100 * p["value"]:.1f} % ({100 * p["low"]:.1f} to {100 * p["high"]:.1f})'
        for p in (stack['inside'][key] for key in ('across', 'stickout', 'both'))
    ]


def _local(motion: dict[str, Any]) -> Html:
    heads = (
        'parameter',
        'S analytic',
        'S by difference',
        'differ by',
        'at one tolerance',
        'S of D_norm',
        'one tolerance makes',
    )
    rows = [
        [
            r['name'],
            f'{r["S_analytic_peak_m"]:.4f} m/{r["unit"]}',
            f'{r["S_difference_peak_m"]:.4f}',
            f'{r["disagreement"]:.0e}',
            f'{r["disagreement_at_tolerance"]:.0e}',
            f'{r["S_norm"]:.3f} /{r["unit"]}',
            f'{1e3 * r["contribution_m"]:.3f} mm rms',
        ]
        for r in motion['local']['parameters']
    ]
    lead = (
        'Slope of the largest deviation at no error, where D is the tip of a cone and only the '
        'slope to one side exists, and agreement of dD/dp at an error of one tolerance.'
    )
    return section('One error at a time', table(heads, rows), id_='local', lead=lead)


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
    laws = [
        [
            r['profile'],
            f'{r["duration_s"]:.1f} s',
            f'{1e3 * r["expected_without_lag_m"]:.3f} mm',
            f'{1e3 * r["expected_m"]:.3f} mm',
            f'{1e3 * r["same_time_m"]:.3f} mm',
        ]
        for r in profiles
    ]
    return table(
        (
            'time law',
            'takes',
            'expected, geometry and play',
            'and a lag of every joint',
            'the same, all as slow as the slowest',
        ),
        laws,
    )


def _placements(placements: list[dict[str, Any]]) -> Html:
    given = placements[0]['expected_m']
    places = [
        [
            r['free'],
            f'{57.29578 * r["rotation_rad"]:+.1f} deg',
            f'{1e3 * r["x_m"]:+.0f} mm',
            f'{1e3 * r["y_m"]:+.0f} mm',
            f'{57.29578 * r["yaw_rad"]:+.1f} deg',
            f'{1e3 * r["expected_m"]:.3f} mm',
            f'{100 * (1 - r["expected_m"] / given):.1f} %',
        ]
        for r in placements
    ]
    return table(
        ('free', 'torch about the wire', 'base x', 'base y', 'base yaw', 'expected', 'gain'),
        places,
    )


def _recorded(recorded: dict[str, Any]) -> Html:
    below = recorded['share_of_runs_below']
    rows = [
        [
            'largest deviation',
            f'{1e3 * recorded["max_m"]:.3f} mm',
            f'{100 * below["max"]:.1f} % of the runs stay below',
        ],
        [
            'rms',
            f'{1e3 * recorded["rms_m"]:.3f} mm',
            f'{100 * below["rms"]:.1f} % of the runs stay below',
        ],
        [
            'across the seam',
            f'{1e3 * recorded["across_m"]:.3f} mm',
            'inside' if recorded['inside']['across'] else 'outside the tolerance',
        ],
        [
            'stick-out',
            f'{1e3 * recorded["stickout_m"]:.3f} mm',
            'inside' if recorded['inside']['stickout'] else 'outside the tolerance',
        ],
    ]
    return section(
        'What was recorded', table(('', 'recorded', 'beside the tolerances'), rows), id_='recorded'
    )


def _figure(drawing: Drawing) -> Html:
    # As an image, neither the page's style nor another figure's glyphs can get into it.
    data = b64encode(drawing.svg.encode()).decode()
    picture = tag('img', src=f'data:image/svg+xml;base64,{data}', alt=drawing.caption)
    return tag('figure', picture, tag('figcaption', drawing.caption))


def _claims(claims: dict[str, Any]) -> Html:
    rows = [
        [c['statement'], c['where'], f'{c["held"]} of {c["cases"]}', c['verdict'], c['reason']]
        for c in claims['claims']
    ]
    heads = ('claim', 'in the paper', 'holds as written', 'verdict', 'why, as measured')
    lead = f'Measured on {", ".join(claims["robots"])}; seams {", ".join(claims["seams"])}.'
    content = table(heads, rows, 'claims')
    return section('The claims of the paper', content, id_='claims', lead=lead)


def _setting(setting: dict[str, Any]) -> Html:
    tolerances = [
        [
            ' '.join(filter(None, (t['effect'], t.get('joint')))),
            t['parameter'] + (f'[{t["index"]}]' if 'index' in t else ''),
            t['distribution'],
            ', '.join(f'{k} {v:g}' for k, v in t.items() if isinstance(v, float)),
        ]
        for t in setting['tolerances']
    ]
    plain = [[k.replace('_', ' '), _plain(v)] for k, v in setting.items() if k != 'tolerances']
    return section(
        'What was asked',
        table(('', ''), plain),
        tag(
            'details',
            tag('summary', f'{len(tolerances)} tolerances'),
            table(('effect', 'parameter', 'distribution', 'numbers [SI]'), tolerances),
        ),
        id_='setting',
    )


def _plain(value: Any) -> str:
    if isinstance(value, dict):
        return '; '.join(f'{key} {_plain(item)}' for key, item in value.items())
    if isinstance(value, list):
        return ', '.join(map(_plain, value)) or 'none'
    return f'{value:.6g}' if isinstance(value, float) else str(value)
