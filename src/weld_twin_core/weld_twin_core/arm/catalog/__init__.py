# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Bundled robots, a file each, with the source of its numbers.

They are robot files as users write them: YAML, in the form that JSON has in common with it, so that
the core reads them without a library for YAML. A comment begins with ``#`` at the start of a line or
after a blank.

Examples
--------
>>> import weld_twin_core as wt
>>> wt.catalog.names()[:3]
('ur5', 'ur10', 'kuka_kr6_r900')
>>> wt.catalog.load('ur5').source[:16]
'Universal Robots'

"""

from __future__ import annotations

import json
import re
from importlib.resources import files

from ...errors import ModelError
from ..robot import Robot

_NAMES = (
    *('ur5', 'ur10', 'kuka_kr6_r900', 'abb_irb120', 'abb_irb1600', 'fanuc_m10ia', 'franka_panda'),
    *('ur3e', 'ur5e', 'ur10e', 'ur16e', 'ur20'),
    *('yaskawa_ma1440', 'yaskawa_ma2010', 'yaskawa_ar2010', 'fanuc_m10id12', 'fanuc_m20id25'),
    *('abb_irb2600_12_165', 'abb_irb4600_40_255', 'staubli_tx2_90l', 'kuka_iiwa14'),
    *('kuka_kr16_2', 'kuka_kr16_r1610_2', 'mecademic_meca500'),
)
"""The files, in the order in which arms are listed and drawn; a new one comes last."""
_COMMENT = re.compile(r'(?m)(?:^|\s)#.*$')


def names() -> tuple[str, ...]:
    """Return the names that `load` takes."""
    return _NAMES


def load(name: str) -> Robot:
    """
    Return a bundled robot.

    Parameters
    ----------
    name : str
        One of `names`.

    Raises
    ------
    ModelError
        There is no such robot; the message lists those there are.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> robot = wt.load('kuka_kr6_r900')
    >>> robot.n, robot.joint_names[0]
    (6, 'joint_a1')

    """
    if name not in _NAMES:
        raise ModelError(f'no bundled robot is called {name!r}; there are ' + ', '.join(_NAMES))
    text = (files(__package__) / f'{name}.yaml').read_text('utf-8')
    return Robot.from_mapping(json.loads(_COMMENT.sub('', text)))
