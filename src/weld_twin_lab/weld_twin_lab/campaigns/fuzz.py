# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Broken files of every kind, and ones made to do harm, are read within bounds of time and memory.

Recordings that hardly say anything are diagnosed, too.
"""

from __future__ import annotations

import faulthandler
import os
import resource
import shutil
import signal
import sqlite3
import struct
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
from lz4.frame import compress as lz4_compress

from weld_twin_core.arm import catalog
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.effects import JointOffset
from weld_twin_core.effects.effect import Effect
from weld_twin_core.effects.plausible import beyond
from weld_twin_core.errors import DataError, TwinError
from weld_twin_core.recording import JointMotion, Measurements, Recording, Signal
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.bags import bag_info, read_recording, recover
from weld_twin_msgs_py.bags.reader import zstd
from weld_twin_msgs_py.files import markdown
from weld_twin_msgs_py.files.diagnosis_model import load_model
from weld_twin_msgs_py.files.path_file import read_path
from weld_twin_msgs_py.robots import load_robot
from weld_twin_nodes.cli.given import Given

from ..real_arms.unseen import traceback_text
from ..study import listed
from .broken_files import ROBOT, mutate, targets

CPU_LIMIT = 10.0
"""Seconds of computing a file may cost."""
WALL_LIMIT = 120.0
"""Seconds after which a reader that computes nothing is taken to hang."""
MEMORY_LIMIT = 1_000_000_000
"""Bytes a file may cost."""
BATCH = 400
"""Files read by one process."""


class Hang(BaseException):
    """The file has cost too much time; no `except Exception` takes it for damage."""


Finding = dict[str, Any]
"""What a file did that it should not: exception, place in this project's code, and the first case,
which with the seed of the campaign makes the same file again."""


def hunt(name: str, seed: int, cases: int, known: dict[str, Finding]) -> Counter[str]:
    """Return how many broken files of a kind end how, and add what went wrong to what is known."""
    tally = Counter(right=0, refused=0, wrong=0)
    case = 0
    while case < cases:
        last, outcome = min(case + BATCH, cases), ''
        with forked(_batch, name, seed, case, last) as here:
            while case < last and not outcome.startswith(('hangs', 'ends', 'takes')):
                outcome = next_outcome(here)
                if outcome not in tally:
                    new = {'target': name, 'case': case, 'what': outcome, 'times': 0}
                    known.setdefault(f'{name}: {outcome}', new)['times'] += 1
                tally[outcome if outcome in tally else 'wrong'] += 1
                case += 1
    return tally


@contextmanager
def forked(work: Callable[..., None], *given: Any) -> Iterator[Connection]:
    """Yield what a process of its own sends; it gets the other end as its last argument."""
    context = get_context('fork')
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=work, args=(*given, there))
    process.start()
    there.close()
    try:
        yield here
    finally:
        process.kill()
        process.join()


def next_outcome(here: Connection) -> str:
    """Return what a process sends next, or why nothing came."""
    try:
        return str(here.recv()) if here.poll(WALL_LIMIT) else 'hangs without computing'
    except EOFError:
        return 'ends the process'


def _batch(name: str, seed: int, first: int, last: int, out: Connection) -> None:
    target = targets()[name]
    before = guard()
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / f'case{target.suffix}'
        for case in range(first, last):
            rng = Random(f'{seed}/{name}/{case}')
            path.write_bytes(mutate(rng, rng.choice(target.seeds), target.kind))
            outcome = read(target.read, path, before)
            out.send(outcome)
            if outcome.startswith('takes'):
                break
    out.close()
    os._exit(0)


def guard() -> int:
    """Bound what this process may take from now on; return the memory it has held so far [bytes]."""
    faulthandler.disable()
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # the URDF parser comments on what it passes over
    warnings.simplefilter('ignore')
    signal.signal(signal.SIGPROF, _stop)
    pages = int(Path('/proc/self/statm').read_text().split()[0])
    limit = MEMORY_LIMIT * 2 + pages * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    return peak()


def read(reads: Callable[[Path], Any], path: Path, before: int) -> str:
    """Return 'right' or 'refused', or what is wrong with how the file was taken."""
    outcome = _read(reads, path)
    if peak() - before > MEMORY_LIMIT:
        return f'takes more than {MEMORY_LIMIT / 1e6:.0f} MB'
    return outcome


def _read(reads: Callable[[Path], Any], path: Path) -> str:
    signal.setitimer(signal.ITIMER_PROF, CPU_LIMIT)
    try:
        reads(path)
    except TwinError as error:
        text = str(error)
        if '\n' in text or not text:
            return f'is refused in more than a sentence: {text[:80]!r}'
        return 'refused'
    except Hang:
        return f'hangs for {CPU_LIMIT:g} s of computing'
    except Exception as error:
        return f'{type(error).__name__} at {_place(error)}'
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    return 'right'


def _place(error: BaseException) -> str:
    """Return the last line of this project's own code in a traceback."""
    own = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if 'weld_twin' in frame.filename and 'campaigns' not in frame.filename
    ]
    if not own:
        return 'an unknown place'
    return f'{Path(own[-1].filename).name}:{own[-1].lineno} {own[-1].name}'


