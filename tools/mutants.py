#!/usr/bin/env python3
# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Break the code on purpose, one place at a time, and count how often the tests notice.

    tools/in_env python tools/mutants.py                     200 drawn from the whole diagnosis
    tools/in_env python tools/mutants.py --room weld_twin_core.twin --draw 60
    tools/in_env python tools/mutants.py --room product --draw 60  by lines, from all that users have

A mutant is a comparison turned round or moved to its boundary, a number 25 % up or down, a sign, a
term that is dropped, two arguments exchanged, the least for the most, 'and' for 'or', or a branch
that is taken never or always. Defaults of functions and of dataclasses count as well.

The tests run once as they are, and it is noted which functions each of them runs. Then a process is
forked for every mutant. It puts the broken function in the place of the right one and runs the tests
of its room that reach it, those that run least beside it first, until one fails. Where the time for
that is over before all were asked it is undecided, and counts as not caught. Exits with 1 when fewer
than --least are caught.
"""

from __future__ import annotations
import __future__

import argparse
import ast
import bisect
import copy
import dataclasses
import functools
import importlib
import itertools
import os
import pickle
import random
import re
import resource
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import FrameType, FunctionType, ModuleType
from typing import Any, NamedTuple

for threads in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS'):
    os.environ[threads] = '1'

ROOT = Path(__file__).parents[1]
ENGINE = 'weld_twin_core.diagnosis'
CORE = 'src/weld_twin_core/test'
WHOLE = 'kept_answers kept_findings verdict columns'
"""Files of tests that make whole diagnoses, or see much of one: they ask about every room of it."""
TESTS = {
    'algebra': 'fit columns evidence starts steps_by_hand sizes stray_readings '
    'structural_aliases noise_and_interval learned_priors levels changes springs_at_rest',
    'result': 'structural_aliases',
    'evidence': 'evidence decision',
    'hypotheses': 'swapped_alternatives carrying needed_kinds unseen_stretches '
    'recordings_together',
    'frames': 'alignment changes known_places touches steps_by_hand',
    'soundness': 'alignment checks_by_hand mends mixups_by_hand soundness steps_by_hand bundle '
    'touch_mistakes tracker_beside measured_efforts',
    'unseen': 'unseen_stretches chance levels noise_and_interval steps_by_hand '
    'touch_mistakes touches known_places fit many_small_errors recordings_together',
    'many': 'many_small_errors small_errors learned_priors needed_kinds recordings_together',
    'verdict': 'decision',
    'levels': 'levels unseen_stretches',
    'calibration': 'calibration formulas',
    'advice': 'next_experiment pieces_by_hand touch_mistakes actions',
    'predicting': 'sizes planned steps_by_hand',
    'answer': 'noise_and_interval structural_aliases pieces_by_hand known_places steps_by_hand',
}
"""Which files of tests ask about a room of the engine before all others, by their names, beside
those that import the module drawn. Rooms of other packages are asked about by such files alone, and
by folders of their name, or of that which is here."""
FOLDERS = {
    'arm': 'arm twin kernels',
    'assembly': 'messages_and_bags',
    'bags': 'messages_and_bags recording',
    'cli': 'cli offline programs report',
    'demo': 'cli',
    'effects': 'twin',
    'files': 'files cli',
    'harness': 'live',
    'live': 'live streams',
    'messages': 'messages_and_bags',
    'motion': 'motion programs',
    'offline': 'offline programs',
    'robots': 'robots messages_and_bags',
    'tables': 'tables messages_and_bags',
    'wording': 'report',
}
PRODUCT, PROOFS = 'product', 'weld_twin_lab'
"""What stands for all packages but that of the proofs."""
QUICK = 'not slow and not cells'
CHEAP, SLOW, SPENT = 0.2, 12.0, 240.0
"""Seconds, with all calls noted, that a test takes which is asked at once, that one may take, and all of
them together."""
ENDS = {0: 'survives', 2: 'undecided', 3: 'no test runs'}
"""What a process ends with whose mutant no test noticed: of all that reach it, in the time, or as none
does, for it is made when modules are imported or runs in other processes."""
LONGEST = 60
"""Seconds of processor time after which a mutant that comes to no end is caught."""
ALIKE = {
    f'{ENGINE}.advice.next_touches._touchable: 0 -> -1': 'touches of a new place are at one point',
    f'{ENGINE}.algebra.columns.rows_of: (np.diff(labels) >= 0).all() -> never': (
        'rows that lie together are told one by one, and are the same'
    ),
    f'{ENGINE}.algebra.problem.Problem.features: 1 -> 2': 'makers of one more model are kept',
    f'{ENGINE}.levels.causes._contributions: 4 -> 3': 'shares are those of their sum',
    f'{ENGINE}.levels.free_form.Choosing.by_chance: 0 -> -1': (
        'ways to divide the data have the same columns'
    ),
    f'{ENGINE}.levels.free_form.Folds.of: np.diff(labels) >= 0 -> np.diff(labels) < 0': (
        'rows that lie fold by fold are sorted once more, to the same order'
    ),
    f'{ENGINE}.many.fitted_together._relearned: '
    'result.final.coordinates.size <= MANY -> result.final.coordinates.size < MANY': (
        'with exactly so many either way will do'
    ),
    f'{ENGINE}.unseen.unseen_stretches.Unseen._asked: 1 -> 0': (
        'a residual from which nothing is taken is itself, found without what might be taken'
    ),
    f'{ENGINE}.soundness.suspicions.turned_bases: 1.0 -> 1.25': (
        'turns of axes onto axes are tens of degrees from where it counts'
    ),
}
"""Mutants that nobody can see, each with the reason: they are set aside."""

FLIPPED: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.GtE,),
    ast.LtE: (ast.Gt, ast.Lt),
    ast.Gt: (ast.LtE,),
    ast.GtE: (ast.Lt, ast.Gt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
}
"""The second is the first moved to its boundary. That is done where something is counted: measured
numbers never meet it."""
COUNTS = ('size', 'count', 'ndim', 'shape')
GUARD = 1e-9
"""Smaller numbers keep divisions from zero, and larger ones stand for no bound."""
NOTHING = ('EMPTY', 'FLAT', 'REPEATED', 'ROUNDING')
"""Names of such numbers: whether one is added or taken off nobody can see."""
SIGNS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
}
EXTREMES = {'min': 'max', 'max': 'min', 'minimum': 'maximum', 'maximum': 'minimum'}
Function = ast.FunctionDef | ast.AsyncFunctionDef
Ran = set[tuple[str, int]]
"""Functions, by file and first line."""


class Place(NamedTuple):
    """What may be broken: the number of its node, how, and the names and line of what holds it."""

    module: str
    node: int
    how: str
    holder: tuple[str, ...]
    line: int


# What may be broken --------------------------------------------------------------------------


def holders(tree: ast.Module) -> Iterator[tuple[tuple[str, ...], ast.stmt]]:
    """Yield functions, methods, and what is assigned in modules and classes, each with its names."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef):
            yield from (((node.name, *name_of(own)), own) for own in node.body if name_of(own))
        elif name_of(node):
            yield name_of(node), node


