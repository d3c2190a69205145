# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The pages of the server, made there; none needs a script."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from time import localtime, strftime
from typing import Any, NamedTuple
from urllib.parse import quote

from weld_twin_msgs_py.robots import robot_names

from ..report.html import Child, Html, document, section, table, tag
from .fields import CORRECT, FIELDS, sentence
from .job import DONE, NO_ROBOT, OPEN, PROGRAM, RUNNING, UNSOUND, Asked, Job
from .queue import NOT_ADDED

REFRESH = 2
"""Seconds after which the page of a recording that is not finished is asked for anew."""
LOOK = 10
"""Seconds after which the list of recordings is, while one of them is not finished."""
ALLOWED = "form-action 'self'; frame-src 'self'"
FILES = (
    ('report.html', 'the sheet'),
    ('diagnosis.json', 'the diagnosis as data'),
    ('robot.urdf', 'the corrected robot as URDF'),
    ('robot.yaml', 'the corrected robot as YAML'),
    ('effects.yaml', 'the effects found'),
)
"""What of a result may be fetched, and what it is."""
PROGRAM_FILES = (
    ('report.html', 'the page'),
    ('correction.json', 'every move as data'),
)
"""The same of a program, besides its own files."""
FIRST = ('align',)
"""Fields that everybody is shown; the others are folded away."""
MORE = ('tolerance', 'uncertainty', 'controller', 'length_unit', 'angle_unit')
COUNTING = ('joint_signs', 'joint_offsets', 'coupled', 'base_link', 'tip_link', 'flange_link')
"""How the controller counts its joints, and which chain of a URDF is the arm."""
HOW = tuple(name for name, each in FIELDS.items() if CORRECT in each.commands)
"""Fields of a program."""


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
            ('/program', 'Correct a program'),
            ('/recordings', 'My recordings'),
            ('/history', 'My history'),
        ]
        links += [('/plant', 'Plant')] * self.plant + [('/live', 'Live')] * self.live
        links.append(('/me', 'My key'))
        return tag('nav', *(tag('a', text, href=href) for href, text in links))


def page(title: str, *body: Child, site: Site, refresh: int | None = None) -> str:
    """Return a whole page with the way to the others."""
    again = None if refresh is None else tag('meta', http_equiv='refresh', content=refresh)
    name = tag('p', tag('b', 'weld_twin'), ' · ', title, class_='kind')
    head = tag('header', name, site.ways())
    return document(title, again, tag('main', head, *body), allowed=ALLOWED, style=_style())


def start_page(site: Site, said: str = '') -> str:
    """Return the page on which a recording is dropped."""
    robots = [('', 'choose, or drop its file'), *((n, n) for n in robot_names())]
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
            *_fields(FIRST, {}),
            class_='fields',
        ),
        _details(Asked('')),
        tag('button', 'Diagnose', type='submit', class_='main'),
        action='/recordings',
        method='post',
        enctype='multipart/form-data',
    )
    lead = 'Joint angles and measured positions of one robot, recorded together.'
    body = section('Where does the real robot differ?', form, id_='drop', lead=lead)
    return page('new recording', _said(said), body, site=site)