def _stop(*_: Any) -> None:
    raise Hang


def peak() -> int:
    """Return the most memory this process has held [bytes]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


GIGABYTE = 1_000_000_000
"""Bytes."""
Make = Callable[[Path], Path]


def harms() -> dict[str, tuple[Make, Callable[[Path], Any]]]:
    """Return what makes each file in a folder, and what reads it."""
    nested = '<robot name="x">' + '<link name="a">' * 60_000
    return {
        'URDF with entities that expand': (_laughs, load_robot),
        'URDF that names a file of the machine': (_outside, load_robot),
        'URDF nested deeply': (partial(_file, 'robot.urdf', nested), load_robot),
        'URDF with a chain of ten thousand links': (_long_chain, load_robot),
        'YAML aliases that expand': (_aliases, load_robot),
        'YAML nested deeply': (partial(_file, 'robot.yaml', '[' * 500_000), load_robot),
        'YAML that asks for a Python object': (_object, load_robot),
        'YAML path of a device': (_device, read_path),
        'JSON nested deeply': (
            partial(_file, 'diagnosis.json', '[' * 1_000_000),
            partial(load_model, ROBOT),
        ),
        'mcap chunk of zstd, a gigabyte of zeros': (partial(_bomb, 'zstd'), _bag),
        'mcap chunk of lz4, a gigabyte of zeros': (partial(_bomb, 'lz4'), _bag),
        'the same chunk with a small size declared': (partial(_bomb, 'zstd', declared=1000), _bag),
        'the same chunk, recovered': (partial(_bomb, 'zstd'), _recovered),
        'mcap record that claims 2^62 bytes': (_claim, _bag),
        'the same record, recovered': (_claim, _recovered),
        'bag file of zstd, gigabytes of zeros': (_packed_file, _bag),
        'message of zstd, a gigabyte of zeros': (_packed_message, _bag),
        'metadata.yaml that lists ../outside.mcap': (partial(_listing, '../outside.mcap'), _bag),
        'metadata.yaml that lists /etc/passwd': (partial(_listing, '/etc/passwd'), _bag),
        'metadata.yaml that lists a directory': (partial(_listing, '..'), _bag),
        'metadata.yaml nested deeply': (_nested_listing, _bag),
        'sqlite3 bag whose table is an endless query': (_endless, _bag),
        'the same bag, recovered': (_endless, _recovered),
    }


def try_one(name: str) -> str:
    """Return 'refused' with the sentence, or what went wrong, in a process of its own."""
    with forked(_attempt, name) as here:
        return next_outcome(here)


def _attempt(name: str, out: Connection) -> None:
    make, reads = harms()[name]
    with tempfile.TemporaryDirectory() as place:
        path = make(Path(place))
        said: list[str] = []

        def tell(path: Path) -> None:
            try:
                reads(path)
            except TwinError as error:
                said.append(str(error).replace(place, ''))
                raise

        outcome = read(tell, path, guard())
        out.send(f'{outcome}: {said[0]}' if outcome == 'refused' else outcome)


def _bag(path: Path) -> Any:
    return bag_info(path), read_recording(path, ROBOT)


def _recovered(path: Path) -> Any:
    return recover(path, path.with_name('recovered'))


def _file(name: str, content: str | bytes, folder: Path) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def _laughs(folder: Path) -> Path:
    levels = ''.join(f'<!ENTITY a{k} "{f"&a{k - 1};" * 10}">' for k in range(1, 11))
    text = f'<!DOCTYPE robot [<!ENTITY a0 "ha">{levels}]><robot name="&a10;"/>'
    return _file('robot.urdf', text, folder)


def _outside(folder: Path) -> Path:
    text = '<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="&x;"/>'
    return _file('robot.urdf', text, folder)


def _long_chain(folder: Path) -> Path:
    links = ''.join(f'<link name="l{k}"/>' for k in range(10_000))
    joints = ''.join(
        f'<joint name="j{k}" type="fixed"><parent link="l{k}"/><child link="l{k + 1}"/></joint>'
        for k in range(9_999)
    )
    return _file('robot.urdf', f'<robot name="x">{links}{joints}</robot>', folder)


def _aliases(folder: Path) -> Path:
    lines = ['a0: &a0 [x, x, x, x, x, x, x, x, x, x]']
    for k in range(1, 10):
        aliases = ', '.join([f'*a{k - 1}'] * 10)
        lines.append(f'a{k}: &a{k} [{aliases}]')
    return _file('robot.yaml', '\n'.join(lines), folder)


def _object(folder: Path) -> Path:
    text = f'!!python/object/apply:os.system ["touch {folder}/done"]'
    return _file('robot.yaml', text, folder)


def _device(folder: Path) -> Path:
    (folder / 'path.yaml').symlink_to('/dev/zero')
    return folder / 'path.yaml'


def _zeros(pack: str) -> bytes:
    if pack == 'lz4':
        return bytes(lz4_compress(bytes(GIGABYTE)))
    packer = zstd.ZstdCompressor()
    out = [packer.compress(bytes(10_000_000)) for _ in range(GIGABYTE // 10_000_000)]
    return b''.join([*out, packer.flush()])


def _bomb(pack: str, folder: Path, declared: int = GIGABYTE) -> Path:
    data = _zeros(pack)
    name = pack.encode()
    chunk = struct.pack('<QQQI', 1, 2, declared, 0) + struct.pack('<I', len(name)) + name
    chunk += struct.pack('<Q', len(data)) + data
    return _mcap(folder, b'\x06' + struct.pack('<Q', len(chunk)) + chunk)


def _claim(folder: Path) -> Path:
    return _mcap(folder, b'\x05' + struct.pack('<Q', 1 << 62) + bytes(100))


def _mcap(folder: Path, record: bytes) -> Path:
    """Return an mcap without a summary that holds a record."""
    magic = b'\x89MCAP0\r\n'
    header = b'\x01' + struct.pack('<Q', 8 + 4) + struct.pack('<I', 4) + b'ros2'
    header += struct.pack('<I', 0)
    footer = b'\x02' + struct.pack('<Q', 20) + bytes(20)
    return _file('bag.mcap', magic + header + record + footer + magic, folder)


def _sample(folder: Path, storage: str = 'mcap') -> tuple[Path, str]:
    """Return a directory with a bag in it, and its metadata."""
    kinds = targets()
    bag = folder / 'bag'
    bag.mkdir()
    _file(f'bag{kinds[storage].suffix}', kinds[storage].seeds[0], bag)
    return bag, kinds['metadata'].seeds[0].decode()


def _listing(path: str, folder: Path) -> Path:
    bag, text = _sample(folder)
    shutil.copy(bag / 'bag.mcap', folder / 'outside.mcap')
    _file('metadata.yaml', text.replace('- bag.mcap', f"- '{path}'"), bag)
    return bag


def _nested_listing(folder: Path) -> Path:
    bag, _ = _sample(folder)
    _file('metadata.yaml', 'rosbag2_bagfile_information: ' + '[' * 1_000_000, bag)
    return bag


def _packed_file(folder: Path) -> Path:
    bag, text = _sample(folder)
    _file('bag.mcap.zstd', _zeros('zstd') * 3, bag)
    return _said_packed(bag, text.replace('- bag.mcap', '- bag.mcap.zstd'), 'file')


def _packed_message(folder: Path) -> Path:
    bag, text = _sample(folder, 'sqlite3')
    with closing(sqlite3.connect(bag / 'bag.db3')) as base, base:
        base.execute('UPDATE messages SET data = ?', (_zeros('zstd'),))
    text = text.replace('- bag.mcap', '- bag.db3').replace(': mcap', ': sqlite3')
    return _said_packed(bag, text, 'message')


def _said_packed(bag: Path, text: str, mode: str) -> Path:
    """Write the metadata of a bag that was packed by file or by message."""
    text = text.replace("compression_mode: ''", f'compression_mode: {mode}')
    _file('metadata.yaml', text.replace("compression_format: ''", 'compression_format: zstd'), bag)
    return bag


def _endless(folder: Path) -> Path:
    bag, _ = _sample(folder, 'sqlite3')
    with closing(sqlite3.connect(bag / 'bag.db3')) as base, base:
        base.execute('DROP TABLE messages')
        base.execute(
            'CREATE VIEW messages AS WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL SELECT id + 1 '
            'FROM n) SELECT id, 1 AS topic_id, id AS timestamp, zeroblob(100) AS data FROM n'
        )
    return bag / 'bag.db3'


ROBOTS = ('slide', 'turn', 'planar', 'ur5', 'franka_panda', 'nine')
ALIGNS = ('', 'base', 'tool', 'base,tool')
ERRORS = ('none', 'offset', 'huge', 'jumbled')


@dataclass(frozen=True)
class Draw:
    robot: str = 'ur5'
    """One of `ROBOTS`."""
    stations: bool = True
    """At rest, else in motion."""
    count: int = 20
    """Measurements."""
    turned: bool = False
    """Whether orientations were measured."""
    align: str = ''
    still: int = 0
    """Joints that do not move, counted from the last."""
    travel: float = 0.5
    """Half the range that the others move over [rad or m]."""
    grid: float = 0.0
    """Step that positions are rounded to [degrees]; none at 0."""
    repeats: int = 1
    """How often every posture comes."""
    noise: float = 2e-5
    """Of the instrument, [m]."""
    flat: int = 0
    """Coordinates that were not measured and are zero throughout."""
    error: str = 'none'
    """One of `ERRORS`."""
    warm: bool = False
    """Whether a temperature was recorded, ever the same."""
    seed: int = 0


def drawn(seed: int) -> Draw:
    """Return one of many recordings, always the same for a seed."""
    rng = np.random.default_rng(seed)
    stations = bool(rng.random() < 0.7)
    return Draw(
        robot=str(rng.choice(ROBOTS)),
        stations=stations,
        count=int(rng.integers(1, 61)) if stations else int(rng.integers(2, 300)),
        turned=bool(rng.random() < 0.4),
        align=str(rng.choice(ALIGNS)),
        still=int(rng.integers(0, 10)),
        travel=float(rng.choice([0.0, 1e-6, 0.02, 0.5, 1.5])),
        grid=float(rng.choice([0.0, 0.0, 1.0, 10.0])),
        repeats=int(rng.choice([1, 1, 2, 10])),
        noise=float(rng.choice([0.0, 1e-9, 2e-5, 1e-3])),
        flat=int(rng.choice([0, 0, 1, 2, 3])),
        error=str(rng.choice(ERRORS)),
        warm=bool(rng.random() < 0.2),
        seed=seed,
    )


def robot_of(name: str) -> Robot:
    """Return a robot by name; those that are not in the catalogue are as plain as can be."""
    if name in catalog.names():
        return catalog.load(name)
    rows: dict[str, list[dict[str, Any]]] = {
        'slide': [{'name': 'axis', 'type': 'prismatic'}],
        'turn': [{'name': 'axis', 'a': 0.5}],
        'planar': [{'name': 'one', 'a': 0.4}, {'name': 'two', 'a': 0.3}],
        'nine': [
            {'name': f'j{k}', 'a': 0.1, 'd': 0.05, 'alpha': (-1.0) ** k * np.pi / 2.0}
            for k in range(9)
        ],
    }
    return Robot.from_mapping({'name': name, 'joints': rows[name]})


def recording_of(draw: Draw) -> tuple[Recording, Robot]:
    robot, rng = robot_of(draw.robot), np.random.default_rng(draw.seed)
    q = _positions(draw, robot, rng)
    t = np.arange(float(draw.count)) * (1.0 if draw.stations else 0.01)
    commanded = Recording('drawn', JointMotion(t, q, None, draw.stations))
    poses = Twin(robot, _effects(draw, robot)).poses(commanded, t)
    position = np.array(poses.position + draw.noise * rng.standard_normal((draw.count, 3)))
    if draw.error == 'jumbled':
        position = position[rng.permutation(draw.count)]
    position[:, : draw.flat] = 0.0
    rotation = poses.rotation if draw.turned else None
    warmth = Signal(t, np.full(t.size, 21.0)) if draw.warm else None
    measured = Measurements(t, position, rotation)
    return Recording('drawn', commanded.joints, measured, temperature=warmth), robot


def _positions(draw: Draw, robot: Robot, rng: np.random.Generator) -> Array:
    count = -(-draw.count // draw.repeats)
    if draw.stations:
        moved = rng.uniform(-1.0, 1.0, (count, robot.n))
    else:
        phase = np.arange(count)[:, None] * 0.01 * rng.uniform(0.5, 3.0, robot.n)
        moved = np.sin(phase + rng.uniform(0.0, 6.0, robot.n))
    middle = 0.5 * (np.maximum(robot.lower, -1.0) + np.minimum(robot.upper, 1.0))
    q = middle + draw.travel * moved
    q[:, robot.n - min(draw.still, robot.n) :] = middle[robot.n - min(draw.still, robot.n) :]
    if draw.grid:
        step = np.where(robot.prismatic, 1e-3, 1.0) * np.radians(draw.grid)
        q = step * np.rint(q / step)
    return np.repeat(q, draw.repeats, axis=0)[: draw.count]


def _effects(draw: Draw, robot: Robot) -> tuple[Effect, ...]:
    sizes = {'offset': 1e-3, 'huge': 0.5}
    if draw.error not in sizes:
        return ()
    return (JointOffset(robot.joint_names[draw.seed % robot.n], sizes[draw.error]),)


def tried(draw: Draw) -> dict[str, Any]:
    """Return what came of a draw: status, or refusal, or traceback, and what must not be."""
    recording, robot = recording_of(draw)
    out: dict[str, Any] = {'draw': asdict(draw), 'status': None, 'traceback': None, 'wrong': []}
    try:
        diagnosis = diagnose([recording], robot, align=draw.align)
        diagnosis.as_dict()
    except TwinError as error:
        return out | {'status': 'refused', 'sentence': str(error)}
    except Exception:  # what is counted here is exactly what nobody expected
        return out | {'traceback': traceback_text()}
    wrong = []
    if diagnosis.status == 'identified' and not (diagnosis.effects or diagnosis.families):
        wrong.append('identified with nothing named')
    wrong += [
        f'{each.effect.name} of {each.effect.site}: {name} = {value:.3g}'
        for each in diagnosis.effects
        for name, value, _ in beyond(robot, each.effect)
    ]
    return out | {'status': diagnosis.status, 'wrong': wrong}


def worst_of(count: int, first: int, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return how many draws, from the first on, ended how, and those that went wrong."""
    statuses: Counter[str] = Counter()
    bad = []
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')
        for seed in range(first, first + count):
            came = tried(drawn(seed))
            statuses[came['status'] or 'traceback'] += 1
            if came['traceback'] or came['wrong']:
                bad.append(came)
                last = (came['traceback'] or came['wrong'][0]).strip().splitlines()[-1]
                tell(f'recording {seed}: {last}')
    return {'first': first, 'count': count, 'statuses': dict(statuses), 'bad': bad}


