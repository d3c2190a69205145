# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What commands do to folders in which a person has put, or changed, something."""

import json
import os
import shutil
import signal
import subprocess
import sys
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

import pytest
from command_line import done, refused

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.whole_files import write_text
from weld_twin_nodes.offline.environment import environment
from weld_twin_nodes.offline.output_directory import new_directory, write_owned

LIST = '.weld_twin_files.json'
PROGRAM = 'PTP {A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}\nPTP {A1 10,A2 -80,A3 80,A4 0,A5 5,A6 0}\n'


def content(folder):
    """Return everything below a folder but the list of our files, by name; links as such."""
    return {
        path.relative_to(folder).as_posix(): (
            os.readlink(path) if path.is_symlink() else path.read_bytes()
        )
        for path in sorted(folder.rglob('*'))
        if path.name != LIST and (path.is_symlink() or path.is_file())
    }


def make(folder, mark='result.json', **texts):
    """Make a result of the files named."""
    with new_directory(folder, mark=mark) as place:
        for name, text in {mark: '{}', **texts}.items():
            write_text(place / name, text)


@pytest.fixture
def program(tmp_path):
    path = tmp_path / 'bracket.src'
    path.write_text(f'DEF bracket()\n{PROGRAM}END\n')
    return path


def correct(program, out, *more, run=done):
    """Write a program back: the quickest command that writes a folder."""
    return run('correct', program, '--robot', 'kuka_kr6_r900', '--out', out, *more)


def test_a_web_site_is_not_taken_for_pages_of_a_fleet(tmp_path, elbow_found):
    pytest.importorskip('sqlalchemy', reason='the history is an extra')
    site, history = tmp_path / 'site', tmp_path / 'fleet.db'
    done('history', 'add', elbow_found, '--cell', 'a', '--at', '2026-03-02', '--db', history)
    site.mkdir()
    (site / 'index.html').write_text('<h1>Welders of Ghent</h1>')
    (site / 'style.css').write_text('h1 {}')
    before = content(site)
    said = refused('history', 'page', '--db', history, '--out', site)
    assert 'no list says that weld-twin wrote it' in said
    assert content(site) == before
    done('history', 'page', '--db', history, '--out', site, '--force')
    assert (site / 'index.kept-1.html').read_text() == before['index.html'].decode()
    assert (site / 'style.css').read_bytes() == before['style.css']


def test_a_second_run_replaces_what_is_ours_and_removes_what_is_not_made_again(tmp_path):
    out = tmp_path / 'out'
    make(out, **{'a.txt': '1', 'b.txt': '1'})
    (out / 'notes.txt').write_text('torch changed on Monday')
    inode = out.stat().st_ino
    make(out, **{'a.txt': '2', 'c.txt': '2'})
    assert content(out) == {
        'a.txt': b'2', 'c.txt': b'2', 'result.json': b'{}', 'notes.txt': b'torch changed on Monday'
    }  # fmt: skip
    assert out.stat().st_ino == inode  # a shell that stands in it still does


def test_a_folder_of_an_earlier_version_has_no_list_so_nothing_in_it_is_replaced(
    program, tmp_path
):
    out = tmp_path / 'better'
    correct(program, out)
    (out / LIST).unlink()
    (out / 'bracket.src').write_text('; my own\n')
    said = correct(program, out, run=refused)
    assert 'no list says that weld-twin wrote it' in said
    assert "--force, which keeps it as 'correction.kept-1.json'" in said
    correct(program, out, '--force')
    assert (out / 'bracket.kept-1.src').read_text() == '; my own\n'
    assert not (out / 'correction.kept-1.json').exists()  # it is the same as before
    assert (out / 'bracket.src').read_bytes() == program.read_bytes()


@pytest.mark.parametrize(('size', 'ours'), [(49_000_000, True), (51_000_000, False)])
def test_a_list_of_more_than_50_megabytes_is_none(tmp_path, size, ours):
    out = tmp_path / 'out'
    make(out, **{'a.txt': '1'})
    with open(out / LIST, 'a') as file:
        file.write(' ' * size)
    with suppress(DataError):
        make(out, **{'a.txt': '2'})
    assert (out / 'a.txt').read_text() == ('2' if ours else '1')


