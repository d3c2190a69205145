# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Words in the headers of tables, English and German, and what a user may say about a table instead."""

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass, fields

from weld_twin_core.errors import DataError

EULER_ORDERS = ('XYZ', 'XZY', 'YXZ', 'YZX', 'ZXY', 'ZYX')
ROTATION_VECTOR = 'rotvec'
_CHOICES = {
    'delimiter': (',', ';', '\t'),
    'decimal': ('.', ','),
    'length_unit': ('m', 'mm', 'cm', 'um', 'in', 'ft'),
    'angle_unit': ('rad', 'deg'),
    'slide_unit': ('m', 'mm'),
    'rotation_unit': ('rad', 'deg'),
    'rotation': (*EULER_ORDERS, ROTATION_VECTOR),
    'difference': ('add', 'subtract'),
}
_LENGTHS = {
    'position_columns': (3,),
    'target_columns': (3,),
    'difference_columns': (3,),
    'rotation_columns': (3, 4),
    'sigma_columns': (1, 3),
}
"""How many columns each option may name."""


@dataclass(frozen=True)
class TableOptions:
    """Options of a table import; each is ``--name-with-dashes`` on the command line."""

    delimiter: str | None = None
    decimal: str | None = None
    joint_columns: tuple[str, ...] | None = None
    """In chain order."""
    position_columns: tuple[str, ...] | None = None
    """Measured x, y, z."""
    target_columns: tuple[str, ...] | None = None
    difference_columns: tuple[str, ...] | None = None
    """Commanded position and its difference, where no measured position is given."""
    difference: str = 'add'
    """'add': measured = target + difference; 'subtract': measured = target - difference."""
    rotation_columns: tuple[str, ...] | None = None
    """Three angles about x, y, z (or a rotation vector), or a quaternion x, y, z, w."""
    rotation: str | None = None
    """'XYZ' means R = Rx Ry Rz (intrinsic); 'ZYX' is roll-pitch-yaw; 'rotvec' a rotation
    vector."""
    length_unit: str | None = None
    angle_unit: str | None = None
    slide_unit: str | None = None
    rotation_unit: str | None = None
    """Of positions, joint angles, joints that slide, and measured angles."""
    sigma_columns: tuple[str, ...] | None = None
    """Standard deviation of the position, in its unit."""
    temperature_column: str | None = None
    time_column: str | None = None
    joint_signs: tuple[float, ...] | None = None
    """1 or -1 for every joint, where the controller counts it the other way than the model."""
    joint_offsets: tuple[float, ...] | None = None
    """Added to the columns, in the model's sense [deg, mm for a slide]."""
    coupled: str | None = None
    """'3+2': the model's joint 3 is the column of joint 3 plus that of joint 2, where a pendant
    counts joint 3 against the ground; '3-2' takes it off."""
    marker: str | None = None
    """Of an export that holds several things that were tracked."""
    positions_only: bool = False
    """Leave measured orientation out."""
    skip_rows: tuple[int, ...] = ()
    """Rows to leave out, the first under the header being 1."""

    def __post_init__(self) -> None:
        for item in fields(self):
            value, flag = getattr(self, item.name), flag_of(item.name)
            choices = _CHOICES.get(item.name)
            if value is not None and choices is not None and value not in choices:
                raise DataError(f'{flag} must be one of {", ".join(choices)}, got {value!r}')
            lengths = _LENGTHS.get(item.name)
            if value is not None and lengths is not None and len(value) not in lengths:
                wanted = ' or '.join(str(n) for n in lengths)
                raise DataError(f'{flag} needs {wanted} column names, got {len(value)}')


def flag_of(option: str) -> str:
    """Return how an option is called on the command line."""
    return '--' + option.replace('_', '-')