def run(args: Given, tell: Callable[[str], None]) -> dict[str, Any]:
    names = list(targets())
    chosen = listed(args.only) or names
    if unknown := set(chosen) - set(names):
        raise DataError(
            f'no kind of file is called {min(unknown)!r}; there are {", ".join(names)}'
        )
    findings: dict[str, Finding] = {}
    kinds = {}
    for name in chosen:
        tally = hunt(name, args.seed, args.cases, findings)
        kinds[name] = dict(tally)
        tell('{}: {right} read, {refused} refused, {wrong} wrong'.format(name, **tally))
    for finding in findings.values():
        tell('{target} {case}: {what} ({times} times)'.format(**finding))
    malicious = {name: try_one(name) for name in harms()}
    for name, outcome in malicious.items():
        tell(f'{name}: {outcome}')
    recordings = worst_of(args.recordings, args.seed, tell) if args.recordings else {'bad': []}
    passed = not (findings or recordings['bad'])
    passed = passed and all(text.startswith('refused') for text in malicious.values())
    return {
        'passed': passed,
        'seed': args.seed,
        'cases_of_each': args.cases,
        'cpu_limit_s': CPU_LIMIT,
        'memory_limit_mb': MEMORY_LIMIT / 1e6,
        'kinds': kinds,
        'findings': list(findings.values()),
        'malicious': malicious,
        'recordings': recordings,
    }


def table(result: dict[str, Any]) -> str:
    kinds = [
        (name, row['right'], row['refused'], row['wrong']) for name, row in result['kinds'].items()
    ]
    outcomes = result['malicious'].values()
    refused = sum(text.startswith('refused') for text in outcomes)
    kinds.append(('malicious', 0, refused, len(outcomes) - refused))
    return markdown.table(('kind', 'read', 'refused', 'wrong'), *kinds)