def test_links_are_followed_and_never_replaced(program, tmp_path):
    real, link, ahead = tmp_path / 'disk/here', tmp_path / 'better', tmp_path / 'later'
    real.mkdir(parents=True)
    (real / 'notes.txt').write_text('mine')
    link.symlink_to(real)
    ahead.symlink_to(tmp_path / 'disk/there')
    correct(program, link, '--force')
    correct(program, ahead)
    assert link.is_symlink() and ahead.is_symlink()
    assert set(content(real)) == {'notes.txt', 'bracket.src', 'correction.json'}
    assert set(content(tmp_path / 'disk/there')) == {'bracket.src', 'correction.json'}
    # A link inside is a person's, too.
    (real / 'bracket.src').rename(tmp_path / 'controller.src')
    (real / 'bracket.src').symlink_to(tmp_path / 'controller.src')
    correct(program, link, run=refused)
    correct(program, link, '--force')
    assert (real / 'bracket.kept-1.src').is_symlink()
    assert (tmp_path / 'controller.src').read_bytes() == program.read_bytes()


def test_a_bag_and_a_file_go_where_a_link_leads(tmp_path):
    for name in ('bag', 'schema.json'):
        (tmp_path / name).symlink_to(tmp_path / f'disk/{name}')
    words = ('simulate', '--robot', 'ur5', '--path', 'line', '--profile', 'smooth', '--rate', 10)
    done(*words, '--out', tmp_path / 'bag')
    done('export', 'schema', 'robot', '--out', tmp_path / 'schema.json')
    assert (tmp_path / 'bag').is_symlink() and (tmp_path / 'schema.json').is_symlink()
    assert (tmp_path / 'disk/bag/metadata.yaml').is_file()
    assert json.loads((tmp_path / 'disk/schema.json').read_text())
    before = content(tmp_path / 'disk')
    refused(*words, '--out', tmp_path / 'bag')
    (tmp_path / 'disk/schema.json').write_text('changed')
    before['schema.json'] = b'changed'
    refused('export', 'schema', 'robot', '--out', tmp_path / 'schema.json')
    assert content(tmp_path / 'disk') == before


def test_a_prediction_whose_table_is_in_the_way_leaves_no_bag(tmp_path):
    bag, table = Path(__file__).parents[4] / 'bags/elbow_play', tmp_path / 'poses.csv'
    table.write_text('mine')
    words = ('simulate', bag, '--robot', 'ur5', '--model', f'{bag}.yaml', '--table', table)
    refused(*words, '--out', tmp_path / 'predicted')
    assert content(tmp_path) == {'poses.csv': b'mine'}


def test_where_folders_of_ours_should_be_a_persons_file_is_kept(tmp_path):
    out = tmp_path / 'out'
    make(out)
    (out / 'figures').write_text('a list of figures')
    (out / 'page.html').mkdir()
    (out / 'page.html/draft.txt').write_text('mine')
    with new_directory(out, mark='result.json', force=True) as place:
        write_text(place / 'figures/1.svg', '<svg/>')
        write_text(place / 'page.html', '<p/>')
        write_text(place / 'result.json', '{}')
    assert content(out) == {
        'figures.kept-1': b'a list of figures',
        'figures/1.svg': b'<svg/>',
        'page.kept-1.html/draft.txt': b'mine',
        'page.html': b'<p/>',
        'result.json': b'{}',
    }


def test_what_a_person_saves_while_the_command_runs_is_not_lost(tmp_path, capsys):
    out = tmp_path / 'out'
    make(out, **{'a.txt': '1'})
    with new_directory(out, mark='result.json', force=True) as place:
        write_text(place / 'a.txt', '2')
        write_text(place / 'result.json', '{}')
        (out / 'a.txt').write_text('mine')
    assert (out / 'a.txt').read_text() == '2' and (out / 'a.kept-1.txt').read_text() == 'mine'
    said = "weld-twin: 'a.txt' was not overwritten and is kept as 'a.kept-1.txt'\n"
    assert capsys.readouterr().err == said


def test_a_folder_of_a_persons_is_not_taken_for_ours_because_one_file_in_it_is(program, tmp_path):
    (tmp_path / 'thesis.tex').write_text('years of work')
    done('export', 'schema', 'robot', '--out', tmp_path / 'robot.json')
    said = correct(program, tmp_path, run=refused)
    assert 'holds something else already' in said
    correct(program, tmp_path, '--force')
    correct(program, tmp_path)
    assert (tmp_path / 'thesis.tex').read_text() == 'years of work'


def test_two_runs_at_once_into_one_folder_leave_the_whole_result_of_the_last(tmp_path):
    for out in (tmp_path / 'new', tmp_path / 'there'):
        if out.name == 'there':
            make(out, **{'a.txt': '0', 'b.txt': '0'})
        with new_directory(out, mark='result.json') as first:
            make(out, **{'a.txt': '1'})
            for name in ('a.txt', 'c.txt', 'result.json'):
                write_text(first / name, '2')
        assert content(out) == {'a.txt': b'2', 'c.txt': b'2', 'result.json': b'2'}
        make(out)
    assert {path.name for path in tmp_path.iterdir()} == {'new', 'there'}


