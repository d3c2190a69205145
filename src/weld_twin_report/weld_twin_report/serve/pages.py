# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The pages of the server, made there; none needs a script."""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.resources import files
from time import localtime, strftime
from typing import Any, NamedTuple
from urllib.parse import quote

from weld_twin_msgs_py.robots import robot_names

from ..report.html import Child, Html, columns, document, section, table, tag
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
MORE = ('tolerance', 'region', 'uncertainty', 'controller', 'length_unit', 'angle_unit')
COUNTING = ('joint_signs', 'joint_offsets', 'coupled', 'base_link', 'tip_link', 'flange_link')
"""How the controller counts its joints, and which chain of a URDF is the arm."""
HOW = tuple(name for name, each in FIELDS.items() if CORRECT in each.commands)
"""Fields of a program."""


@cache
def _style() -> str:
    return (files(__package__) / 'serve.css').read_text(encoding='utf-8')


class Site(NamedTuple):
    """What this server has besides recordings."""

    plant: bool = False  # a history that everybody reads
    live: bool = False  # the verdict of running nodes

    def ways(self) -> Html:
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
    name = tag('p.kind', tag('b', 'weld_twin'), ' · ', title)
    head = tag('header', name, site.ways())
    return document(title, again, tag('main', head, *body), allowed=ALLOWED, style=_style())


def start_page(site: Site, said: str = '') -> str:
    robots = [('', 'choose, or drop its file'), *((n, n) for n in robot_names())]
    hint = (
        'Drop it here: a table (.csv), or a bag (.mcap, or all its files). The file of your own '
        'robot (.urdf, .yaml) goes with it.'
    )
    form = _form(
        '/recordings',
        tag('label', 'Recording', tag('small', hint)),
        tag('input#files', type='file', name_='files', multiple='', aria_label='Recording'),
        _label('folder', 'Or a folder', 'of a bag, with its metadata.yaml'),
        tag('input#folder.folder', type='file', name_='files', webkitdirectory=''),
        tag('div.fields', _choice('robot', 'Robot', robots, ''), *_fields(FIRST, {})),
        _details(Asked('')),
        _submit('Diagnose'),
    )
    lead = 'Joint angles and measured positions of one robot, recorded together.'
    body = section('Where does the real robot differ?', form, id_='drop', lead=lead)
    return page('new recording', _said(said), body, site=site)


def _form(place: str, *children: Child, kind: str = 'form') -> Html:
    return tag(kind, *children, action=place, method='post', enctype='multipart/form-data')


def _submit(text: str) -> Html:
    return tag('button.main', text, type='submit')


def _button(text: str, place: str) -> Html:
    return _form(place, tag('button', text, type='submit'), kind='form.small')


def _details(asked: Asked) -> Html:
    """Return the fields that most people leave alone."""
    hint = 'such as 2026-03-31T14:05 (UTC unless it says +02:00); empty: as its stamps say'
    return _folded(
        'Tolerance, controller, signs; table units, and history',
        *_fields(MORE, asked.told),
        _field('cell', 'Cell', 'its name, to keep the result in its history', asked.cell),
        _field('at', 'Recorded', hint, asked.at),
        *_fields(COUNTING, asked.told),
    )


def _folded(title: str, *fields: Html) -> Html:
    return tag('details', tag('summary', title), tag('div.fields', *fields))


def _label(name: str, title: str, hint: str) -> Html:
    return tag('label', title, tag('small', hint), for_=name)


def _choice(name: str, title: str, choices: Sequence[tuple[str, str]], chosen: str) -> Html:
    options = [
        tag('option', text, value=value, selected='' if value == chosen else None)
        for value, text in choices
    ]
    return tag('div', tag('label', title, for_=name), tag('select', *options, name_=name, id=name))


def _field(name: str, title: str, hint: str, value: str = '') -> Html:
    entry = tag(f'input#{name}', name_=name, value=value or None, maxlength=80, autocomplete='off')
    return tag('div', _label(name, title, hint), entry)


def _fields(names: Sequence[str], values: Mapping[str, str]) -> list[Html]:
    """Return fields of the table, filled with what was given before."""
    out = []
    for name in names:
        field, value = FIELDS[name], values.get(name, '')
        if field.choices:
            out.append(_choice(name, field.title, field.choices, value))
        elif field.lines:
            entry = tag(f'textarea#{name}', value, name_=name, rows='2')
            out.append(tag('div', _label(name, field.title, field.hint), entry))
        else:
            out.append(_field(name, field.title, field.hint, value))
    return out