def name_of(node: ast.stmt) -> tuple[str, ...]:
    """Return the name that a statement makes; nothing where it makes none."""
    if isinstance(node, Function):
        return (node.name,)
    target = node.targets[0] if isinstance(node, ast.Assign) else getattr(node, 'target', None)
    made = isinstance(target, ast.Name) and getattr(node, 'value', None) is not None
    return (target.id,) if made and isinstance(target, ast.Name) else ()


def places(module: str, tree: ast.Module) -> Iterator[Place]:
    """Yield all that may be broken in a module."""
    number = {id(node): k for k, node in enumerate(ast.walk(tree))}
    for holder, top in holders(tree):
        within = isinstance(top, Function)
        for node in reached(top):
            line = getattr(top, 'lineno', 0)
            for how in ways(node, within=within):
                yield Place(module, number[id(node)], how, holder, line)


def reached(top: ast.AST) -> Iterator[ast.AST]:
    """Yield nodes that do something when the code runs: no annotation, no decorator, no claim."""
    for field, value in ast.iter_fields(top):
        if field in ('annotation', 'returns', 'decorator_list'):
            continue
        for node in value if isinstance(value, list) else [value]:
            if isinstance(node, ast.AST) and not isinstance(node, ast.Assert | ast.Raise):
                yield node
                yield from reached(node)


