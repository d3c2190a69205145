# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Every command tells what it does on one screen, with an example; what few need, when asked."""

import os
import re
import shlex
import subprocess
import sys

import pytest
from command_line import done, refused, weld_twin

from weld_twin_nodes.cli.main import OLD, parser_of, renamed

SCREEN = 40
"""Lines of a terminal, 80 columns wide, that nobody has to scroll."""


@pytest.fixture
def help_of(monkeypatch):
    monkeypatch.setenv('COLUMNS', '80')
    return done


def listed(text, title):
    """Return the names that a help lists under a title."""
    rows = text.partition(f'\n{title}:\n')[2].partition('\n\n')[0].splitlines()
    return [row.split()[0] for row in rows if row[:2].isspace() and row[2:3].strip()]


def commands(help_of):
    """Return every command, and every job of those that have jobs."""
    names = [(name,) for name in listed(help_of('--help'), 'commands') if name != 'lab']
    jobs = [(*name, job) for name in names for job in listed(help_of(*name, '--help'), 'jobs')]
    return [*names, *jobs]


def test_a_person_chooses_from_about_a_dozen(help_of):
    text = help_of('--help')
    names = listed(text, 'commands')
    assert names[0] == 'diagnose' and names[-1] == 'lab'
    assert len(names) <= 14
    assert not set(names) & set(OLD)
    assert len(text.splitlines()) <= 24


def test_each_help_is_one_screen_with_an_example_that_can_be_typed(help_of):
    for words in commands(help_of):
        text = help_of(*words, '--help')
        assert text.startswith(f'usage: weld-twin {" ".join(words)} ')
        assert len(text.splitlines()) <= SCREEN, words
        example = re.search(r'^example: weld-twin (.+)$', text, re.M)
        assert example, words
        typed = renamed(shlex.split(example[1]))
        assert tuple(typed[: len(words)]) == words, example[0]
        parser_of(typed).parse_args(typed)


def test_what_few_need_is_shown_when_asked(help_of):
    for words in commands(help_of):
        short, whole = help_of(*words, '--help'), help_of(*words, '--help-all')
        found = re.search(r'^--help-all shows (\d+) options more\.$', short, re.M)
        few, all_of_them = (set(re.findall(r'^  (--[a-z-]+)', t, re.M)) for t in (short, whole))
        assert few <= all_of_them, words
        assert len(all_of_them - few) == (int(found[1]) if found else 0), words
    rare = help_of('diagnose', '--help-all')
    assert '--joint-topic' in rare and '--joint-topic' not in help_of('diagnose', '--help')


def typed_of_old(place):
    """Return what was typed after old spellings, with all results in a folder."""
    robot = ('--robot', 'ur5')
    (place / 'none.yaml').write_text('[]\n')
    seam = (*robot, '--rate', 10, '--out', place / 'seam')
    done('simulate', *seam)
    model = (*robot, '--model', place / 'none.yaml')
    program = (*robot, '--controller', 'urscript', '--out', place / 'a.script')
    limits = ('--tolerance', 0.5, '--postures', 24, '--out', place / 'plan')
    return {
        'info': (place / 'seam',),
        'predict': (place / 'seam', *model, '--out', place / 'twin'),
        'compensate': (place / 'seam', *model, '--out', place / 'better'),
        'schema': ('robot', '--out', place / 'robot.json'),
        'export-program': ('line', *program),
        'correct-program': (place / 'a.script', *robot, '--out', place / 'same'),
        'plan-measurement': (*robot, *limits),
        'recover': (place / 'seam', '--out', place / 'whole'),
        'policy': ('--out', place / 'policy.xml'),
    }


MADE = ['twin', 'better', 'robot.json', 'a.script', 'same/a.script', 'plan/stations.yaml']
MADE += ['whole', 'policy.xml']


def test_an_old_spelling_does_what_the_new_one_does_and_says_it_once(tmp_path):
    said = {}
    for kind in ('old', 'new'):
        place = tmp_path / kind
        place.mkdir()
        for name, words in typed_of_old(place).items():
            spelt = [name] if kind == 'old' else OLD[name].split()
            said[kind, name] = told = weld_twin(*spelt, *words)
            assert told.code == 0, (name, told.err)
        assert [name for name in MADE if not (place / name).exists()] == []
    for name in typed_of_old(tmp_path):
        old, new = said['old', name], said['new', name]
        assert old.out.replace(f'{tmp_path}/old', f'{tmp_path}/new') == new.out
        sentence = (
            f"weld-twin: '{name}' is 'weld-twin {OLD[name]}' now; the old name goes with the "
        )
        assert old.err.splitlines()[-1] == f'{sentence}next release'
        assert old.err.count('the old name goes') == 1 and 'old name' not in new.err


@pytest.mark.parametrize('name', sorted(OLD))
def test_every_old_spelling_leads_to_a_command_that_there_is(name):
    usage = done(name, '--help')
    assert usage.startswith(f'usage: weld-twin {OLD[name]} ')


def test_an_option_of_the_other_kind_is_refused_in_one_sentence(tmp_path):
    robot = ('--robot', 'ur5', '--out', tmp_path / 'out')
    wrong = {
        ('simulate', tmp_path, '--model', 'm.json', '--seed', 0): '--seed is of a seam',
        ('simulate', '--temperature', 30): '--temperature is of a recording; give a BAG',
        ('simulate', tmp_path): 'say with --model which effects',
        ('correct', tmp_path, '--model', 'm.json', '--start', '0'): '--start is of a program',
        ('correct', 'a.script', '--joint-topic', '/j'): '--joint-topic is of a bag',
        ('correct', tmp_path): 'say with --model by which effects',
        ('investigate', tmp_path, '--postures', 30): '--postures is of a plan',
        ('investigate', tmp_path, 'bag', '--tolerance', 1): 'a plan comes before the first',
    }
    for words, sentence in wrong.items():
        said = refused(*words, *robot)
        assert sentence in said, said


@pytest.mark.parametrize(('given', 'threads'), [({}, '1'), ({'OPENBLAS_NUM_THREADS': '2'}, '2')])
def test_linear_algebra_stays_on_one_core_unless_told_otherwise(given, threads):
    program = (
        'import os, sys\n'
        'from weld_twin_nodes.cli.main import main\n'
        "sys.argv = ['weld-twin', 'export', 'schema', 'robot']\n"
        'main()\n'
        "print(os.environ['OPENBLAS_NUM_THREADS'])\n"
    )
    bare = {name: value for name, value in os.environ.items() if not name.endswith('NUM_THREADS')}
    run = subprocess.run(
        [sys.executable, '-c', program], env={**bare, **given}, capture_output=True, text=True
    )
    assert run.stdout.splitlines()[-1] == threads, run.stderr