def _said(text: str, command: str = '') -> Html | None:
    return tag('p.said', sentence(text, command), role='alert') if text else None


def recordings_page(jobs: Sequence[Job], site: Site) -> str:
    shown: dict[str, Callable[[Job], Child]] = {
        'dropped': lambda job: tag('a.date', _when(job), href=f'/recordings/{job.key}'),
        'files': lambda job: ', '.join(job.names[:2]) + ' ...' * (len(job.names) > 2),
        'state': lambda job: job.state,
        'said': lambda job: sentence(job.said, job.command),
        '': lambda job: _button('Delete', f'/recordings/{job.key}/delete'),
    }
    body = columns(jobs, shown) if jobs else tag('p', 'None yet.')
    again = LOOK if any(job.state in OPEN for job in jobs) else None
    mine = section('My recordings', body, id_='mine')
    return page('my recordings', mine, site=site, refresh=again)


def job_page(
    job: Job, ahead: int, diagnosis: Mapping[str, Any] | None, files: Sequence[str], site: Site
) -> str:
    """Return the page of a recording or program: its place, its progress, its question or its sheet."""
    if job.state in OPEN:
        return page('in work', _progress(job, ahead), refresh=REFRESH, site=site)
    if job.state == DONE:
        return page('verdict', *_result(job, files), site=site)
    if job.state == UNSOUND:
        return page('unsound', *_question(job, diagnosis or {}), site=site)
    what = 'It could not be corrected' if job.kind == PROGRAM else 'It could not be diagnosed'
    what = 'One question first' if job.said == NO_ROBOT else what
    why = section(what, _said(job.said, job.command), id_='refused')
    return page(job.state, why, _ask_again(job), site=site)


def _progress(job: Job, ahead: int) -> Html:
    if job.state == RUNNING:
        text = f'In work: {job.said or "starting"}.'
    else:
        text = f'Waiting: {ahead} before it.' if ahead else 'Waiting: it is next.'
    names = tag('p.note', ', '.join(job.names))
    status = tag('p#progress.second', text, role='status')
    return section('Your recording', status, names, id_='work')


def _result(job: Job, files: Sequence[str]) -> tuple[Child, ...]:
    """Return the sheet, and what may be fetched."""
    place = f'/recordings/{job.key}'
    known = dict(PROGRAM_FILES if job.kind == PROGRAM else FILES)
    links = [
        tag(
            'a',
            known.get(name, f'the corrected program, {name}'),
            href=f'{place}/{quote(name)}',
            download=None if name.endswith('.html') else name,
        )
        for name in files
    ]
    sheet = tag('iframe', src=f'{place}/report.html', title='the sheet', sandbox='allow-scripts')
    said = f'{sentence(job.said)}. ' if job.said else ''
    alone = tag('a', 'Open the sheet alone', href=f'{place}/report.html')
    note = tag('p.note', alone, f', to print it. {said}It took {job.seconds:.0f} s.')
    more = None
    if job.said.startswith(NOT_ADDED):
        more = _button('Add it to the history', f'{place}/history')
    title = 'Correction' if job.kind == PROGRAM else 'Verdict'
    out: list[Child] = [
        section(title, note, more, sheet, id_='result'),
        section('Files', tag('ul', *(tag('li', link) for link in links)), id_='files'),
    ]
    if job.kind != PROGRAM:
        way = tag('a', 'Correct a program by it', href=f'/program?of={job.key}')
        out.append(section('A program', tag('p', way), id_='program'))
    return (*out, _ask_again(job), _button('Delete it', f'{place}/delete'))


def _question(job: Job, diagnosis: Mapping[str, Any]) -> tuple[Child, ...]:
    """Return what is wrong with data or set-up, and ask whether to correct it."""
    wrong = [
        joined
        for each in diagnosis.get('unsound') or []
        for joined in (
            _said(str(each['sentence'])),
            tag('p.note', sentence(str(each.get('remedy') or ''))),
        )
    ]
    answers = {
        **job.asked.told,
        'robot': job.asked.robot,
        'cell': job.asked.cell,
        'at': job.asked.at,
    }
    mend = _form(
        f'/recordings/{job.key}/again',
        *(
            tag('input', type='hidden', name_=n, value=v)
            for n, v in (answers | {'apply': 'yes'}).items()
        ),
        _submit('Correct it and go on'),
    )
    sheet = tag('p', tag('a', 'Read the sheet', href=f'/recordings/{job.key}/report.html'))
    body = section('Data or set-up are wrong', *wrong, mend, sheet, id_='question')
    return body, _ask_again(job)