def ways(node: ast.AST, *, within: bool) -> list[str]:
    """Return the ways in which a node may be broken."""
    if isinstance(node, ast.Compare):
        most = len(FLIPPED[type(node.ops[0])]) if counts(node) else 1
        return [f'compare {k}' for k in range(most)]
    if isinstance(node, ast.If | ast.IfExp):
        return ['never', 'always']
    if isinstance(node, ast.BoolOp):
        return ['and or']
    if isinstance(node, ast.BinOp) and type(node.op) in SIGNS:
        nothing = isinstance(node.op, ast.Add | ast.Sub) and last_name(node.right) in NOTHING
        return [] if nothing else ['sign', 'dropped']
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return ['sign']
    if isinstance(node, ast.Call) and within:
        extreme = ['extreme'] if last_name(node.func) in EXTREMES else []
        plain = {ast.dump(arg) for arg in node.args if not isinstance(arg, ast.Starred)}
        return extreme or (['exchanged'] if len(plain) == len(node.args) == 2 else [])
    if isinstance(node, ast.Constant) and movable(node.value):
        return ['less', 'more']
    return []


def counts(node: ast.Compare) -> bool:
    """Return whether a comparison is one of whole numbers."""
    return any(
        (isinstance(side, ast.Constant) and type(side.value) is int)
        or (isinstance(side, ast.Attribute) and side.attr in COUNTS)
        or (isinstance(side, ast.Call) and last_name(side.func) == 'len')
        for side in (node.left, *node.comparators)
    )


def last_name(node: ast.expr) -> str:
    """Return the last name of what is called."""
    return node.attr if isinstance(node, ast.Attribute) else getattr(node, 'id', '')


def movable(value: object) -> bool:
    """Return whether a constant is a number on whose size something hangs: no zero, and no guard."""
    return type(value) is int or (type(value) is float and GUARD < abs(value) < 1.0 / GUARD)


def broken(tree: ast.Module, place: Place) -> tuple[ast.stmt, str]:
    """Return what holds a place, broken there, and in words what was done."""
    tree = copy.deepcopy(tree)
    node: Any = next(node for k, node in enumerate(ast.walk(tree)) if k == place.node)
    line, how = getattr(node, 'lineno', place.line), place.how
    before = ast.unparse(node.test if how in ('never', 'always') else node)
    if how.startswith('compare'):
        node.ops[0] = FLIPPED[type(node.ops[0])][int(how.split()[1])]()
    elif how in ('never', 'always'):
        node.test = ast.Constant(how == 'always')
    elif how == 'and or':
        node.op = ast.And() if isinstance(node.op, ast.Or) else ast.Or()
    elif how == 'exchanged':
        node.args.reverse()
    elif how == 'extreme':
        key = 'attr' if isinstance(node.func, ast.Attribute) else 'id'
        setattr(node.func, key, EXTREMES[last_name(node.func)])
    elif how in ('less', 'more'):
        node.value = moved(node.value, how)
    elif isinstance(node, ast.UnaryOp):
        node.op = ast.UAdd()
    elif how == 'sign':
        node.op = SIGNS[type(node.op)]()
    else:
        node.op, node.right = ast.Add(), ast.Constant(0)
    after = how if how in ('never', 'always') else ast.unparse(node)
    top = next(top for holder, top in holders(tree) if (holder, top.lineno) == place[3:])
    words = f'{".".join(place.holder)}, line {line}: {before}  ->  {after}'
    return ast.fix_missing_locations(top), ' '.join(words.split())


def moved(value: float, how: str) -> float:
    """Return a number 25 % less or more; whole ones by one at least."""
    way = 1 if how == 'more' else -1
    return value + way * (max(1, round(0.25 * abs(value))) if type(value) is int else 0.25 * value)


# How it is put in place ----------------------------------------------------------------------


def put(place: Place, top: ast.stmt) -> None:
    """Put what is broken in the place of what is right, in this process."""
    module = importlib.import_module(place.module)
    owner: Any = module
    for name in place.holder[:-1]:
        owner = getattr(owner, name)
    if isinstance(top, Function):
        put_function(module, owner, top)
    else:
        put_value(module, owner, place.holder[-1], top)
    forget()


def forget() -> None:
    """Forget what functions of this project, and of its tests, keep of earlier calls."""
    for module in list(sys.modules.values()):
        if str(getattr(module, '__file__', '')).startswith(str(ROOT)):
            for held in list(vars(module).values()):
                inside = vars(held).values() if isinstance(held, type) else ()
                for made in (held, *inside):
                    if isinstance(made, functools._lru_cache_wrapper):
                        made.cache_clear()


