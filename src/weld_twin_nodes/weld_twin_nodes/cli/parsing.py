# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Options from tables of help, and a parser whose ``--help`` fits on one screen.

A table has a row for each option: what is typed, two spaces or more, and what it does. What has to
be known besides stands in the row, where a reader sees it::

    BAG ...                recordings, one or more; [BAG ...] may be none, [BAG] one or none
    --robot R, required    which robot
    how it was measured:
    --setup N              which recording of the diagnosis [default: 1]
    --holdout BAG          not fitted, but judged on; may be given again
    --topics TOPIC ...     play only these
    --unit {m,mm}          of lengths
    --clock [HZ=100]       the number counts where the option stands alone
    --apply                correct what is wrong; a switch, for it takes no value
    rare:
    --wait S               rows from here to the next heading are shown by --help-all alone

What is not given is None where a number, a list of values or a choice is read, an empty list where
several may be given, and else an empty text.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

Options = str | Callable[[argparse.ArgumentParser], None]
"""A table of options, or a function that adds some by itself."""
RARE = 'rare'
AGAIN = 'may be given again'
_DEFAULT = re.compile(r'\[default: (.*?)\]')
_INTEGERS = ('N', 'NANOS')
_NUMBERS = (
    *('S', 'HZ', 'MIN', 'M', 'MM', 'M/S', 'GB', 'DEG', 'DEGC'),
    *('X', 'Y', 'Z', 'RX', 'RY', 'RZ'),
)


class Command(NamedTuple):
    """A command, or a job of one, as a row of a table."""

    text: str  # its help; the first line is what the list of commands says of it
    example: str = ''  # a whole command line
    options: tuple[Options, ...] = ()
    jobs: Mapping[str, Command] = {}  # by name; none of a command that does one thing
    usual: str = ''  # the job that is meant where none is named


class Rare(str):
    """The help of an option that few need."""

    __slots__ = ()


def texts(text: str) -> tuple[str, ...]:
    """Return texts with commas between."""
    return tuple(part.strip() for part in text.split(','))


def floats(text: str) -> tuple[float, ...]:
    """Return numbers with commas between."""
    return tuple(float(part) for part in text.split(','))


def integers(text: str) -> tuple[int, ...]:
    """Return whole numbers with commas between."""
    return tuple(int(part) for part in text.split(','))


def robot_file(spec: str) -> str:
    """Return the file of a robot of one's own that is named; what else was given as it is."""
    from weld_twin_msgs_py.robots.load import as_file

    return as_file(spec)


READ: dict[str, Callable[[str], Any]] = {
    **dict.fromkeys(_INTEGERS, int),
    **dict.fromkeys(_NUMBERS, float),
    'A,B,C': texts,
    'N,N': integers,
    '1,-1,...': floats,
    'DEG,DEG,...': floats,
    'R': robot_file,
}
"""How a value is read, by what the help calls it; all others are texts."""


def names_of(*tables: str) -> list[str]:
    """Return the attributes that the options of tables are read into."""
    typed = [typed.split()[0] for table in tables for typed, text in _rows(table) if text]
    return [name.strip('-').replace('-', '_') for name in typed if name.startswith('-')]


def add_command(places: Any, name: str, command: Command) -> Parser:
    """Add a command to what ``add_subparsers`` returned."""
    text = command.text.strip()
    parser: Parser = places.add_parser(name, help=short_help(text), description=text)
    parser.example = command.example
    add_options(parser, *command.options)
    return parser


def add_options(parser: argparse.ArgumentParser, *parts: Options) -> None:
    """Add the options of tables, each of which begins outside any group."""
    for part in parts:
        if callable(part):
            part(parser)
            continue
        group: Any = parser
        rare = False
        for typed, text in _rows(part):
            if text:
                _add(group, typed, text, rare)
            elif typed == RARE:
                rare = True
            else:
                group, rare = parser.add_argument_group(typed), False


def _rows(table: str) -> Iterator[tuple[str, str]]:
    """Yield what is typed and what it does; of a heading its words, and nothing."""
    # What is indented goes on with the row above.
    for row in re.sub(r'\n +(?=\S)', ' ', table).splitlines():
        typed, _, text = row.partition('  ')
        if typed:
            yield typed if text else typed.removesuffix(':'), text.strip()


def _add(group: Any, typed: str, text: str, rare: bool) -> None:
    name, *values = typed.removesuffix(', required').split()
    more: dict[str, Any] = {'required': True} if typed.endswith(', required') else {}
    if not name.startswith('-'):
        name, more = _positional(name, values)
    elif not values:
        more['action'] = 'store_true'
    else:
        more |= _value(values, again=AGAIN in text)
    usual = _DEFAULT.search(text)
    if usual:
        more['default'] = more.get('type', str)(usual[1])
        text = _DEFAULT.sub(r'(default: \1)', text)
    group.add_argument(name, help=Rare(text) if rare else text, **more)


