# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What fleets and users came to, as pages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from weld_twin_msgs_py.files import markdown

Row = tuple[str, str, str]
HEADS = ('measure', 'goal', 'found')


def fleet_page(result: Mapping[str, Any]) -> str:
    """Return the page of `weld-twin lab fleet`."""
    rows = [
        *(_speed(result['speed']) if 'speed' in result else []),
        *(_kills(result['kills']) if 'kills' in result else []),
    ]
    lead = (
        '# A fleet, timed and killed\n\n`weld-twin lab fleet`\n\nThe recordings are made by the plant: '
        'fifty stations each, six kinds of arm, one joint with play, a tracker that stands anywhere. A '
        'list is run by the command, each time into an empty database. Rows are compared to the last '
        'digit: verdict, parameters, covariances.\n\n'
    )
    return lead + markdown.table(HEADS, *rows)


def _speed(found: Mapping[str, Any]) -> list[Row]:
    count, took, times = found['recordings'], found['seconds'], found['times_one_worker']
    names = {'two': 'on two cores', 'cluster': 'on a local Dask cluster of two workers'}
    states = ', '.join(f'{number} {state}' for state, number in found['states'].items())
    return [
        (f'{count} recordings with one worker', '', f'{took["one"]:.0f} s: {states}'),
        *(
            (
                f'the same {names[name]}',
                '>= 1.8 times as fast',
                f'{took[name]:.0f} s, {times[name]:.2f} times',
            )
            for name in times
        ),
        ('rows that differ between them', '0', str(found['differing_rows'])),
        (
            'a recording, median of the first and of the last third',
            'alike',
            f'{found["first_third_s"]:.2f} s and {found["last_third_s"]:.2f} s',
        ),
        ('memory of a recording at most', 'bounded', f'{found["memory_mb"]:.0f} MB'),
        ('100,000 recordings on 200 such cores, on paper', '', f'{found["paper_hours"]:.2f} h'),
    ]


def _kills(found: Mapping[str, Any]) -> list[Row]:
    moments: Sequence[float] = found['moments_s']
    between = f'{min(moments):.1f} to {max(moments):.1f} s after its start'
    return [
        (
            f'`kill -9` of a run of {found["rows"]} recordings',
            '50 moments',
            f'{found["kills"]}, {between}',
        ),
        ('finished recordings lost, or written twice', '0', str(found['lost_or_rewritten'])),
        ('rows that differ from a run in peace', '0', str(found['differing_rows'])),
    ]


def _hostile(found: Mapping[str, Any]) -> list[Row]:
    beside, count = found['hostile'], found['users']
    longest = max(beside['waits_s'])
    return [
        (
            f'{count} users beside {beside["connections"]} hostile connections, longest wait',
            '<= 2 times that in peace, as the median',
            f'{longest:.0f} s, {beside["times"]:.2f} times (median {beside["times_median"]:.2f})',
        ),
        ('of them with a sheet', str(count), str(beside['sheets'])),
        ('hostile connections opened in all', '', str(beside['opened'])),
    ]


def users_page(found: Mapping[str, Any]) -> str:
    """Return the page of `weld-twin lab users`."""
    refused = sum(said.startswith('refused') for said in found['malicious'].values())
    count = found['users']
    rows: list[Row] = [
        ('the command', '', f'{found["command_s"]:.1f} s'),
        (
            'one user, from drop to sheet',
            '<= 1.5 times the command',
            f'{found["one_user_s"]:.1f} s, {found["one_user_times_command"]:.2f} times',
        ),
        (
            f'{count} users at once, until the last has a sheet',
            '<= 1.2 times the work in turn',
            f'{found["seconds"]:.0f} s, {found["times_serial_work"]:.2f} times',
        ),
        ('of them with a sheet', str(count), str(found['sheets'])),
        ('of them saw their place in the queue', str(count - 1), str(found['saw_their_place'])),
        *(_hostile(found) if 'hostile' in found else []),
        ('malicious files refused', str(len(found['malicious'])), str(refused)),
    ]
    lead = (
        f'# Users of the server\n\n`weld-twin lab users{found["options"]}`\n\n'
        f'What is dropped is {found["recording"]}; the server has one worker. Each user is '
        'a plain client. The first in line has no place to see. Malicious files are those of '
        '`weld-twin lab campaign fuzz`.\n\n'
    )
    if 'hostile' in found:
        told = found['hostile']
        lead += (
            f'Hostile connections come from the same address as the users: {told["connections"]} at '
            f'once, a sixth each that {", ".join(told["ways"][:-1])}, or {told["ways"][-1]}. Whoever is '
            'closed comes back after 0.1 s.\n\n'
        )
    harms = markdown.table(('malicious file', 'what became of it'), *found['malicious'].items())
    return f'{lead}{markdown.table(HEADS, *rows)}\n{harms}'
