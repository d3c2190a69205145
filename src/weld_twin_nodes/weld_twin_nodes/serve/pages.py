# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The pages of the server, made there; none needs a script."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from time import localtime, strftime
from typing import Any, NamedTuple

from weld_twin_core.arm import catalog

from ..report.html import Child, Html, document, section, table, tag
from .job import DONE, NO_ROBOT, OPEN, RUNNING, UNSOUND, Asked, Job

REFRESH = 2
"""Seconds after which the page of a recording that is not finished is asked for anew."""
LOOK = 10
"""Seconds after which the list of recordings is, while one of them is not finished."""
ALLOWED = "form-action 'self'; frame-src 'self'"
FRAMES = (
    ('', 'nothing: base and tool are known'),
    ('base', 'where the instrument stood (base)'),
    ('tool', 'where the reflector sits (tool)'),
    ('base,tool', 'neither of the two (base and tool)'),
)
OPTIONS = {
    '--length-unit': "'Lengths of a table'",
    '--angle-unit': "'Angles of a table'",
    '--joint-columns': 'the first line of the table',
}
"""Where what the command's sentences speak of is here."""
UNITS = {
    'length_unit': (('', 'as the table says'), ('mm', 'mm'), ('m', 'm')),
    'angle_unit': (('', 'as the table says'), ('deg', 'degrees'), ('rad', 'radians')),
}
FILES = (
    ('report.html', 'the sheet'),
    ('diagnosis.json', 'the diagnosis as data'),
    ('robot.urdf', 'the corrected robot as URDF'),
    ('robot.yaml', 'the corrected robot as YAML'),
    ('effects.yaml', 'the effects found'),
)
"""What of a result may be fetched, and what it is."""


@cache
def _style() -> str:
    return (files(__package__) / 'serve.css').read_text(encoding='utf-8')


class Site(NamedTuple):
    """
    What this server has besides recordings.

    Attributes
    ----------
    plant : bool
        A history that everybody reads.
    live : bool
        The verdict of running nodes.

    """

    plant: bool = False
    live: bool = False

    def ways(self) -> Html:
        """Return the way to all pages."""
        links = [
            ('/', 'New recording'),
            ('/recordings', 'My recordings'),
            ('/history', 'My history'),
        ]
        links += [('/plant', 'Plant')] * self.plant + [('/live', 'Live')] * self.live
        return tag('nav', *(tag('a', text, href=href) for href, text in links))


def page(title: str, *body: Child, site: Site, refresh: int | None = None) -> str:
    """Return a whole page with the way to the others."""
    again = None if refresh is None else tag('meta', http_equiv='refresh', content=refresh)
    name = tag('p', tag('b', 'weld_twin'), ' · ', title, class_='kind')
    head = tag('header', name, site.ways())
    return document(title, again, tag('main', head, *body), allowed=ALLOWED, style=_style())


def start_page(site: Site, said: str = '') -> str:
    """Return the page on which a recording is dropped."""
    robots = [('', 'choose, or drop its file'), *((n, n) for n in catalog.names())]
    form = tag(
        'form',
        tag(
            'label',
            'Recording',
            _small(
                'Drop it here: a table (.csv), or a bag (.mcap, or all its files). The file of your own '
                'robot (.urdf, .yaml) goes with it.'
            ),
        ),
        tag('input', type='file', name_='files', multiple='', id='files', aria_label='Recording'),
        tag('label', 'Or a folder', _small('of a bag, with its metadata.yaml'), for_='folder'),
        tag('input', type='file', name_='files', webkitdirectory='', id='folder', class_='folder'),
        tag(
            'div',
            _choice('robot', 'Robot', robots, ''),
            _choice('align', 'What is not known?', FRAMES, ''),
            class_='fields',
        ),
        _details(),
        tag('button', 'Diagnose', type='submit', class_='main'),
        action='/recordings',
        method='post',
        enctype='multipart/form-data',
    )
    lead = 'Joint angles and measured positions of one robot, recorded together.'
    body = section('Where does the real robot differ?', form, id_='drop', lead=lead)
    return page('new recording', _said(said), body, site=site)


def _details() -> Html:
    """Return the fields that most people leave alone."""
    return tag(
        'details',
        tag('summary', 'Table units, and history'),
        tag(
            'div',
            _choice('length_unit', 'Lengths of a table', UNITS['length_unit'], ''),
            _choice('angle_unit', 'Angles of a table', UNITS['angle_unit'], ''),
            _field('cell', 'Cell', 'its name, to keep the result in its history'),
            _field('at', 'Recorded', 'such as 2026-03-31T14:05; empty: as its stamps say'),
            class_='fields',
        ),
    )


def _small(text: str) -> Html:
    return tag('small', text)


def _choice(name: str, title: str, choices: Sequence[tuple[str, str]], chosen: str) -> Html:
    options = [
        tag('option', text, value=value, selected='' if value == chosen else None)
        for value, text in choices
    ]
    return tag('div', tag('label', title, for_=name), tag('select', *options, name_=name, id=name))


def _field(name: str, title: str, hint: str) -> Html:
    return tag(
        'div',
        tag('label', title, _small(hint), for_=name),
        tag('input', name_=name, id=name, maxlength=80, autocomplete='off'),
    )


def _said(text: str) -> Html | None:
    return tag('p', _sentence(text), class_='said', role='alert') if text else None


def _sentence(text: str) -> str:
    """Return a command's sentence as somebody without a command line reads it."""
    for option, here in OPTIONS.items():
        text = text.replace(option, here)
    return text[:1].upper() + text[1:]


