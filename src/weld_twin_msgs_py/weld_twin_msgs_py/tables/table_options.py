# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a user may say about a table; whatever is left out is read from it and reported."""

from __future__ import annotations

from dataclasses import dataclass, fields

from weld_twin_core.errors import DataError

EULER_ORDERS = ('XYZ', 'XZY', 'YXZ', 'YZX', 'ZXY', 'ZYX')
ROTATION_VECTOR = 'rotvec'
_CHOICES = {
    'delimiter': (',', ';', '\t'),
    'decimal': ('.', ','),
    'length_unit': ('m', 'mm'),
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
