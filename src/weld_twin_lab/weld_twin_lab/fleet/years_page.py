# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the study of years came to, as a page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from weld_twin_msgs_py.files import markdown

from .years import GOALS

WORDS = {
    'found': 'real changes found within three recordings of reaching four standard errors',
    'false_a_year': 'false alarms a year',
    'right': 'of those found: effect and joint right, date within one recording',
    'forecast': 'the date of reaching a limit lies in the 90 % interval',
}


LEAD = """\
Cells are checked every week: 120 stations, a tracker that is set up anew each quarter and then sees
other stations, weeks that are missed, holidays. Tools are knocked, motors put back, gears wear and
are serviced, links grow with the seasons; in one year of four nothing happens.

In the *drawn* years, how sure each diagnosis is comes from real diagnoses of recordings that the plant
made; the values are drawn. The other years are simulated by the plant week by week, and each check is
diagnosed by the command.
"""
COUNTED = """\
What is counted: a change is real from the recording on after which its size is four of its standard
errors, all else left free. It is found when it, or the set told with it, holds its coordinate. Effect
and joint are judged at the end of the year, by the coordinate told first; the last joint's row and the
tool are one place. The date of a step is right within one recording, that of a trend if the interval
told reaches the week it began in; a step may be told as *at once or slowly since* a date, which counts
for wear. Limits of forecasts lie half as far ahead again as the wear has
gone. A change of three standard errors would be told in one of seven looks: so many instants and
coordinates are tried that chance reaches four. The changes drawn are those that use makes: a link that
was bent would come second in a set.
"""
MORE = {
    'found_at_last': 'found at all',
    'what': 'of those found: effect and joint right',
    'when': 'of those found: date right',
    'sizes': 'of those told as they are: size in its 90 % interval',
}


def page(result: Mapping[str, Any], seed: int) -> str:
    """Return the page."""
    drawn, full = result['drawn'], result['full']
    rows = [
        (words, _goal(name), _value(drawn, name), _value(full, name))
        for name, words in {**WORDS, **MORE}.items()
    ]
    heads = ('measure', 'goal', f'{drawn["years"]} drawn years', f'{full["years"]} in full')
    kinds = [
        (kind, *('{1} of {0}'.format(*figures['kinds'][kind]) for figures in (drawn, full)))
        for kind in drawn['kinds']
    ]
    counts = (
        f'Real changes: {drawn["real"]} and {full["real"]}; forecasts: {drawn["forecasts"]} and '
        f'{full["forecasts"]}; looks: {drawn["checks"]} and {full["checks"]}. In time by kind:'
    )
    parts = (
        f'# Simulated years\n\n`weld-twin lab years --seed {seed} --years {drawn["years"]}`\n',
        LEAD,
        markdown.table(heads, *rows),
        '',
        counts,
        '',
        markdown.table(('kind', 'drawn', 'in full'), *kinds),
        '',
        COUNTED,
    )
    return '\n'.join(parts)


def _goal(name: str) -> str:
    if name not in GOALS:
        return ''
    low, high = GOALS[name]
    if name == 'false_a_year':
        return f'<= {high:g}'
    return f'{100 * low:.0f} to {100 * high:.0f} %' if high < 1.0 else f'>= {100 * low:.0f} %'


def _value(figures: Mapping[str, Any], name: str) -> str:
    value = figures[name]
    if value is None:
        return ''
    return f'{value:.2f}' if name == 'false_a_year' else f'{100.0 * value:.1f} %'