def put_function(module: ModuleType, owner: Any, top: ast.stmt) -> None:
    """Give a function the code and the defaults of its broken copy."""
    assert isinstance(top, Function)
    own = copy.copy(top)
    own.decorator_list = []
    body: list[ast.stmt] = [own]
    if owner is not module:
        body = [ast.ClassDef(owner.__name__, [], [], body, [])]
    whole = ast.fix_missing_locations(ast.Module(body, []))
    flag = __future__.annotations.compiler_flag
    space = dict(module.__dict__)
    exec(compile(whole, str(module.__file__), 'exec', flag, dont_inherit=True), space)
    made = space[owner.__name__].__dict__[own.name] if owner is not module else space[own.name]
    right = plain(owner.__dict__[own.name])
    right.__code__ = made.__code__
    right.__defaults__, right.__kwdefaults__ = made.__defaults__, made.__kwdefaults__


def plain(held: Any) -> FunctionType:
    """Return the function within a property, a cache, a class method."""
    while not isinstance(held, FunctionType):
        held = next(
            inner
            for key in ('fget', 'func', '__func__', '__wrapped__')
            if (inner := getattr(held, key, None)) is not None
        )
    inner = getattr(held, '__wrapped__', held)  # what a context manager holds
    assert isinstance(inner, FunctionType)
    return inner


def put_value(module: ModuleType, owner: Any, name: str, top: Any) -> None:
    """Give a module or a class another value, and everybody who imported it."""
    value = eval(compile(ast.Expression(top.value), '', 'eval'), {**vars(module), **vars(owner)})
    if owner is not module:
        if isinstance(value, dataclasses.Field):
            value = value.default
        if dataclasses.is_dataclass(owner):
            put_default(owner, name, value)
        setattr(owner, name, value)
        return
    right = getattr(module, name)
    for other in list(sys.modules.values()):
        if vars(other).get(name) is right:
            setattr(other, name, value)


def put_default(owner: Any, name: str, value: Any) -> None:
    """Give a parameter of a dataclass another default."""
    begin = owner.__init__
    if name in (begin.__kwdefaults__ or {}):
        begin.__kwdefaults__[name] = value
        return
    names = begin.__code__.co_varnames[: begin.__code__.co_argcount]
    late = list(begin.__defaults__ or ())
    late[names.index(name) - len(names)] = value
    begin.__defaults__ = tuple(late)


# How it is noticed ---------------------------------------------------------------------------


