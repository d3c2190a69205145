# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which effects could not be tried: nothing that is said of alternatives holds for them."""

from __future__ import annotations

from weld_twin_core.diagnosis.hypotheses.library import EXCLUDED
from weld_twin_core.diagnosis.hypotheses.still_joints import REASON
from weld_twin_core.diagnosis.result import Candidate, Diagnosis
from weld_twin_core.effects import REGISTRY
from weld_twin_nodes.wording.words import cause, listed, not_to_be_tried

_KINDS = 4
"""Kinds of effects told; more are counted."""


def reason_and_joints(why: str, diagnosis: Diagnosis) -> tuple[str, list[str]]:
    """Return why an effect is absent, and the joints that the reason ends with."""
    reason, _, last = why.rpartition(' (')
    joints = last.rstrip(')').split(', ')
    if set(joints) <= set(diagnosis.model.robot.joint_names):
        return reason, joints
    return why, []


def untried(diagnosis: Diagnosis) -> str:
    """Return what could not be tried, and what would have to move for it; nothing where all was."""
    still: dict[str, list[str]] = {}
    for effect, why in sorted(diagnosis.absent.items()):
        reason, joints = reason_and_joints(why, diagnosis)
        # Of a coupling it is the joint beside that hardly moves; other effects name that one.
        beside = 'source' in getattr(REGISTRY.get(effect), 'options', ())
        for joint in joints if reason == REASON and not beside else ():
            still.setdefault(joint, []).append(cause(effect, None))
    asked = listed(not_to_be_tried(diagnosis))
    reported = []
    if still:
        joints = [name for name in diagnosis.model.robot.joint_names if name in still]
        kinds = list(dict.fromkeys(kind for joint in joints for kind in still[joint]))
        more = [f'{len(kinds) - _KINDS} more'] if len(kinds) > _KINDS else []
        what = listed([*kinds[:_KINDS], *more])
        one = len(joints) == 1
        reported.append(
            f'{listed(joints)} hardly {"moves" if one else "move"}, so {what} could not be tried '
            f'there: only a recording in which {"it moves" if one else "they move"} can.'
        )
    if asked:
        verb = 'was' if len(not_to_be_tried(diagnosis)) == 1 else 'were'
        reported.append(f'{asked[:1].upper()}{asked[1:]} {verb} not tried, as asked.')
    return ' '.join(reported)


def weighed(diagnosis: Diagnosis) -> tuple[Candidate, ...]:
    """Return the candidates without those of effects that were asked to be left out."""
    absent = diagnosis.absent
    return tuple(c for c in diagnosis.candidates if absent.get(c.site.effect) != EXCLUDED)