def test_two_results_in_one_folder_do_not_take_each_others_files(program, tmp_path):
    out = tmp_path / 'monday'
    correct(program, out)
    make(out, **{'more.txt': '1'})
    correct(program, out)
    assert set(content(out)) == {'bracket.src', 'correction.json', 'result.json', 'more.txt'}
    write_owned(out / 'more.txt', 'of a third')
    assert (out / 'more.kept-1.txt').read_text() == '1'


KILLS = """
import os, signal, sys
from pathlib import Path
from weld_twin_msgs_py.files.whole_files import write_text
from weld_twin_nodes.offline.output_directory import new_directory

OPERATIONS = ('open', 'os.rename', 'os.remove', 'os.mkdir', 'os.rmdir', 'fcntl.flock')
out, kill_at = Path(sys.argv[1]), int(sys.argv[2])
left = kill_at
def hook(event, args):
    global left
    if event in OPERATIONS:
        left -= 1
        if left == 0:
            os.kill(os.getpid(), signal.SIGKILL)
sys.addaudithook(hook)
with new_directory(out, mark='result.json', force=True) as place:
    for name in ('a.txt', 'deep/b.txt', 'deep/d.txt', 'result.json'):
        write_text(place / name, '2' * 100_000)
"""
"""Writes a result and is killed at one of its operations on files; 0 for none."""


def killed_at(operation, out):
    """Run that in a fork, which has everything loaded; return whether it was killed."""
    child = os.fork()
    if child == 0:
        sys.argv = ['', str(out), str(operation)]
        try:
            exec(KILLS, {})
            os._exit(0)
        finally:
            os._exit(1)
    ended = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    assert ended in (0, -signal.SIGKILL)
    return ended != 0


@pytest.mark.parametrize('there', [False, True])
def test_a_kill_at_any_operation_leaves_whole_files_and_the_next_run_ends_it(tmp_path, there):
    old, new = b'1' * 100_000, b'2' * 100_000
    kills = 0
    for operation in range(1, 1000, 3):
        out = tmp_path / f'{operation}' / 'out'
        ours = {'a.txt': old, 'deep/b.txt': old, 'deep/c.txt': old, 'result.json': old}
        if there:
            make(out, **{name: text.decode() for name, text in ours.items()})
            (out / 'notes.txt').write_text('mine')
            (out / 'a.txt').write_text('changed')
        if not killed_at(operation, out):
            break
        kills += 1
        seen = {k: v for k, v in content(out).items() if '.weld_twin-' not in k}
        if not there:
            assert not seen or (set(seen.values()) == {new} and len(seen) == 4)
        else:
            assert seen.pop('notes.txt') == b'mine'
            assert b'changed' in (seen.pop('a.txt', b''), seen.get('a.kept-1.txt', b''))
            assert set(seen.values()) <= {old, new, b'changed'}
            if seen.get('result.json') == new:  # it is the last to come
                assert seen['deep/b.txt'] == new
        assert not killed_at(0, out)
        expected = {'a.txt': new, 'deep/b.txt': new, 'deep/d.txt': new, 'result.json': new}
        if there:
            expected |= {'notes.txt': b'mine', 'a.kept-1.txt': b'changed'}
        assert content(out) == expected
        assert [path.name for path in out.parent.iterdir()] == ['out']
    assert kills > 10


def test_scratch_of_a_killed_run_is_swept_and_that_of_a_running_one_is_not(tmp_path):
    code = (
        'import sys, time\n'
        'from weld_twin_msgs_py.bags import BagWriter\n'
        'from weld_twin_nodes.offline.output_directory import new_directory\n'
        'with new_directory(sys.argv[1], mark="m"), BagWriter(sys.argv[2]):\n'
        '    print("here", flush=True)\n'
        '    time.sleep(60.0)\n'
    )
    names = [tmp_path / 'found', tmp_path / 'bag']
    mine = tmp_path / '.found-20261123'  # a name like those that are drawn
    mine.mkdir()
    (mine / 'letter.txt').write_text('mine')
    running = subprocess.Popen(
        [sys.executable, '-c', code, *map(str, names)], stdout=subprocess.PIPE
    )
    try:
        assert running.stdout.readline() == b'here\n'
        there = {path.name for path in tmp_path.iterdir()}
        assert len(there) == 3
        make(names[0])
        assert there < {path.name for path in tmp_path.iterdir()}  # it is still at work
    finally:
        running.kill()
        running.wait()
        running.stdout.close()
    make(names[0])
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {mine.name, 'found'} | {name for name in left if name.startswith('.bag-')}
    from weld_twin_msgs_py.bags import BagWriter

    BagWriter(names[1]).open().discard()
    assert {path.name for path in tmp_path.iterdir()} == {mine.name, 'found'}
    assert (mine / 'letter.txt').read_text() == 'mine'