def _positional(name: str, values: Sequence[str]) -> tuple[str, dict[str, Any]]:
    """Return the attribute of a positional argument, and how it is read."""
    shown = name.strip('[]')
    many, left_out = bool(values), name.startswith('[')
    more: dict[str, Any] = {'metavar': shown}
    if many:
        more['nargs'] = '*' if left_out else '+'
    elif left_out:
        more |= {'nargs': '?', 'default': ''}
    return re.split(r'[.|]', shown)[0].lower(), more


def _value(values: Sequence[str], *, again: bool) -> dict[str, Any]:
    shown = values[0]
    if shown.startswith('{'):
        return {'choices': tuple(shown.strip('{}').split(','))}
    if shown.startswith('['):
        shown, _, alone = shown.strip('[]').partition('=')
        return {'metavar': shown, 'nargs': '?', 'type': READ[shown], 'const': READ[shown](alone)}
    read = READ.get(shown)
    more: dict[str, Any] = {'metavar': shown, 'default': None if read else ''}
    if read:
        more['type'] = read
    if values[1:] == ['...']:
        more |= {'action': 'extend', 'nargs': '+', 'default': []}
    elif len(values) > 1:
        more |= {'metavar': tuple(values), 'nargs': len(values)}
    if again:
        more |= {'action': 'append', 'default': []}
    return more


class Parser(argparse.ArgumentParser):
    """A parser with a short help, a long one and, where there is one, an example."""

    def __init__(self, **more: Any) -> None:
        super().__init__(**more | {'add_help': False})
        self.example = ''
        # Several numbers may begin with a sign as one may: --joint-offsets -90,0,... is no option.
        self._negative_number_matcher = re.compile(r'^-\.?\d')
        hidden: dict[str, Any] = {'nargs': 0} | dict.fromkeys(
            ('help', 'default'), argparse.SUPPRESS
        )
        self.add_argument('-h', '--help', action=_Help, **hidden)
        self.add_argument('--help-all', action=_Help, **hidden)

    def format_help(self, *, everything: bool = False) -> str:
        """Return the help; what few need is left out unless ``everything`` is wanted."""
        formatter = self._get_formatter()
        for paragraph in (self.description or '').split('\n\n'):
            formatter.add_text(' '.join(paragraph.split()))
        for group in self._action_groups:
            formatter.start_section(group.title)
            for action in group._group_actions:
                if everything or not isinstance(action.help, Rare):
                    jobs: Any = isinstance(action, argparse._SubParsersAction) and action
                    formatter.add_arguments(jobs._get_subactions() if jobs else [action])
            formatter.end_section()
        left_out = 0 if everything else sum(isinstance(a.help, Rare) for a in self._actions)
        end = [f'example: {self.example}'] if self.example else []
        end += [f'--help-all shows {left_out} options more.'] if left_out else []
        end += [self.epilog] if self.epilog else []
        return '\n'.join([self.format_usage(), formatter.format_help(), *end, ''])

    def format_usage(self) -> str:
        """Return what has to be given, and that there are options."""
        words = [_place(action) for action in self._actions if not action.option_strings]
        for action in self._actions:
            if action.option_strings and action.required:
                names = action.metavar or action.dest.upper()
                names = names if isinstance(names, str) else ' '.join(names)
                words.append(f'{action.option_strings[-1]} {names}')
        optional = any(a.option_strings and not a.required for a in self._actions[2:])
        return ' '.join([f'usage: {self.prog}', *words, *(['[OPTION ...]'] * optional)]) + '\n'


def _place(action: argparse.Action) -> str:
    """Return a positional argument as the usage shows it."""
    name = str(action.metavar or action.dest)
    if isinstance(action, argparse._SubParsersAction):
        return f'{name} ...'
    shapes = {'?': f'[{name}]', '*': f'[{name} ...]', '+': f'{name} [{name} ...]'}
    return shapes.get(str(action.nargs), name)


class _Help(argparse.Action):
    """Print the help and end."""

    def __call__(self, parser: Any, _: Any, values: Any, option_string: str | None = None) -> None:
        print(parser.format_help(everything=option_string == '--help-all'), end='')
        parser.exit()


def short_help(docstring: str) -> str:
    """Return the first line of a docstring, as a list of subcommands shows it."""
    return re.sub(r'\.$', '', docstring.strip().partition('\n')[0]).replace('%', '%%')
