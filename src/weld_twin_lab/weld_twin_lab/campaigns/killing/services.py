# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A fleet run and a server, killed: what was finished stays, what waited is done afterwards."""

from __future__ import annotations

import re
import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ...fleet.fleet_runs import command, rows, timed
from ...fleet.users import Visitor, started, wait
from .commands import KillRow

LINES = 3
"""Recordings of the list whose run is killed."""
MOST = 1.0
"""Share of the time of a whole run up to which kills are drawn; the first part is Python's start."""
LEAST = 0.3
"""Share from which they are drawn."""
RECORDING = r'href="(/recordings/[0-9a-f]{32})"'
"""How the list of recordings refers to one of them."""
AFTER = 4.0
"""Seconds from the beginning of an upload up to which a server is killed; a diagnosis takes as long."""
Once = Callable[[np.random.Generator], KillRow]


def fleet_case(place: Path, bag: Path, robot: str) -> Once:
    """
    Return what kills a fleet run, whose finished rows must stay and whose others must come.

    Parameters
    ----------
    place : Path
        To work in.
    bag : Path
        A recording.
    robot : str

    """
    listed = place / 'list.csv'
    lines = [f'line {k},{bag},{robot},2026-03-0{k + 1}' for k in range(LINES)]
    listed.write_text('cell,recording,robot,at\n' + '\n'.join(lines) + '\n', encoding='utf-8')
    whole = str(place / 'whole.db')
    took = timed(listed, whole, '--workers', '2')
    expected = rows(whole)

    def once(rng: np.random.Generator) -> KillRow:
        database = place / 'killed.db'
        while True:
            for file in place.glob('killed.db*'):
                file.unlink()
            moment = float(rng.uniform(LEAST, MOST) * took)
            if _killed(command(listed, str(database), '--workers', '2'), moment):
                break
        left = rows(str(database), with_cost=True) if database.exists() else {}
        short = {key: row[:-3] for key, row in left.items()}
        odd = [key for key, row in short.items() if expected.get(key) != row]
        timed(listed, str(database), '--workers', '2')
        final = rows(str(database), with_cost=True)
        again = [key for key, row in left.items() if final.get(key) != row]
        gone = {key: row[:-3] for key, row in final.items()} != expected
        return KillRow(
            case='fleet run',
            how=f'after {moment:.3f} s',
            lost='rows are lost or written again' if again or gone else '',
            half=f'{len(odd)} rows are none of a run in peace' if odd else '',
            mixed=0 < len(left) < LINES,
        )

    return once


def _killed(words: list[str], moment: float) -> bool:
    """Run a command and kill it; return whether it was still running."""
    with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            process.wait(timeout=moment)
            return False
        except subprocess.TimeoutExpired:
            process.kill()
            return True


def server_case(place: Path, bag: Path, robot: str) -> Once:
    """
    Return what kills a server while somebody drops a recording, or it is diagnosed.

    Parameters
    ----------
    place : Path
        To work in.
    bag : Path
        A recording.
    robot : str

    """
    served, files = place / 'served', sorted(bag.iterdir())
    process, root = started(served)
    person = Visitor(root)
    earlier = person.drop(files, robot=robot)[1]
    wait(person, earlier)
    process.kill()
    process.wait()
    first = _results(served, earlier)

    def once(rng: np.random.Generator) -> KillRow:
        process, person.root = started(served)
        moment = float(rng.uniform(0.0, AFTER))
        dropped: list[str] = []
        thread = threading.Thread(target=_drop, args=(person, files, robot, dropped))
        thread.start()
        time.sleep(moment)
        process.kill()
        process.wait()
        thread.join()
        process, person.root = started(served)
        lost = '' if _results(served, earlier) == first else 'an earlier verdict was changed'
        listed = set(re.findall(RECORDING, person.page('/recordings')[2]))
        if not listed.issuperset([earlier, *dropped]):
            lost = lost or 'what was taken is not there'
        # The answer may have been lost on the way, and the recording be there all the same.
        for address in listed - {earlier}:
            page = wait(person, address)
            if '<iframe' not in page:
                why = re.findall(r'role="alert">(.*?)</p>', page)
                lost = lost or f'what was taken was not diagnosed: {" ".join(why)}'
        half = _half(served, listed)
        for address in listed - {earlier}:
            person.page(f'{address}/delete', b'')
        process.kill()
        process.wait()
        how = f'{moment:.3f} s after an upload began'
        return KillRow(case='serve', how=how, lost=lost, half=half, mixed=False)

    return once


def _half(served: Path, listed: set[str]) -> str:
    """Return what a server's directory holds beside the recordings that it lists."""
    jobs = {f'/recordings/{folder.name}' for folder in (served / 'jobs').iterdir()}
    if jobs != listed:
        return 'a folder is left that is no recording'
    return 'scratch is left' if list((served / 'scratch').iterdir()) else ''


def _drop(person: Visitor, files: list[Path], robot: str, dropped: list[str]) -> None:
    """Drop a recording; note its address where it was taken, whatever became of the server."""
    try:
        status, address, _ = person.drop(files, robot=robot)
    except OSError:
        return
    if status == 200 and address.startswith('/recordings/'):
        dropped.append(address)


def _results(served: Path, address: str) -> dict[str, bytes]:
    """Return the files that a finished recording has."""
    found = served / 'jobs' / address.rpartition('/')[2] / 'found'
    return {file.name: file.read_bytes() for file in found.iterdir() if file.is_file()}
