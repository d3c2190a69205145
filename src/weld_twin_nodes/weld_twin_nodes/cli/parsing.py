# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A parser whose ``--help`` fits on one screen: options that few need wait behind ``--help-all``."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from typing import Any


class Rare(str):
    """The help of an option that few need."""

    __slots__ = ()


class Adder:
    """
    Adds options to one group of a parser.

    Parameters
    ----------
    title : str, optional
        Heading of the group in the help; left out, the options are those of the command itself.
    rare : bool
        Whether the options are shown by ``--help-all`` alone.

    """

    def __init__(
        self, parser: argparse.ArgumentParser, title: str = '', *, rare: bool = False
    ) -> None:
        self._group = parser.add_argument_group(title) if title else parser
        self._rare = rare

    def __call__(self, *names: str, many: bool = False, rare: bool = False, **more: Any) -> None:
        """
        Add an option, a flag or a positional argument.

        Parameters
        ----------
        *names : str
            The name; of an option what its value is called, none for a flag; the help. As in
            ``add('--align', 'FRAMES', 'frames that are not known')``.
        many : bool
            The option may be given again; its values make a list.
        rare : bool
            The option is shown by ``--help-all`` alone.
        **more
            As `argparse` takes them.

        """
        name, *metavar, text = names
        kind: dict[str, Any] = {}
        if metavar:
            kind['metavar'] = metavar[0] if len(metavar) == 1 else tuple(metavar)
        if len(metavar) > 1:
            kind['nargs'] = len(metavar)
        if many:
            kind |= {'action': 'append', 'default': []}
        elif name.startswith('-') and not metavar and 'choices' not in more:
            kind['action'] = 'store_true'
        shown = text.replace('{default}', _number(more.get('default')))
        kind['help'] = Rare(shown) if rare or self._rare else shown
        self._group.add_argument(name, **kind | more)


def _number(value: object) -> str:
    return f'{value:g}' if isinstance(value, float) else str(value)


class Parser(argparse.ArgumentParser):
    """
    A parser with a short help, a long one and an example.

    Attributes
    ----------
    example : str
        A whole command line; empty where there is none.

    """

    def __init__(self, **more: Any) -> None:
        super().__init__(**more | {'add_help': False})
        self.example = ''
        hidden: dict[str, Any] = {
            'nargs': 0,
            'help': argparse.SUPPRESS,
            'default': argparse.SUPPRESS,
        }
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

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        option_string: str | None = None,
    ) -> None:
        assert isinstance(parser, Parser)
        print(parser.format_help(everything=option_string == '--help-all'), end='')
        parser.exit()


def short_help(docstring: str) -> str:
    """Return the first line of a docstring, as a list of subcommands shows it."""
    return re.sub(r'\.$', '', docstring.strip().partition('\n')[0]).replace('%', '%%')