class Asked:
    """A plugin of pytest: the tests once as they are, then those that reach a mutant, broken."""

    def __init__(
        self,
        drawn: Sequence[Place],
        files: dict[str, Path],
        trees: dict[str, ast.Module],
        jobs: int,
        of_room: dict[str, set[Path]],
    ) -> None:
        self.of_room = of_room
        self.drawn, self.files, self.trees, self.jobs = list(drawn), files, trees, jobs
        self.told: list[tuple[Place, str, bool]] = []
        self.spent, self.ends = 0.0, Counter[str]()

    def pytest_runtestloop(self, session: Any) -> bool:
        """Run everything in the place of the usual loop."""
        begin = time.monotonic()
        reach = self.right(session.items)
        print(f'{len(reach)} tests as they are: {time.monotonic() - begin:.0f} s', flush=True)
        running: dict[int, tuple[Place, str]] = {}
        while self.drawn or running:
            while self.drawn and len(running) < self.jobs:
                place = self.drawn.pop()
                top, words = broken(self.trees[place.module], place)
                child = os.fork()
                if child == 0:
                    os._exit(self.child(place, top, reach))
                running[child] = place, words
            child, status = os.wait()
            place, words = running.pop(child)
            code = os.waitstatus_to_exitcode(status)
            self.told.append((place, words, code not in ENDS))
            if code in ENDS:
                self.ends[ENDS[code]] += 1
                print(f'{ENDS[code]}: {place.module}.{words}', flush=True)
        self.spent = time.monotonic() - begin
        return True

    def right(self, items: Sequence[Any]) -> list[tuple[float, Ran, Any]]:
        """Return the seconds of every test, the functions that it runs, and the test."""
        children: dict[int, Path] = {}
        told: dict[int, tuple[float, Ran | None]] = {}
        with tempfile.TemporaryDirectory() as place:
            for k in range(self.jobs):  # forked as mutants are: some tests fail there as it is
                file = Path(place) / f'{k}'
                child = os.fork()
                if child == 0:
                    file.write_bytes(pickle.dumps(self.ran(items, k)))
                    os._exit(0)
                children[child] = file
            for child, file in children.items():
                os.waitpid(child, 0)
                told |= pickle.loads(file.read_bytes())
        out = [(*told[k], item) for k, item in enumerate(items)]
        failed = [item.nodeid for _, ran, item in out if ran is None]
        if failed:
            print(f'not asked, for they fail as it is: {", ".join(failed)}', flush=True)
        asked = [(seconds, ran, item) for seconds, ran, item in out if ran and seconds < SLOW]
        return sorted(asked, key=lambda each: (each[0] > CHEAP, len(each[1])))

    def ran(self, items: Sequence[Any], part: int) -> dict[int, tuple[float, Ran | None]]:
        """Return the seconds of a part of the tests, and what each runs; None of one that fails."""
        watched, out = {str(file) for file in self.files.values()}, {}
        for k in range(part, len(items), self.jobs):
            ran: Ran = set()

            def noted(frame: FrameType, _: str, __: object, ran: Ran = ran) -> None:
                code = frame.f_code
                if code.co_filename in watched:
                    ran.add((code.co_filename, code.co_firstlineno))

            begin = time.process_time()
            threading.settrace(noted)
            sys.settrace(noted)
            failed = fails(items[k])
            sys.settrace(None)
            threading.settrace(None)
            out[k] = time.process_time() - begin, None if failed else ran
        return out

    def child(self, place: Place, top: ast.stmt, reach: Sequence[Any]) -> int:
        """Return 1 in a process of its own where a test notices a mutant, else what became of it."""
        resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST))
        file = str(self.files[place.module])
        first = min([place.line, *(d.lineno for d in getattr(top, 'decorator_list', []))])
        try:
            put(place, top)
        except Exception as error:  # as an import would fail
            print(f'not put: {place}: {error!r}', flush=True)
            return 1
        spent, own, code = 0.0, files_for(place), 3
        of_room = self.of_room.get(room_of(place))
        for seconds, ran, item in sorted(
            reach, key=lambda each: each[2].path.relative_to(ROOT) not in own
        ):
            if of_room and item.path.relative_to(ROOT) not in of_room:
                continue
            if isinstance(top, Function) and (file, first) not in ran:
                continue
            if spent > SPENT:
                return 2
            if fails(item):
                return 1
            spent, code = spent + seconds, 0
        return code


def fails(item: Any) -> bool:
    """Run a test, and return whether it fails."""
    from _pytest.runner import runtestprotocol

    item._initrequest()
    with open(os.devnull, 'w') as quiet:
        kept, sys.stderr = sys.stderr, quiet
        try:
            return any(report.failed for report in runtestprotocol(item, log=False))
        finally:
            sys.stderr = kept


@functools.cache
def imports(file: Path, module: str) -> bool:
    """Return whether a file of tests imports a module, or what it holds as a name of the package."""
    text, (room, _, name) = file.read_text(encoding='utf-8'), module.rpartition('.')
    package = importlib.import_module(module.partition('.')[0])
    lines = re.findall(rf'^from {package.__name__} import (.+)$', text, re.MULTILINE)
    public = (getattr(package, each, None) for line in lines for each in line.split(', '))
    return (
        f'{module} ' in text
        or f'{room} import {name}' in text
        or any(getattr(each, '__module__', '') == module for each in public)
    )


@functools.cache
def files_for(place: Place) -> frozenset[Path]:
    """Return the files that ask about a place before others; outside the engine those of its room."""
    files = (*Path('test').rglob('test_*.py'), *Path('src').glob('*/test/**/test_*.py'))
    if room_of(place) != ENGINE:
        name = room_of(place).partition('.')[2]
        folders = FOLDERS.get(name, name).split()
        return frozenset(
            file for file in files if file.parent.name in folders or imports(file, place.module)
        )
    inside = place.module.removeprefix(f'{ENGINE}.').split('.')[0]
    names = {f'test_{name}' for name in f'{WHOLE} {TESTS.get(inside, "")}'.split()}
    near = (file for file in files if file.is_relative_to(CORE) or file.parts[0] == 'test')
    return frozenset(file for file in near if file.stem in names or imports(file, place.module))


