# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The sections of the sheet: each says in which part of the page it stands, and the page asks for all.

A section is a function from what it may draw from to markup, in a file of this folder:

    @on_page('answer', 45, words={'drift': 'what a joint does while nobody asks it to'})
    def drift_section(page: Content) -> Html | None: ...

Files whose name ends in ``_page`` are pages of their own and have no sections of this one.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_msgs_py.files.input_files import InputFile

from .answer import Answer
from .html import Html

PARTS = ('answer', 'checks', 'engineers', 'print', 'foot')
"""From top to bottom: what causes the gap and what to do, whether the data are sound, what is folded
away for who wants more, what a print alone has, and what it was made from."""


@dataclass(frozen=True)
class Demand:
    """What the reader demands of the robot."""

    tolerance_m: float | None = None  # largest deviation of the tool point allowed along the seam
    uncertainty_m: float | None = None
    """Standard uncertainty of a measured position, as the certificate of the instrument has it."""


@dataclass(frozen=True)
class Content:
    """What a section may draw from."""

    answer: Answer
    demand: Demand = field(default_factory=Demand)
    inputs: Sequence[InputFile] = ()
    judged: Html | None = None
    """The verdict on the tolerance, as the head of the page has it."""

    @property
    def diagnosis(self) -> Diagnosis:
        return self.answer.diagnosis


@dataclass(frozen=True)
class Section:
    """A section and its place."""

    part: str
    place: int
    name: str
    draw: Callable[[Content], Html | None]
    words: Mapping[str, str]


_SECTIONS: dict[str, Section] = {}
F = Callable[[Content], 'Html | None']


def on_page(part: str, place: int, words: Mapping[str, str] | None = None) -> Callable[[F], F]:
    """
    Return what puts a section in its place on the page; it draws nothing where it returns None.

    part: one of `PARTS`; 'answer' and 'engineers' are left out where the data are unsound.
    words: what its heads mean that the glossary has not.
    """
    if part not in PARTS:
        raise ValueError(f'the page has no part {part!r}, only {", ".join(PARTS)}')

    def keep(draw: F) -> F:
        _SECTIONS[draw.__name__] = Section(part, place, draw.__name__, draw, words or {})
        return draw

    return keep


@cache
def sections() -> tuple[Section, ...]:
    """Return the sections of all files, from top to bottom."""
    for file in iter_modules([str(Path(__file__).parent)]):
        if not file.name.endswith('_page'):
            import_module(f'.{file.name}', __package__)
    return tuple(sorted(_SECTIONS.values(), key=lambda s: (PARTS.index(s.part), s.place, s.name)))


def drawn(part: str, page: Content) -> list[Html | None]:
    """Return the sections of a part."""
    return [section.draw(page) for section in sections() if section.part == part]