def test_a_text_whose_writer_was_killed_leaves_nothing_beside_it(tmp_path):
    (tmp_path / '.a.json.writing').write_text('half of')
    write_text(tmp_path / 'a.json', 'whole')
    assert content(tmp_path) == {'a.json': b'whole'}


def test_what_cannot_be_written_is_told_by_the_place_that_was_given(tmp_path):
    with (
        pytest.raises(DataError, match=f"^'{tmp_path}/found/file/page.html' cannot be written: "),
        new_directory(tmp_path / 'found', mark='page.html') as hidden,
    ):
        (hidden / 'file').touch()
        write_text(hidden / 'file/page.html', '')
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_written_is_a_sentence(program, tmp_path):
    (tmp_path / 'file').write_text('mine')
    for out in (tmp_path / 'file', tmp_path / 'file/below'):
        correct(program, out, run=refused)
    assert (tmp_path / 'file').read_text() == 'mine'


@pytest.mark.parametrize('led', ['../mine.txt', '{folder}/mine.txt', 'link/mine.txt'])
@pytest.mark.parametrize('in_note', [False, True])
def test_a_folder_from_anybody_deletes_and_replaces_nothing_outside_itself(tmp_path, led, in_note):
    """A folder that came in an archive may hold a list, or a change of a killed run, made by hand."""
    mine, out = tmp_path / 'mine.txt', tmp_path / 'out'
    mine.write_text('mine')
    out.mkdir()
    os.symlink(tmp_path, out / 'link')
    name, digest = led.format(folder=tmp_path), sha256(b'mine').hexdigest()
    if in_note:
        scratch = out / '.weld_twin-abcdefgh'
        (scratch / 'made').mkdir(parents=True)
        (scratch / '.weld_twin_lock').touch()
        os.symlink(tmp_path, scratch / 'made/taken')
        place = {'taken/mine.txt': None} if led[0] == 'l' else {}
        note = {'mark': 'x', 'place': place, 'drop': {name: digest}, 'listed': {**place}}
        (scratch / 'change.json').write_text(json.dumps(note))
    else:
        told = {'schema': 'weld_twin/files/1', 'results': {'result.json': {name: digest}}}
        (out / LIST).write_text(json.dumps(told))

    with suppress(DataError):
        make(out)

    assert [path.read_text() for path in tmp_path.glob('mine*')] == ['mine']


RESULTS = '{"schema": "weld_twin/files/1", "results": {"result.json": %s}}'
DAMAGES = ['', '{', '[]', '{"schema": "weld_twin/files/9"}', '{"results', '[' * 100_000]
DAMAGES += [RESULTS % '{"": "a"}', RESULTS % '{"a\\u0000b": "a"}']


@pytest.mark.parametrize('text', [*DAMAGES, None])
def test_with_a_damaged_list_nothing_is_ours(tmp_path, text):
    make(tmp_path / 'out')
    (tmp_path / 'out/result.json').write_text('mine')
    (tmp_path / 'out' / LIST).unlink()
    if text is None:
        os.mkfifo(tmp_path / 'out' / LIST)  # whoever opens it waits for ever
    else:
        (tmp_path / 'out' / LIST).write_text(text)
    with pytest.raises(DataError, match=r'(?s)no list says|weld_twin_files.*--force'):
        make(tmp_path / 'out')
    assert content(tmp_path / 'out') == {'result.json': b'mine'}


@pytest.mark.parametrize('there', [False, True])
def test_a_result_whose_folder_is_deleted_meanwhile_is_not_told_as_written(tmp_path, there):
    out = tmp_path / 'out'
    if there:
        make(out)

    with (
        pytest.raises(DataError, match='was deleted while it was being written; run it again'),
        new_directory(out, mark='result.json') as place,
    ):
        write_text(place / 'data.csv', '1')
        shutil.rmtree(out if there else place.parent)
        write_text(place / 'result.json', '{}')

    assert not list(tmp_path.glob('*out*/*'))


def test_variables_of_the_environment_are_set_for_a_block_and_then_as_before(monkeypatch):
    monkeypatch.setenv('HAD', 'its own')
    monkeypatch.delenv('NEW', raising=False)
    with environment(HAD='other', NEW='some'):
        assert (os.environ['HAD'], os.environ['NEW']) == ('other', 'some')
    assert os.environ['HAD'] == 'its own' and 'NEW' not in os.environ