def recordings_page(jobs: Sequence[Job], site: Site) -> str:
    """Return the list of a user's recordings."""
    rows = [
        (
            tag(
                'a',
                strftime('%Y-%m-%d %H:%M', localtime(job.since)),
                href=f'/recordings/{job.key}',
                class_='date',
            ),
            ', '.join(job.names[:2]) + (' ...' if len(job.names) > 2 else ''),
            job.state,
            _sentence(job.said),
        )
        for job in jobs
    ]
    heads = ('dropped', 'files', 'state', 'said')
    body = table(heads, rows) if rows else tag('p', 'None yet.')
    again = LOOK if any(job.state in OPEN for job in jobs) else None
    mine = section('My recordings', body, id_='mine')
    return page('my recordings', mine, site=site, refresh=again)


def job_page(job: Job, ahead: int, told: Mapping[str, Any] | None, site: Site) -> str:
    """
    Return the page of a recording: its place, its progress, its question or its sheet.

    Parameters
    ----------
    job : Job
    ahead : int
        How many come before it.
    told : mapping, optional
        Its diagnosis.json, where there is one.
    site : Site

    """
    if job.state in OPEN:
        return page('in work', _progress(job, ahead), refresh=REFRESH, site=site)
    if job.state == DONE:
        return page('verdict', *_result(job), site=site)
    if job.state == UNSOUND:
        return page('unsound', *_question(job, told or {}), site=site)
    what = 'One question first' if job.said == NO_ROBOT else 'It could not be diagnosed'
    why = section(what, _said(job.said), id_='refused')
    return page(job.state, why, _ask_again(job), site=site)


def _progress(job: Job, ahead: int) -> Html:
    if job.state == RUNNING:
        text = f'In work: {job.said or "starting"}.'
    else:
        text = f'Waiting: {ahead} before it.' if ahead else 'Waiting: it is next.'
    names = tag('p', ', '.join(job.names), class_='note')
    status = tag('p', text, class_='second', id_='progress', role='status')
    return section('Your recording', status, names, id_='work')


def _result(job: Job) -> tuple[Child, ...]:
    """Return the sheet, and what may be fetched."""
    place = f'/recordings/{job.key}'
    links = [
        tag('li', tag('a', what, href=f'{place}/{name}', download=None if k == 0 else name))
        for k, (name, what) in enumerate(FILES)
    ]
    sheet = tag('iframe', src=f'{place}/report.html', title='the sheet', sandbox='allow-scripts')
    said = f'{_sentence(job.said)}. ' if job.said else ''
    alone = tag('a', 'Open the sheet alone', href=f'{place}/report.html')
    note = tag('p', alone, f', to print it. {said}It took {job.seconds:.0f} s.', class_='note')
    return section('Verdict', note, sheet, id_='result'), section(
        'Files', tag('ul', *links), id_='files'
    )


def _question(job: Job, told: Mapping[str, Any]) -> tuple[Child, ...]:
    """Return what is wrong with data or set-up, and ask whether to correct it."""
    wrong = [
        joined
        for each in told.get('unsound') or []
        for joined in (
            _said(str(each['sentence'])),
            tag('p', _sentence(str(each.get('remedy') or '')), class_='note'),
        )
    ]
    mend = tag(
        'form',
        *_hidden(job.asked, apply='yes'),
        tag('button', 'Correct it and go on', type='submit', class_='main'),
        action=f'/recordings/{job.key}/again',
        method='post',
        enctype='multipart/form-data',
    )
    sheet = tag('p', tag('a', 'Read the sheet', href=f'/recordings/{job.key}/report.html'))
    body = section('Data or set-up are wrong', *wrong, mend, sheet, id_='question')
    return body, _ask_again(job)


def _hidden(asked: Asked, **other: str) -> list[Html]:
    fields = {
        'robot': asked.robot,
        'align': asked.align,
        'length_unit': asked.length_unit,
        'angle_unit': asked.angle_unit,
        'cell': asked.cell,
        'at': asked.at,
        **other,
    }
    return [tag('input', type='hidden', name_=name, value=value) for name, value in fields.items()]


def _ask_again(job: Job) -> Html:
    """Return the questions once more, for the same files."""
    asked = job.asked
    own = [(n, n) for n in job.names if n == asked.robot]
    robots = [*own, *((n, n) for n in catalog.names())]
    robots = robots if asked.robot else [('', 'choose'), *robots]
    form = tag(
        'form',
        tag(
            'div',
            _choice('robot', 'Robot', robots, asked.robot),
            _choice('align', 'What is not known?', FRAMES, asked.align),
            _choice('length_unit', 'Lengths of a table', UNITS['length_unit'], asked.length_unit),
            _choice('angle_unit', 'Angles of a table', UNITS['angle_unit'], asked.angle_unit),
            class_='fields',
        ),
        tag('input', type='hidden', name_='cell', value=asked.cell),
        tag('input', type='hidden', name_='at', value=asked.at),
        tag('button', 'Try again', type='submit', class_='main'),
        action=f'/recordings/{job.key}/again',
        method='post',
        enctype='multipart/form-data',
    )
    return section('Answer, and try again', form, id_='again')


def message_page(title: str, text: str, site: Site) -> str:
    """Return a page that says one thing."""
    return page(title, section(title.capitalize(), tag('p', text), id_='message'), site=site)


def live_page(said: Mapping[str, str] | None, site: Site) -> str:
    """Return the verdict of the running nodes, asked for anew all the time."""
    if said is None:
        body: Child = tag('p', 'No verdict yet: the nodes publish one once they found a gap.')
    else:
        rows = [(key, value) for key, value in said.items() if key != 'sentence']
        body = tag('div', tag('h1', said['sentence']), table(('', ''), rows))
    section_ = section('The running nodes', body, id_='live')
    return page('live', section_, refresh=REFRESH, site=site)
