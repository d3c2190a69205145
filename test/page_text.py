# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A page as lines of text: what is read, what its scripts are given, and how long its bars are."""

import json
import re
from html.parser import HTMLParser
from typing import Any

import numpy as np

INLINE = {'b', 'span', 'strong', 'i', 'a', 'small', 'label', 'em', 'code', 'sub', 'sup', 'abbr'}
SHOWN = {'style', 'hidden', 'open', 'checked', 'href', 'width', 'height', 'd', 'points'}
SHOWN |= {'transform'}
LONG, NOTHING = 6, 1e-9
"""Items of a list from which on sums stand for them, and a size that is rounding."""


class _Text(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.lines, self.line, self.inside = [], '', ''

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.inside = '' if tag not in ('style', 'script') else given.get('type') or tag
        if tag not in INLINE:
            self.end()
        kept = [
            f'{key}={value}'
            for key, value in given.items()
            if value and (key in SHOWN or key.startswith('data-')) and len(value) < 200
        ]
        self.line += f'[{" ".join(kept)}]' if kept else ''

    def handle_endtag(self, tag: str) -> None:
        self.inside = ''
        self.end() if tag not in INLINE else None

    def handle_data(self, data: str) -> None:
        if self.inside == 'application/json':
            self.end()
            self.lines += [f'{at} {value}' for at, value in flat(json.loads(data), '') if value]
        elif not self.inside:
            self.line += data

    def end(self) -> None:
        told = re.sub(r'\s+', ' ', self.line).strip()
        self.lines += [told] if told else []
        self.line = ''


def page_text(page: str) -> str:
    """Return a page as lines of text."""
    reader = _Text()
    reader.feed(page)
    reader.end()
    return '\n'.join(reader.lines) + '\n'


def flat(value: Any, at: str) -> list[tuple[str, Any]]:
    """
    Return the single values in lists and mappings, each with its place.

    Of long lists of numbers two sums stand for them; rows of one kind are told column by column.
    """
    if isinstance(value, dict):
        return [one for key, own in value.items() for one in flat(own, f'{at}/{key}')]
    if isinstance(value, list | tuple) and len(value):
        if len(value) >= LONG and all(
            isinstance(row, dict) and row.keys() == value[0].keys() for row in value
        ):
            return flat({key: [row[key] for row in value] for key in value[0]}, at)
        if len(value) >= LONG and all(isinstance(own, str) for own in value):
            return [(at, ', '.join(value))]
        try:
            numbers = np.asarray(value, float).ravel()
        except (TypeError, ValueError):
            numbers = np.zeros(0)
        if numbers.size < LONG:
            return [one for k, own in enumerate(value) for one in flat(own, f'{at}/{k}')]
        numbers = np.nan_to_num(numbers)
        weighed = numbers @ np.cos(np.arange(numbers.size) ** 2)
        return [(at, f'{numbers.size} {_told(np.linalg.norm(numbers))} {_told(weighed)}')]
    return [(at, _told(value) if isinstance(value, float) else value)]


def _told(value: float) -> str:
    """Return a number with the digits that every machine gives; what is nothing but rounding is 0."""
    return f'{value:.4g}' if abs(value) > NOTHING else '0'