def _details(asked: Asked) -> Html:
    """Return the fields that most people leave alone."""
    hint = 'such as 2026-03-31T14:05 (UTC unless it says +02:00); empty: as its stamps say'
    return tag(
        'details',
        tag('summary', 'Tolerance, controller, signs; table units, and history'),
        tag(
            'div',
            *_fields(MORE, asked.told),
            _field('cell', 'Cell', 'its name, to keep the result in its history', asked.cell),
            _field('at', 'Recorded', hint, asked.at),
            *_fields(COUNTING, asked.told),
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


def _field(name: str, title: str, hint: str, value: str = '') -> Html:
    return tag(
        'div',
        tag('label', title, _small(hint), for_=name),
        tag('input', name_=name, id=name, value=value or None, maxlength=80, autocomplete='off'),
    )


def _fields(names: Sequence[str], reported: Mapping[str, str]) -> list[Html]:
    """Return fields of the table, filled with what was told before."""
    out = []
    for name in names:
        field, value = FIELDS[name], reported.get(name, '')
        if field.choices:
            out.append(_choice(name, field.title, field.choices, value))
        elif field.lines:
            label = tag('label', field.title, _small(field.hint), for_=name)
            out.append(tag('div', label, tag('textarea', value, name_=name, id=name, rows='2')))
        else:
            out.append(_field(name, field.title, field.hint, value))
    return out


def _said(text: str, command: str = '') -> Html | None:
    return tag('p', sentence(text, command), class_='said', role='alert') if text else None


def recordings_page(jobs: Sequence[Job], site: Site) -> str:
    """Return the list of a user's recordings."""
    rows = [
        (
            tag(
                'a',
                _when(job),
                href=f'/recordings/{job.key}',
                class_='date',
            ),
            ', '.join(job.names[:2]) + (' ...' if len(job.names) > 2 else ''),
            job.state,
            sentence(job.said, job.command),
            _button('Delete', f'/recordings/{job.key}/delete'),
        )
        for job in jobs
    ]
    heads = ('dropped', 'files', 'state', 'said', '')
    body = table(heads, rows) if rows else tag('p', 'None yet.')
    again = LOOK if any(job.state in OPEN for job in jobs) else None
    mine = section('My recordings', body, id_='mine')
    return page('my recordings', mine, site=site, refresh=again)


def _button(text: str, place: str, **fields: str) -> Html:
    """Return a button that changes something."""
    hidden = [tag('input', type='hidden', name_=n, value=v) for n, v in fields.items()]
    return tag(
        'form',
        *hidden,
        tag('button', text, type='submit'),
        action=place,
        method='post',
        enctype='multipart/form-data',
        class_='small',
    )


def job_page(
    job: Job, ahead: int, reported: Mapping[str, Any] | None, files: Sequence[str], site: Site
) -> str:
    """
    Return the page of a recording or program: its place, its progress, its question or its sheet.

    Parameters
    ----------
    ahead : int
        How many come before it.
    reported : mapping, optional
        Its diagnosis.json, where there is one.
    files : sequence of str
        What may be fetched.

    """
    if job.state in OPEN:
        return page('in work', _progress(job, ahead), refresh=REFRESH, site=site)
    if job.state == DONE:
        return page('verdict', *_result(job, files), site=site)
    if job.state == UNSOUND:
        return page('unsound', *_question(job, reported or {}), site=site)
    what = 'It could not be corrected' if job.kind == PROGRAM else 'It could not be diagnosed'
    what = 'One question first' if job.said == NO_ROBOT else what
    why = section(what, _said(job.said, job.command), id_='refused')
    return page(job.state, why, _ask_again(job), site=site)


def _progress(job: Job, ahead: int) -> Html:
    if job.state == RUNNING:
        text = f'In work: {job.said or "starting"}.'
    else:
        text = f'Waiting: {ahead} before it.' if ahead else 'Waiting: it is next.'
    names = tag('p', ', '.join(job.names), class_='note')
    status = tag('p', text, class_='second', id_='progress', role='status')
    return section('Your recording', status, names, id_='work')


def _result(job: Job, files: Sequence[str]) -> tuple[Child, ...]:
    """Return the sheet, and what may be fetched."""
    place = f'/recordings/{job.key}'
    known = dict(PROGRAM_FILES if job.kind == PROGRAM else FILES)
    links = [
        tag(
            'li',
            tag(
                'a',
                known.get(name, f'the corrected program, {name}'),
                href=f'{place}/{quote(name)}',
                download=None if name.endswith('.html') else name,
            ),
        )
        for name in files
    ]
    sheet = tag('iframe', src=f'{place}/report.html', title='the sheet', sandbox='allow-scripts')
    said = f'{sentence(job.said)}. ' if job.said else ''
    alone = tag('a', 'Open the sheet alone', href=f'{place}/report.html')
    note = tag('p', alone, f', to print it. {said}It took {job.seconds:.0f} s.', class_='note')
    more = None
    if job.said.startswith(NOT_ADDED):
        more = _button('Add it to the history', f'{place}/history')
    title = 'Correction' if job.kind == PROGRAM else 'Verdict'
    out: list[Child] = [
        section(title, note, more, sheet, id_='result'),
        section('Files', tag('ul', *links), id_='files'),
    ]
    if job.kind != PROGRAM:
        way = tag('a', 'Correct a program by it', href=f'/program?of={job.key}')
        out.append(section('A program', tag('p', way), id_='program'))
    return (*out, _ask_again(job), _button('Delete it', f'{place}/delete'))


def _question(job: Job, reported: Mapping[str, Any]) -> tuple[Child, ...]:
    """Return what is wrong with data or set-up, and ask whether to correct it."""
    wrong = [
        joined
        for each in reported.get('unsound') or []
        for joined in (
            _said(str(each['sentence'])),
            tag('p', sentence(str(each.get('remedy') or '')), class_='note'),
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
        **asked.told,
        'robot': asked.robot,
        'cell': asked.cell,
        'at': asked.at,
        **other,
    }
    return [tag('input', type='hidden', name_=name, value=value) for name, value in fields.items()]


def _ask_again(job: Job) -> Html:
    """Return the questions once more, for the same files."""
    asked = job.asked
    if job.kind == PROGRAM:
        own = [(asked.robot, asked.robot)] if asked.robot not in robot_names() else []
        more: list[Child] = [tag('div', *_fields(HOW, asked.told), class_='fields')]
    else:
        own = [(n, n) for n in job.names if n == asked.robot]
        more = [tag('div', *_fields(FIRST, asked.told), class_='fields'), _details(asked)]
    robots = [*own, *((n, n) for n in robot_names())]
    robots = robots if asked.robot else [('', 'choose'), *robots]
    form = tag(
        'form',
        tag('div', _choice('robot', 'Robot', robots, asked.robot), class_='fields'),
        *more,
        tag('button', 'Try again', type='submit', class_='main'),
        action=f'/recordings/{job.key}/again',
        method='post',
        enctype='multipart/form-data',
    )
    if job.state == DONE:
        what = tag('details', tag('summary', 'Ask in another way'), form)
        return section('Another question', what, id_='again')
    return section('Answer, and try again', form, id_='again')


def program_page(jobs: Sequence[Job], of: str, site: Site, said: str = '') -> str:
    """
    Return the page on which a program is dropped.

    Parameters
    ----------
    jobs : sequence of Job
        Of the user; a program may be corrected by any that has a diagnosis.
    of : str
        Key of the one that is chosen first.
    said : str
        Why it was refused before.

    """
    models = _models(jobs)
    robots = [('', "the diagnosis', or the file dropped"), *((n, n) for n in robot_names())]
    form = tag(
        'form',
        tag(
            'label',
            'Program',
            _small('as the controller has it (.src with its .dat, .mod, .ls, .jbi, .script, ...)'),
            for_='files',
        ),
        tag('input', type='file', name_='files', multiple='', id='files'),
        _choice('of', 'Diagnosis', models, of if of in dict(models) else ''),
        tag(
            'details',
            tag('summary', 'A diagnosis of elsewhere'),
            tag(
                'label',
                'Its files',
                _small('diagnosis.json, and the file of the robot if it is none of the list'),
                for_='model',
            ),
            tag('input', type='file', name_='model', multiple='', id='model', class_='folder'),
            _choice('robot', 'Robot', robots, ''),
        ),
        tag(
            'details',
            tag('summary', 'Tools, bases, limits'),
            tag('div', *_fields(HOW, {}), class_='fields'),
        ),
        tag('button', 'Correct', type='submit', class_='main'),
        action='/program',
        method='post',
        enctype='multipart/form-data',
    )
    lead = 'Its points are moved so that the real tool goes where the program means it.'
    body = section('Correct a program', form, id_='drop', lead=lead)
    return page('correct a program', _said(said, CORRECT), body, site=site)


def _models(jobs: Sequence[Job]) -> list[tuple[str, str]]:
    """Return what a program may be corrected by."""
    done = [job for job in jobs if job.state == DONE and job.kind != PROGRAM]
    return [
        ('', 'none of these: I drop a diagnosis below'),
        *(
            (job.key, f'{", ".join(job.names[:2])}, {job.asked.robot}, {_when(job)}')
            for job in done
        ),
    ]


def _when(job: Job) -> str:
    return strftime('%Y-%m-%d %H:%M', localtime(job.since))


def me_page(key: str, site: Site, said: str = '') -> str:
    """Return the page of a user's key: take it elsewhere, log out, delete everything."""
    shown = section(
        'My key',
        tag(
            'p',
            'This browser keeps it for a year from your last visit. Whoever has it sees and deletes '
            'what is yours: keep it as a password.',
        ),
        tag('p', tag('code', key, id='own')),
        id_='mine',
    )
    enter = tag(
        'form',
        _field('key', 'I have a key', 'of another browser; what this one has stays under its own'),
        tag('button', 'Go on with it', type='submit', class_='main'),
        action='/me',
        method='post',
        enctype='multipart/form-data',
    )
    leave = section(
        'Log out',
        tag(
            'p', 'The recordings stay here; only your key leads to them again. Note it down first.'
        ),
        _button('Log out', '/me/leave'),
        id_='leave',
    )
    sure = tag('input', type='checkbox', name_='sure', value='yes', id='sure')
    delete = tag(
        'form',
        tag('label', sure, ' all my recordings, programs and my history; it cannot be undone'),
        tag('button', 'Delete all that is mine', type='submit'),
        action='/me/delete',
        method='post',
        enctype='multipart/form-data',
    )
    gone = section('Delete', delete, id_='delete')
    elsewhere = section('On another browser', enter, id_='enter')
    return page('my key', _said(said), shown, elsewhere, leave, gone, site=site)


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
