# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Joints by the names that stand on the controller: A1 to A6, J1 to J6, or a user's own."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

import yaml

from weld_twin_core.errors import ModelError

_PREFIX = re.compile(r'[A-Za-z]{1,3}')


def joint_labels(reported: str, joints: Sequence[str]) -> dict[str, str]:
    """
    Return what each joint is called on the page.

    Parameters
    ----------
    reported : str
        A prefix such as ``A`` or ``J``, which the number of the joint follows, or a YAML file that
        gives a name to joints: ``shoulder_pan_joint: A1``. Empty for the names of the model.
    joints : sequence of str
        Of the model, in chain order.

    Raises
    ------
    ModelError
        It is neither, or the file names a joint that the robot does not have.

    """
    if not reported:
        return {}
    if _PREFIX.fullmatch(reported):
        return {name: f'{reported}{k}' for k, name in enumerate(joints, 1)}
    path = Path(reported)
    if not path.is_file():
        raise ModelError(
            f'--joint-names {reported}: give a prefix of one to three letters such as A, or a YAML '
            'file with a line "joint: name" for each joint'
        )
    content = yaml.safe_load(path.read_text(encoding='utf-8'))
    if not isinstance(content, dict):
        raise ModelError(f'{reported}: expected lines "joint: name", one for each joint')
    for name in content:
        if name not in joints:
            raise ModelError(
                f'{reported}: the robot has no joint {name!r}; it has {", ".join(joints)}'
            )
    return {str(name): str(label) for name, label in content.items()}


def renamed(markup: str, labels: Mapping[str, str]) -> str:
    """Return markup in which joints have their labels; other words are left alone."""
    if not labels:
        return markup
    by_name = {escape(name): escape(label) for name, label in labels.items()}
    longest = sorted(by_name, key=len, reverse=True)
    pattern = re.compile(rf'(?<![\w/.-])({"|".join(map(re.escape, longest))})(?![\w/-])')
    return pattern.sub(lambda match: by_name[match[1]], markup)
