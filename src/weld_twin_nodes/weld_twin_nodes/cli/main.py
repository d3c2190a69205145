# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Finds the subcommand, runs it, and turns an error into one line."""

from __future__ import annotations

import argparse
import gc
import os
import signal
import sys
from collections.abc import Sequence
from functools import partial
from importlib import import_module
from importlib.util import find_spec

from weld_twin_core import __version__
from weld_twin_core.errors import TwinError

from ..offline.environment import THREADS
from .parsing import Command, Parser, add_command, short_help

USAGE_ERROR = 2
"""Exit code where the user can do something about it."""
INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells have it: 128 and the number of the signal."""
NODES, REPORT = 'weld_twin_nodes.cli.commands', 'weld_twin_report.cli.commands'
COMMANDS = {
    **dict.fromkeys(('diagnose', 'investigate', 'correct', 'verify'), REPORT),
    **dict.fromkeys(('simulate', 'detect', 'import', 'bag', 'export'), NODES),
    **dict.fromkeys(('history', 'iso9283', 'sensitivity', 'serve', 'demo'), REPORT),
    'lab': 'weld_twin_lab.cli',
}
"""Commands in the order of the help, and the package whose `ROWS` say what each takes."""
BEFORE = ('detect',)
"""Commands that make what another takes; the help of that one tells of them."""
BRINGS = {'weld_twin_report': 'writes pages', 'weld_twin_lab': 'is a proof'}
"""What the commands of a package do, for somebody who has not installed it."""
OLD = {
    'info': 'bag info',
    'recover': 'bag recover',
    'play': 'bag play',
    'predict': 'simulate',
    'compensate': 'correct',
    'correct-program': 'correct',
    'export-program': 'export program',
    'policy': 'export policy',
    'schema': 'export schema',
    'plan-measurement': 'investigate',
    'fleet': 'history',
    'blind': 'lab blind',
    'real-robots': 'lab real-arms',
    'benchmark': 'lab benchmark',
    'campaign': 'lab campaign',
}
"""Old spellings of commands, and what they are called now; they work for one release more."""
HELP = ('-h', '--help', '--help-all')
GARBAGE = 100_000
"""Objects made until Python looks for garbage; it would after 700, and a diagnosis makes millions that
stay: a fifteenth of its time."""


def main(argv: Sequence[str] | None = None) -> int:
    """
    Run the command line.

    Return 0 on success, 2 on a usage or input error, 3 where a diagnosis found data or set-up
    wrong, 4 where a correction did not keep its promise, 130 when interrupted.
    """
    if argv is None:  # as a program: what it started ends with it, and nothing is loaded yet
        signal.signal(signal.SIGTERM, _end)
        gc.set_threshold(GARBAGE)
        for name in THREADS:
            os.environ.setdefault(name, '1')
    words = sys.argv[1:] if argv is None else list(argv)
    try:
        args = parser_of(words).parse_args(renamed(words))
        code = int(args.run(args))
        typed = _command(words)
        if typed in OLD:
            print(
                f"weld-twin: '{typed}' is 'weld-twin {OLD[typed]}' now; the old name goes with the next "
                'release',
                file=sys.stderr,
            )
        return code
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        sys.stderr.close()  # whoever read our output has gone; there is nobody to tell
        return 0
    except (TwinError, OSError) as error:  # what the user can do something about
        print(f'weld-twin: {_one_line(error)}', file=sys.stderr)
        return USAGE_ERROR
    except MemoryError:
        if argv is not None:  # whoever called it says what it was allowed
            raise
        said = 'there is too little memory for this; free some, or give less at once'
        print(f'weld-twin: {said}', file=sys.stderr)
        return USAGE_ERROR


def _end(*_: object) -> None:
    """End as by Ctrl-C; what ends the processes that were started is not interrupted again."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise KeyboardInterrupt


def _command(words: Sequence[str]) -> str:
    """Return the first word that is no option: the command as it was typed."""
    return next((word for word in words if not word.startswith('-')), '')


def renamed(words: Sequence[str]) -> list[str]:
    """Return the words with the command as it is called now, and with the job that is meant."""
    typed = _command(words)
    if not typed:
        return list(words)
    at = list(words).index(typed)
    out = [*words[:at], *OLD.get(typed, typed).split(), *words[at + 1 :]]
    if out[at] in COMMANDS and len(out) > at + 1:
        command = _row(out[at])
        if command.usual and out[at + 1] not in (*HELP, *command.jobs):
            out.insert(at + 1, command.usual)
    return out


def parser_of(words: Sequence[str] = ()) -> Parser:
    """Return the parser, the options loaded of the command in use alone, for words as typed."""
    parser = Parser(
        prog='weld-twin',
        description="Digital twin of a welding robot's positional accuracy.",
        epilog='weld-twin COMMAND --help tells more. Angles are rad, lengths m unless said.',
    )
    parser.add_argument(
        '--version', action='version', version=f'weld-twin {__version__}', help=argparse.SUPPRESS
    )
    subparsers = parser.add_subparsers(required=True, metavar='COMMAND', title='commands')
    typed = _command(words)
    chosen = OLD.get(typed, typed).partition(' ')[0]
    package = COMMANDS.get(chosen, '').partition('.')[0]
    if package and not _installed(package):
        parser.error(
            f"'{typed}' {BRINGS[package]}; it needs the package {package}, which is not installed"
        )
    for name in [chosen] if package else [name for name in COMMANDS if name not in BEFORE]:
        if _installed(COMMANDS[name].partition('.')[0]):
            _add(subparsers, name, chosen)
    return parser


def _add(subparsers: argparse._SubParsersAction[Parser], name: str, chosen: str) -> None:
    """Add a command; those that are not in use are listed only."""
    command = _row(name)
    if name != chosen:
        subparsers.add_parser(name, help=short_help(command.text))
        return
    parser = add_command(subparsers, name, command)
    parser.set_defaults(run=partial(_run, name, 'run'))
    if command.jobs:
        places = parser.add_subparsers(required=True, metavar='JOB', title='jobs')
        for word, job in command.jobs.items():
            add_command(places, word, job).set_defaults(run=partial(_run, name, word))


def _row(name: str) -> Command:
    row: Command = import_module(COMMANDS[name]).ROWS[name]
    return row


def _run(name: str, job: str, args: argparse.Namespace) -> int:
    """Run a command, or one of its jobs."""
    from .given import Given

    module = import_module(f'{COMMANDS[name]}.{name}{"_" * (name == "import")}')
    return int(getattr(module, job)(Given(**vars(args))))


def _installed(package: str) -> bool:
    return find_spec(package) is not None


def _one_line(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        where = f" '{error.filename}'" if error.filename else ''
        return f'{error.strerror}{where}'
    return ' '.join(str(error).split())