def room_of(place: Place) -> str:
    """Return the package and the room of a place, as in 'weld_twin_core.twin'."""
    return '.'.join(place.module.split('.')[:2])


def spread(every: Sequence[Place], files: dict[str, Path], count: int, seed: int) -> list[Place]:
    """Return so many places, each room its share of them by its lines."""
    draw, inside = random.Random(seed), dict[str, list[Place]]()
    for place in every:
        inside.setdefault(place.module, []).append(place)
    names = sorted(inside)
    lines = [len(files[name].read_text(encoding='utf-8').splitlines()) for name in names]
    ends, first = list(itertools.accumulate(lines)), draw.random()
    steps = ((first + k) * ends[-1] / count for k in range(count))
    return [draw.choice(inside[names[bisect.bisect(ends, at)]]) for at in steps]


def modules(rooms: Sequence[str]) -> dict[str, Path]:
    """Return the modules of rooms and their files."""
    out = {}
    for name in rooms:
        inside = Path(name.replace('.', '/'))
        base = next(p for p in (ROOT / 'src').iterdir() if (p / inside.parts[0]).is_dir())
        whole = base / inside
        found = sorted(whole.rglob('*.py')) if whole.is_dir() else [whole.with_suffix('.py')]
        for file in found:
            if file.name != '__init__.py':
                out['.'.join(file.relative_to(base).with_suffix('').parts)] = file
    return out


def told(asked: Asked, least: float) -> int:
    """Tell how many of each room were caught."""
    caught, total, aside = Counter[str](), Counter[str](), 0
    for place, words, noticed in asked.told:
        room = '.'.join(place.module.split('.')[1:3])
        alike = not noticed and f'{place.module}.{without_line(words)}' in ALIKE
        aside += alike
        total[room] += not alike
        caught[room] += noticed
    for room in sorted(total):
        print(f'{room}: {caught[room]} of {total[room]}')
    share = caught.total() / max(total.total(), 1)
    print(
        f'{caught.total()} of {total.total()} mutants caught ({share:.0%}), {aside} more set aside, '
        f'{dict(asked.ends)}, in {asked.spent:.0f} s, of the processor {worked():.0f} s'
    )
    return int(share < least)


def worked() -> float:
    """Return the processor time of this process and of its children [s]."""
    used = [resource.getrusage(of) for of in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


def without_line(words: str) -> str:
    """Return what was done without the line, which moves."""
    return re.sub(r', line \d+:', ':', words)


def main() -> int:
    """Break drawn places, and tell what nobody noticed."""
    parser = argparse.ArgumentParser(description=__doc__.strip().partition('\n')[0])
    parser.add_argument('--room', action='append', metavar='NAME', help='may be repeated')
    parser.add_argument('--tests', action='append', metavar='PATH', help='may be repeated')
    parser.add_argument('--draw', type=int, default=200, metavar='N', help='0 for all')
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--least', type=float, default=0.85, metavar='SHARE')
    parser.add_argument('--jobs', type=int, default=os.cpu_count() or 1)
    args = parser.parse_args()
    os.chdir(ROOT)
    import pytest

    product, rooms = args.room == [PRODUCT], args.room or [ENGINE]
    if product:
        packages = sorted(place.name for place in (ROOT / 'src').iterdir())
        rooms = [name for name in packages if name != PROOFS]
    files = modules(rooms)
    trees = {name: ast.parse(file.read_text(encoding='utf-8')) for name, file in files.items()}
    every = [place for name, tree in trees.items() for place in places(name, tree)]
    if product:
        drawn = spread(every, files, args.draw, args.seed)
    else:
        mixed = random.Random(args.seed).sample(every, len(every))
        drawn = mixed[: args.draw or None]
    of_room: dict[str, set[Path]] = {}
    for place in drawn if args.tests is None else ():
        of_room.setdefault(room_of(place), set()).update(files_for(place))
    asked = Asked(drawn, files, trees, args.jobs, of_room)
    options = ['-q', '-n', '0', '-p', 'no:cacheprovider', '--no-header', '-s', '-m', QUICK]
    asking = args.tests or sorted(map(str, set().union(*of_room.values())))
    pytest.main([*options, *asking], plugins=[asked])
    return told(asked, args.least)


if __name__ == '__main__':
    sys.exit(main())
