# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The table of languages: which there are, how a file tells its own, who reads it."""

import re
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from weld_twin_core.errors import DataError

from .build import Program
from .controllers import Context
from .fanuc_ls import FanucReader
from .inform import InformReader
from .joint_points import CSV_POSE, CsvReader, TrajectoryReader
from .krl import KrlReader
from .rapid import RapidReader
from .reader import Reader
from .source import (
    ABB_POSE,
    FANUC_POSE,
    KUKA_POSE,
    UR_POSE,
    YASKAWA_POSE,
    Notation,
    Source,
    masked,
    read_source,
)
from .urscript import UrscriptReader


class Language(NamedTuple):
    maker: str
    extensions: tuple[str, ...]  # in lower case, with the point
    signs: str  # a regular expression that only programs of this language hold
    reader: type[Reader]
    pose: Notation  # how it writes a pose
    beside: tuple[str, ...] = ()
    """Extensions of files that belong to a program and lie beside it."""
    last: tuple[str, ...] = ()
    """Words of which one is the last line that says something; none where a program has no end."""
    remark: str = '# {}'
    """How it writes a remark, with {number} where it numbers its lines."""
    before: str = r'\Z'
    """A regular expression of the line before which one may stand, behind all moves."""


LANGUAGES: dict[str, Language] = {
    'urscript': Language(
        'Universal Robots', ('.script', '.urscript'), r'\bmove[jlpc]\s*\(', UrscriptReader, UR_POSE
    ),
    'krl': Language(
        'KUKA',
        ('.src',),
        r'(?im)^\s*(?:GLOBAL\s+)?DEF\s+\w+\s*\(',
        KrlReader,
        KUKA_POSE,
        ('.dat',),
        ('END', 'ENDFCT'),
        '; {}',
        r'^[ \t]*END(?:FCT|DAT)?\s*\Z',
    ),
    'inform': Language(
        'Yaskawa',
        ('.jbi',),
        r'(?m)^/JOB\b',
        InformReader,
        YASKAWA_POSE,
        (),
        ('END',),
        "'{}",
        r'^[ \t]*END\s*\Z',
    ),
    'fanuc-ls': Language(
        'FANUC',
        ('.ls',),
        r'(?m)^/PROG\b',
        FanucReader,
        FANUC_POSE,
        (),
        ('/END',),
        '{number:4d}:  !{} ;',
        r'^/POS\b',
    ),
    'joint-trajectory': Language(
        'ROS', ('.yaml', '.yml', '.json'), r'\bjoint_names\b', TrajectoryReader, CSV_POSE
    ),
    'csv': Language('any', ('.csv',), r'\A(?:\s*#[^\n]*\n)*[\w" \[\]]+,', CsvReader, CSV_POSE),
    'rapid': Language(
        'ABB',
        ('.mod', '.prg', '.modx'),
        r'(?im)^\s*MODULE\s+\w+|^\s*PROC\s+\w+',
        RapidReader,
        ABB_POSE,
        (),
        ('ENDMODULE',),
        '! {}',
        r'^[ \t]*ENDMODULE\s*\Z',
    ),
}
"""By the names that ``--controller`` takes."""


def language_of(source: Source, path: Path | str, controller: str = '') -> str:
    """Return the name of a program's language, as the user named it, or as the file tells."""
    known = ', '.join(LANGUAGES)
    if controller:
        if controller not in LANGUAGES:
            raise DataError(
                f'--controller: there is no language {controller!r}; known are {known}'
            )
        return controller
    suffix = Path(path).suffix.lower()
    by_name = [name for name, one in LANGUAGES.items() if suffix in one.extensions]
    by_text = [name for name, one in LANGUAGES.items() if re.search(one.signs, source.text)]
    both = [name for name in by_name if name in by_text] or by_name or by_text
    if len(both) != 1:
        raise DataError(
            f"'{path}' does not tell its language; name it with --controller, one of {known}"
        )
    return both[0]


