# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The directory of a server: what lies there and is not the server's stays as it is."""

import os
import stat

import pytest
from command_line import refused, weld_twin

from weld_twin_report.serve.directory import Directory
from weld_twin_report.serve.job import Asked, Job

KEY = 'deadbeef' * 4


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


def served(folder):
    """Start the server in this process; only a refusal comes back."""
    return weld_twin('serve', '--port', 0, '--dir', folder)


def upload(jobs, key):
    """Leave in the folder of a job what an upload that is cut off does."""
    (jobs / key / 'recording/bag').mkdir(parents=True)
    (jobs / key / 'recording/bag/data.mcap').write_bytes(b'half')


@pytest.mark.parametrize('names', [('jobs/welding/cv.pdf',), ('notes.txt', 'jobs/x/job.json')])
def test_a_foreign_directory_is_refused_and_left_as_it_is(tmp_path, names):
    place = tmp_path / 'X'
    for name in names:
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        (place / name).write_text('mine')
    place.chmod(0o755)
    said = served(place)
    assert said.code == 2 and said.err.count('\n') == 1
    assert 'holds something else already' in said.err
    assert mode(place) == 0o755
    assert {str(p.relative_to(place)) for p in place.rglob('*') if p.is_file()} == set(names)


def test_a_server_removes_nothing_but_its_own_uploads_that_were_cut_off(tmp_path):
    place = tmp_path / 'X'
    place.mkdir(mode=0o755)
    place.chmod(0o755)
    made = Directory(place)
    whole = Job.new('me', ('bag',), Asked('ur5'))
    whole.write(made.jobs / whole.key)
    upload(made.jobs, KEY)
    for name in ('welding', 'feedface' * 4):
        (made.jobs / name).mkdir()
        (made.jobs / name / 'cv.pdf').write_text('mine')
    (place / 'notes.txt').write_text('mine')
    moved = 'ba5eba11' * 4  # its file lies on another disk, which is not there now
    upload(made.jobs, moved)
    os.symlink(tmp_path / 'disk/job.json', made.jobs / moved / 'job.json')
    made.close()
    again = Directory(place)
    assert {folder.name for folder in again.kept()} == {whole.key, moved}
    again.close()
    left = {path.name for path in (place / 'jobs').iterdir()}
    assert left == {whole.key, moved, 'welding', 'feedface' * 4}
    assert (place / 'notes.txt').read_text() == 'mine'
    assert mode(place) == 0o755 and mode(place / 'jobs') == mode(place / 'users') == 0o700


def test_a_directory_that_a_server_makes_is_private_and_a_link_to_it_is_followed(tmp_path):
    link = tmp_path / 'link'
    link.symlink_to(tmp_path / 'disk/served')
    Directory(link).close()
    Directory(link).close()
    assert link.is_symlink() and mode(tmp_path / 'disk/served') == 0o700


def test_the_directory_of_an_earlier_version_is_taken_over(tmp_path):
    old = tmp_path / 'X'
    job = Job.new('me', ('bag',), Asked('ur5'))
    job.write(old / 'jobs' / job.key)
    upload(old / 'jobs', KEY)
    (old / 'users/me').mkdir(parents=True)
    (old / 'users/me/history.db').write_bytes(b'kept')
    taken = Directory(old)
    assert [folder.name for folder in taken.kept()] == [job.key]
    taken.close()
    assert not (old / 'jobs' / KEY).exists()
    assert (old / 'users/me/history.db').read_bytes() == b'kept'


def test_a_second_server_on_the_same_directory_is_refused_while_the_first_runs(tmp_path):
    first = Directory(tmp_path / 'X')
    upload(first.jobs, KEY)
    said = served(tmp_path / 'X')
    assert said.code == 2 and said.err.count('\n') == 1
    assert 'another server works in' in said.err and f'process {os.getpid()}' in said.err
    assert (first.jobs / KEY).is_dir()  # an upload that the first is receiving
    first.close()
    Directory(tmp_path / 'X').close()


def test_a_place_that_cannot_be_a_directory_is_a_sentence(tmp_path):
    (tmp_path / 'file').write_text('mine')
    for place in (tmp_path / 'file', tmp_path / 'file/below'):
        said = served(place)
        assert said.code == 2 and said.err.count('\n') == 1


@pytest.mark.parametrize('port', [99_999, 65_536, -1])
def test_a_port_that_is_none_is_refused(tmp_path, port):
    result = refused('serve', f'--port={port}', '--dir', tmp_path / 'served')
    assert f'--port takes 0 to 65535, got {port}' in result
    assert not (tmp_path / 'served').exists()