def _ask_again(job: Job) -> Html:
    """Return the questions once more, for the same files."""
    asked = job.asked
    if job.kind == PROGRAM:
        own = [(asked.robot, asked.robot)] if asked.robot not in robot_names() else []
        more: list[Child] = [tag('div.fields', *_fields(HOW, asked.told))]
    else:
        own = [(n, n) for n in job.names if n == asked.robot]
        more = [tag('div.fields', *_fields(FIRST, asked.told)), _details(asked)]
    robots = [*own, *((n, n) for n in robot_names())]
    robots = robots if asked.robot else [('', 'choose'), *robots]
    form = _form(
        f'/recordings/{job.key}/again',
        tag('div.fields', _choice('robot', 'Robot', robots, asked.robot)),
        *more,
        _submit('Try again'),
    )
    if job.state == DONE:
        what = tag('details', tag('summary', 'Ask in another way'), form)
        return section('Another question', what, id_='again')
    return section('Answer, and try again', form, id_='again')


def program_page(jobs: Sequence[Job], of: str, site: Site, said: str = '') -> str:
    """
    Return the page on which a program is dropped, and what was said when it was refused.

    Any of the user's jobs that has a diagnosis may correct it; ``of`` is the one chosen first.
    """
    done = [job for job in jobs if job.state == DONE and job.kind != PROGRAM]
    models = [
        ('', 'none of these: I drop a diagnosis below'),
        *(
            (job.key, f'{", ".join(job.names[:2])}, {job.asked.robot}, {_when(job)}')
            for job in done
        ),
    ]
    robots = [('', "the diagnosis', or the file dropped"), *((n, n) for n in robot_names())]
    hint = 'as the controller has it (.src with its .dat, .mod, .ls, .jbi, .script, ...)'
    with_it = 'diagnosis.json, and the file of the robot if it is none of the list'
    form = _form(
        '/program',
        _label('files', 'Program', hint),
        tag('input#files', type='file', name_='files', multiple=''),
        _choice('of', 'Diagnosis', models, of if of in dict(models) else ''),
        tag(
            'details',
            tag('summary', 'A diagnosis of elsewhere'),
            _label('model', 'Its files', with_it),
            tag('input#model.folder', type='file', name_='model', multiple=''),
            _choice('robot', 'Robot', robots, ''),
        ),
        _folded('Tools, bases, limits', *_fields(HOW, {})),
        _submit('Correct'),
    )
    lead = 'Its points are moved so that the real tool goes where the program means it.'
    body = section('Correct a program', form, id_='drop', lead=lead)
    return page('correct a program', _said(said, CORRECT), body, site=site)


def _when(job: Job) -> str:
    return strftime('%Y-%m-%d %H:%M', localtime(job.since))


def me_page(key: str, site: Site, said: str = '') -> str:
    """Return the page of a user's key: take it elsewhere, log out, delete everything."""
    keep = (
        'This browser keeps it for a year from your last visit. Whoever has it sees and deletes '
        'what is yours: keep it as a password.'
    )
    other = 'of another browser; what this one has stays under its own'
    note = 'The recordings stay here; only your key leads to them again. Note it down first.'
    sure = tag('input#sure', type='checkbox', name_='sure', value='yes')
    enter = _form('/me', _field('key', 'I have a key', other), _submit('Go on with it'))
    delete = _form(
        '/me/delete',
        tag('label', sure, ' all my recordings, programs and my history; it cannot be undone'),
        tag('button', 'Delete all that is mine', type='submit'),
    )
    parts = (
        section('My key', tag('p', keep), tag('p', tag('code#own', key)), id_='mine'),
        section('On another browser', enter, id_='enter'),
        section('Log out', tag('p', note), _button('Log out', '/me/leave'), id_='leave'),
        section('Delete', delete, id_='delete'),
    )
    return page('my key', _said(said), *parts, site=site)


def message_page(title: str, text: str, site: Site) -> str:
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
