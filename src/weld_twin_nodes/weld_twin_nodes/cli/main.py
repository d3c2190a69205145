# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Finds the subcommand, runs it, and turns an error into one line."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec

from ..offline.environment import THREADS
from .options import add_command, short_help

USAGE_ERROR = 2
"""Exit code where the user can do something about it."""
INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells have it: 128 and the number of the signal."""
FIRST = ('diagnose', 'demo', 'import', 'info', 'predict', 'compensate', 'export')
"""What people come for, in the order of a first day; the list of commands begins with it."""
PAGES = (
    *('correct-program', 'demo', 'diagnose', 'fleet', 'history', 'investigate', 'iso9283'),
    *('sensitivity', 'serve', 'verify'),
)
"""What weld_twin_report brings, a file each; named here to say so where it is not installed."""
LAB = ('benchmark', 'blind', 'campaign', 'real-robots', 'lab')
"""The same of weld_twin_lab."""


def main(argv: Sequence[str] | None = None) -> int:
    """
    Run the command line.

    Returns
    -------
    int
        0 on success, 2 on a usage or input error, 3 where a diagnosis found data or set-up
        wrong, 130 when interrupted.

    """
    if argv is None:  # as a program: what it started ends with it, and nothing is loaded yet
        signal.signal(signal.SIGTERM, _end)
        for name in THREADS:
            os.environ.setdefault(name, '1')
    words = sys.argv[1:] if argv is None else list(argv)
    try:
        args = _parser(words).parse_args(words)
        return int(args.run(args))
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        sys.stderr.close()  # whoever read our output has gone; there is nobody to tell
        return 0
    except Exception as error:
        if not _expected(error):
            raise
        print(f'weld-twin: {_one_line(error)}', file=sys.stderr)
        return USAGE_ERROR


def _end(*_: object) -> None:
    """End as by Ctrl-C; what ends the processes that were started is not interrupted again."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise KeyboardInterrupt


def _commands() -> dict[str, str]:
    """Return the module of every subcommand, a file each: those of the product, then the proofs."""
    own = _modules('weld_twin_nodes', 'cli.commands')
    own |= _modules('weld_twin_report', 'cli.commands')
    return {
        **{name: own[name] for name in FIRST if name in own},
        **dict(sorted((name, own[name]) for name in own.keys() - set(FIRST))),
        **dict(sorted(_modules('weld_twin_lab', 'cli').items())),
    }


def _modules(package: str, folder: str) -> dict[str, str]:
    """Return the modules in a folder of a package by their subcommand; none if it is not installed."""
    found = find_spec(package)
    if found is None or not found.submodule_search_locations:
        return {}
    names = os.listdir(os.path.join(found.submodule_search_locations[0], *folder.split('.')))
    stems = [name[:-3] for name in names if name.endswith('.py') and name[0] != '_']
    return {stem.rstrip('_').replace('_', '-'): f'{package}.{folder}.{stem}' for stem in stems}


def _parser(words: Sequence[str]) -> argparse.ArgumentParser:
    """Return the parser; only the subcommand in use is loaded with its options."""
    parser = argparse.ArgumentParser(
        prog='weld-twin',
        description="Digital twin of a welding robot's positional accuracy.",
        epilog='weld-twin COMMAND --help tells more. Angles are rad, lengths m unless said.',
    )
    parser.add_argument('--version', action='version', version=_version())
    subparsers = parser.add_subparsers(required=True, metavar='COMMAND')
    commands = _commands()
    chosen = next((word for word in words if not word.startswith('-')), None)
    for kind, package, brought in (
        ('writes pages', 'weld_twin_report', PAGES),
        ('is a proof', 'weld_twin_lab', LAB),
    ):
        if chosen in brought and chosen not in commands:
            parser.error(
                f"'{chosen}' {kind}; it needs the package {package}, which is not installed"
            )
    if chosen in commands:
        module = import_module(commands[chosen])
        add_command(subparsers, chosen, module).set_defaults(run=module.run)
        return parser
    for name, module_name in commands.items():
        subparsers.add_parser(name, help=short_help(_docstring(module_name)))
    return parser


def _docstring(module_name: str) -> str:
    """Return the docstring of a module from its code, which is not run: a list of commands."""
    loader = getattr(find_spec(module_name), 'loader', None)
    code = loader.get_code(module_name) if loader else None
    return str(code.co_consts[0]) if code else ''


def _version() -> str:
    from weld_twin_core import __version__

    return f'weld-twin {__version__}'


def _expected(error: Exception) -> bool:
    """Tell whether the user can do something about it."""
    from weld_twin_core.errors import TwinError

    return isinstance(error, TwinError | OSError)


def _one_line(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        where = f" '{error.filename}'" if error.filename else ''
        return f'{error.strerror}{where}'
    return ' '.join(str(error).split())