def read_program(path: Path | str, context: Context, controller: str = '') -> Program:
    """Return a program with the files that belong to it; its language as of `language_of`."""
    source = read_source(path)
    name = language_of(source, path, controller)
    _refuse_cut(source, LANGUAGES[name])
    place, beside = Path(path), []
    for extension in LANGUAGES[name].beside:
        result = [
            other
            for other in sorted(place.parent.glob('*'))
            if other.stem.lower() == place.stem.lower() and other.suffix.lower() == extension
        ]
        if len(result) > 1:
            raise DataError(
                f"'{result[0]}' and '{result[1].name}' both belong to {source.name}: nobody knows which "
                'of them the controller has; move one away'
            )
        beside += [read_source(other) for other in result]
    return read_sources([source, *beside], context, name)


def programs_beside(path: Path | str, name: str) -> tuple[Source, ...]:
    """Return the other programs of a folder in a language of the table that can be read."""
    out = []
    for other in sorted(Path(path).parent.iterdir()):
        if other.suffix.lower() in LANGUAGES[name].extensions and other.name != Path(path).name:
            with suppress(DataError):
                out.append(read_source(other))
    return tuple(out)


def _refuse_cut(source: Source, language: Language) -> None:
    """Refuse a program whose last line that says something is not its end."""
    said = masked(source.text, language.reader.comments).rstrip('\x1a \t\r\n')
    if language.last and said.rpartition('\n')[2].strip().upper() not in language.last:
        raise DataError(
            f'{source.where(len(source.text.rstrip()) - 1)}: the program does not end with '
            f'{language.last[0]}; is the file cut off?'
        )


MARK = 'corrected by weld_twin'
"""Remark of a file whose points a correction moved: a FANUC has room for 32 letters."""
_END = '\x1a \t\r\n'
_COUNT = re.compile(r'^(LINE_COUNT[ \t]*=[ \t]*)\d+', re.M)
"""Of the numbered lines of a FANUC program."""


def marked(source: Source, name: str) -> Source:
    """Return a file that a correction changed, with the remark; that of JSON is its frame_id."""
    text, language = source.text, LANGUAGES[name]
    if text.lstrip().startswith('{'):
        return Source(source.name, _named_frame(text))
    said = masked(text, language.reader.comments).rstrip(_END)
    found = re.search(language.before, said, re.I | re.M)
    place = found.start() if found and found[0] else len(text.rstrip('\x1a'))
    head, rest = text[:place], text[place:]
    end = '\r\n' if '\r\n' in text else '\n'
    number = max(map(int, re.findall(r'^[ \t]*(\d+):', head, re.M)), default=0) + 1
    if name == 'fanuc-ls':
        head = _COUNT.sub(rf'\g<1>{number}', head)
    gap = '' if head.endswith('\n') else end
    return Source(
        source.name, head + gap + language.remark.format(MARK, number=number) + end + rest
    )


def _named_frame(text: str) -> str:
    """Return a trajectory in JSON with the remark in the header, where no controller reads it."""
    for pattern, added in (
        (r'"frame_id"\s*:\s*"(?=")', MARK),
        (r'"frame_id"\s*:\s*"', f'{MARK}; '),
        (r'"header"\s*:\s*\{(?=\s*")', f'"frame_id": "{MARK}", '),
        (r'(?="joint_names"\s*:\s*\[\s*")', f'"header": {{"frame_id": "{MARK}"}}, '),
    ):
        found = re.search(pattern, text)
        if found is not None:
            return text[: found.end()] + added + text[found.end() :]
    return text


def refuse_marked(sources: Sequence[Source]) -> None:
    """Refuse a program with a file whose points a correction moved, wherever it comes from."""
    for source in sources:
        place = source.text.lower().find(MARK)
        if place >= 0:
            raise corrected_twice(source.name, f'{source.where(place)} says so')


def corrected_twice(name: str, why: str) -> DataError:
    """Return that a program was corrected already, and how that is known."""
    return DataError(
        f"'{name}' was corrected already: {why}; give the program as it was before, or its points "
        'are moved twice'
    )


def read_sources(sources: Sequence[Source], context: Context, name: str) -> Program:
    """Return the program of texts in a language of the table."""
    program = LANGUAGES[name].reader(sources, context).read()
    program.language = name
    program.hold_silent()
    return program
