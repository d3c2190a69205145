# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The server under people who mean it ill, on a disk that fills up, with files that are not its own."""

import json
import socket
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from served import Person, Server, fill, small_disk

from weld_twin_core.errors import DataError
from weld_twin_nodes.cli.main import parser_of
from weld_twin_report.serve.fields import CORRECT, DIAGNOSE, IMPORT, given, sentence, words

TABLE = b'J1,J2,J3,J4,J5,J6,X,Y,Z\n' + b'0,-90,90,0,90,0,500,0,600\n' * 30
"""Thirty times the same station: read, and refused."""
HEAD = b'POST /recordings HTTP/1.1\r\nHost: localhost\r\nContent-Length: 900000\r\n'
HEAD += b'Content-Type: multipart/form-data; boundary=edge\r\n\r\n--edge\r\n'


def connections(server, count, said=b''):
    """Return connections that say so much and no more."""
    port = int(server.root.rpartition(':')[2])
    out = []
    for _ in range(count):
        out.append(socket.create_connection(('localhost', port)))
        if said:
            out[-1].sendall(said)
    return out


def is_closed(connection):
    connection.setblocking(False)
    try:
        return connection.recv(100).startswith((b'', b'HTTP/1.1 408'))
    except BlockingIOError:
        return False
    except OSError:
        return True


def test_who_says_nothing_or_half_or_stalls_keeps_nobody_out(server):
    held = connections(server, 130)
    held += connections(server, 130, b'GET / HTTP/1.1\r\nHost: localhost\r\nX-Slow: ')
    stalled = connections(server, 24, HEAD)
    began = time.monotonic()
    assert Person(server).get()[0] == 200
    assert not all(map(is_closed, held))  # nobody had to go before the page came
    person = Person(server)
    person.get()
    status, address, _ = person.drop(files=[('a.csv', TABLE)])
    assert status == 200 and address.startswith('/recordings/')
    # Those who say nothing are closed after ten seconds, whoever else comes, and not before.
    assert time.monotonic() - began > 10.0 or not all(map(is_closed, held))
    assert person.get(address)[0] == 200
    until = time.monotonic() + 60.0
    left = held
    while left and time.monotonic() < until:
        time.sleep(0.2)
        left = [each for each in left if not is_closed(each)]
    assert left == []
    for each in (*held, *stalled):
        each.close()


def test_many_uploads_of_nobody_leave_room_for_a_user(server):
    """Who comes without a key is one user, however often he comes."""
    returning = Person(server)
    returning.get()
    with ThreadPoolExecutor(8) as pool:
        drops = (pool.submit(Person(server).drop, files=[('a.csv', TABLE)]) for _ in range(60))
        codes = [each.result()[0] for each in list(drops)]
    refused = sum(code == 422 for code in codes)
    assert refused > 0  # else they were done as fast as they came, and the test shows nothing
    status, address, _ = returning.drop(files=[('b.csv', TABLE)])
    assert status == 200 and address.startswith('/recordings/')
    returning.end_of(address)


@pytest.mark.parametrize('name', ['Müller.csv', 'Messung (1).csv', '測定 #2 & co.csv'])
def test_names_as_people_give_them_are_taken_and_no_place_of_the_server_is_told(server, name):
    person = Person(server)
    person.get()
    _, address, _ = person.drop(files=[(name, TABLE)])
    text = person.end_of(address)
    assert 'It could not be diagnosed' in text
    assert '/tmp' not in text and 'jobs' not in text and '--' not in text.split('</style>')[1]


def test_a_full_disk_and_damaged_jobs_cost_nothing_that_was_there(tmp_path):
    with small_disk(tmp_path / 'disk', 24) as why:
        if why:
            pytest.skip(f'a small disk cannot be mounted here: {why}')
        made = Server(tmp_path / 'disk')
        try:
            person = Person(made)
            person.get()
            _, kept, _ = person.drop(files=[('a.csv', TABLE)])
            person.end_of(kept)
            ballast = fill(tmp_path / 'disk')
            for files in ([('b.csv', TABLE)], [('b.mcap', bytes(4_000_000))]):
                status, _, text = person.drop(files=files)
                assert (status, 'disk of the server is full' in text) == (507, True)
            assert 'It could not be diagnosed' in person.get(kept)[2]
            # What is asked for while nothing can be written is done all the same.
            assert person.drop(f'{kept}/again', files=())[0] == 200
            assert 'alert' in person.end_of(kept)
            ballast.unlink()
            _, later, _ = person.drop(files=[('c.csv', TABLE)])
            assert 'It could not be diagnosed' in person.end_of(later)
            assert not list((tmp_path / 'disk/scratch').iterdir())
            made.kill()
            bad = spoilt_jobs(tmp_path / 'disk/jobs', kept)
            made.start()
            person.root = made.root
            assert 'alert' in person.get(kept)[2] and 'alert' in person.get(later)[2]
            said = made.log.read_text()
            for file, text in bad.items():
                assert file.read_text() == text and f"'{file}' cannot be read" in said
        finally:
            made.kill()


def spoilt_jobs(jobs, address):
    """Write jobs that are damaged, or newer than this server; return their texts."""
    told = json.loads((jobs / address.rpartition('/')[2] / 'job.json').read_text())
    cut, newer, asleep, deep, timeless, outside = (letter * 32 for letter in 'abcdef')
    texts = {
        cut: '{"key": "cut", "us',
        newer: json.dumps({**told, 'key': newer, 'colour': 'red'}),
        asleep: json.dumps({**told, 'key': asleep, 'state': 'asleep'}),
        deep: '[' * 100_000,
        timeless: json.dumps({**told, 'key': timeless, 'since': float('nan')}),
        outside: json.dumps({**told, 'key': outside, 'user': '../..', 'names': ['../../a.csv']}),
    }
    for name, text in texts.items():
        (jobs / name).mkdir()
        (jobs / name / 'job.json').write_text(text)
    return {jobs / name / 'job.json': text for name, text in texts.items()}


def test_a_region_of_the_browser_is_a_box_and_no_file_of_the_server():
    box = '-300,-200.5,100:600,200,400'
    assert words(given({'region': box}, (DIAGNOSE,)), DIAGNOSE) == [f'--region={box}']
    for other in ('found/diagnosis.json', '/etc/passwd', '1,2,3', f'{box}:1'):
        with pytest.raises(DataError, match='Where it matters'):
            given({'region': other}, (DIAGNOSE,))


def test_signs_of_joints_are_taken_as_people_write_them():
    assert words(given({'joint_signs': '1 -1; +1,-'}, (IMPORT,)), IMPORT) == [
        '--joint-signs=1,-1,1,-1'
    ]
    with pytest.raises(DataError, match='Signs of the joints'):
        given({'joint_signs': '1,-1,2'}, (IMPORT,))


def test_what_commands_say_names_fields_of_the_browser():
    """Of every option of the commands behind the forms, in their own words."""
    for command in ('import', 'diagnose', 'correct'):
        parser = parser_of([command])
        (sub,) = (each for each in parser._actions if each.choices)
        for action in sub.choices[command]._actions:
            for option in action.option_strings:
                text = f'give {option} in metres, or {option}'
                said = sentence(text, command)
                if option.startswith('--'):
                    assert '--' not in said, said
    assert (
        sentence('name it with --controller', CORRECT) == 'Name it with “Language of the program”'
    )
    assert sentence('name it with --controller') == 'Name it with “Controller”'
    assert 'weld-twin' not in sentence("it becomes a bag with 'weld-twin bag recover x'")