MEASURED = {
    'measurement', 'measured', 'measure', 'meas', 'messen', 'actual', 'act', 'tracker', 'laser',
    'real', 'observed', 'ist', 'istwert', 'gemessen', 'messung', 'mess', 'messwert', 'current',
    'feedback',
}  # fmt: skip
"""Before or after an axis: what an instrument saw, or an encoder."""
TARGET = {
    't', 'target', 'goal', 'nominal', 'nom', 'design', 'cmd', 'command', 'commanded', 'desired', 'set',
    'ref', 'soll', 'sollwert', 'vorgabe', 'nenn', 'programmed', 'planned',
}  # fmt: skip
DIFFERENCE = {
    'd', 'dif', 'diff', 'difference', 'delta', 'err', 'error', 'dev', 'deviation',
    'abweichung', 'differenz', 'fehler',
}  # fmt: skip
SIGMA = {
    'std', 'sigma', 'sd', 'stdev', 'stddev', 'uncertainty', 'unsicherheit', 'streuung',
}  # fmt: skip
NEUTRAL = {
    'pos', 'position', 'point', 'punkt', 'coordinate', 'koordinate', 'trans', 'translation', 'tcp',
    'reflector', 'reflektor', 'smr', 'probe', 'marker', 'ball', 'kugel', 'tool', 'werkzeug',
}  # fmt: skip
"""Words that say nothing on who measured."""
OWN = {'trans', 'tcp', 'robtarget'}
"""Words under which controllers store the pose that they compute themselves."""
JOINT = {
    'joint', 'joints', 'axis', 'theta', 'q', 'j', 'a', 'rax', 'robax', 'ax', 'rj',
    'achse', 'gelenk', 'winkel', 'angle', 'angles', 'pos', 'position',
}  # fmt: skip
"""Words of which one at least goes with the number of a joint, and none that is not here."""
EXTERNAL = {'e', 'eax', 'extax', 'ext', 'external', 'extern', 'zusatzachse'}
"""With a number or a letter from a to f: an axis beside the arm, such as a track."""
NAMES_A_JOINT = JOINT - {'angle', 'angles', 'winkel', 'pos', 'position'}
EFFORT = {'effort', 'efforts', 'torque', 'torques', 'tau', 'moment', 'drehmoment', 'moments'}
"""With a joint: what the controller measured that it bears."""
LETTERS = ('s', 'l', 'u', 'r', 'b', 't')
"""The joints of six-axis arms of Yaskawa."""
TURNS = {
    'rot', 'rotation', 'orient', 'orientation', 'orientierung', 'euler', 'rpy', 'angle', 'winkel',
}  # fmt: skip
"""With an axis: an angle about it."""
QUATERNION = {'quat', 'quaternion', 'q'}
ANGLES = {'roll': 'x', 'pitch': 'y', 'yaw': 'z'}
KUKA = {'a': 'z', 'b': 'y', 'c': 'x'}
"""Frames of KUKA: A about z, then B about y, then C about x."""
FANUC = {'w': 'x', 'p': 'y', 'r': 'z'}
"""Positions of FANUC: R about z, P about y, W about x."""
UNITS = {
    'm': 'm', 'meter': 'm', 'meters': 'm', 'mm': 'mm', 'cm': 'cm',
    'millimeter': 'mm', 'millimeters': 'mm',
    'rad': 'rad', 'radian': 'rad', 'radians': 'rad',
    'deg': 'deg', 'degree': 'deg', 'degrees': 'deg', '\N{DEGREE SIGN}': 'deg', 'grad': 'deg',
    's': 's', 'sec': 's', 'seconds': 's', 'sekunden': 's', 'ms': 'ms', 'us': 'us', 'ns': 'ns',
    '\N{DEGREE SIGN}c': 'degC', 'degc': 'degC', 'celsius': 'degC',
    'micrometer': 'um', 'micrometers': 'um', '\N{GREEK SMALL LETTER MU}m': 'um', 'micron': 'um',
    'inch': 'in', 'inches': 'in', 'zoll': 'in', 'mrad': 'mrad', 'kelvin': 'K',
    '\N{DEGREE SIGN}f': 'degF', 'degf': 'degF', 'fahrenheit': 'degF',
}  # fmt: skip
"""How units are written, and what this project calls them."""
IN_BRACKETS = {
    **UNITS, 'in': 'in', '"': 'in', 'k': 'K', 'f': 'degF', 'c': 'degC', '\'': 'ft', 'ft': 'ft',
    'um': 'um', 'min': 'min', 'h': 'h', 'msec': 'ms', '\N{GREEK SMALL LETTER MU}s': 'us',
    'n m': 'N m', 'nm': 'N m', 'n*m': 'N m', 'n.m': 'N m', 'n\N{MIDDLE DOT}m': 'N m',
    'n mm': 'N mm', 'nmm': 'N mm', 'n': 'N', '%': '%', 'percent': '%',
}  # fmt: skip
"""What is a unit between brackets alone, and may be a word of its own elsewhere."""
TEMPERATURE = re.compile(r'temp')
DATE = re.compile(r'^(date|datum)\b')
CLOCK = re.compile(r'time|stamp|zeit|^t$|^t\s*[\[(](?:s|ms|us|µs|ns|sec|min|h)[\])]$')
"""With a column of dates beside it: the time of day."""
_LISTED = 40
"""Names that fit into a message."""
_BRACKETS = re.compile(r'[\[(<{]([^\[\](){}<>]*)[\])>}]\s*$')


def tokens(name: str) -> list[str]:
    """Return the words and numbers of a header cell, in lower case; 'istX' is two words."""
    cut = re.sub(r'(?<=[a-zäöü])(?=[XYZ]\b)', ' ', _plain(name))
    return [t for t in re.split(r'[^0-9a-zäöüß\N{DEGREE SIGN}μ]+', cut.lower()) if t]


def parted(name: str) -> tuple[list[str], str | None]:
    """Return the words of a header cell without its unit, and the unit as this project has it."""
    result = bracketed(name)
    if result is not None:
        return tokens(result[0]), IN_BRACKETS[unit_word(result[1])]
    words = tokens(name)
    if len(words) > 1 and words[-1] in UNITS:
        return words[:-1], UNITS[words[-1]]
    return words, None


def bracketed(name: str) -> tuple[str, str] | None:
    """Return a header cell before its unit in brackets, and that unit; None where it has none."""
    result = _BRACKETS.search(name)
    if result is None or unit_word(result[1]) not in IN_BRACKETS:
        return None
    return name[: result.start()].strip(), result[1].strip()


def shortened(names: Sequence[str]) -> str:
    """Return names in a row, of very many the first."""
    more = len(names) - _LISTED
    return ', '.join(names[:_LISTED]) + (f' and {more:,} more' if more > 0 else '')


def unit_word(text: str) -> str:
    """Return a unit as the tables of units have it, without brackets."""
    return _plain(text).strip('[]() ').lower()


def _plain(text: str) -> str:
    """Return a text with one sign for the degree and one for the micro, of the several in use."""
    degrees = text.replace('\N{MASCULINE ORDINAL INDICATOR}', '\N{DEGREE SIGN}')
    return unicodedata.normalize('NFKC', degrees)
