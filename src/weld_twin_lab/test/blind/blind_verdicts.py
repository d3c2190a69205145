# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Truths and diagnoses written by hand."""


def truth(kind='single', causes=(), *, name='case_0001', ratios=None, alike=(), **more):
    """Return a truth about causes, each an entry of an effects file."""
    return {
        'name': name,
        'kind': kind,
        'robot': 'ur5',
        'motion': 'free',
        'causes': list(causes),
        'sites': [[cause['effect'], cause.get('joint')] for cause in causes],
        'alike': list(alike),
        'ratios': ratios or [5.0] * len(causes),
        **more,
    }


def offset(joint, size=1e-3):
    """Return a joint offset."""
    return {'effect': 'joint_offset', 'joint': joint, 'offset': size}


def diagnosis(status, *groups, confidence=0.9, effects=()):
    """Return what matters of a diagnosis: status and sets of (family, joint)."""
    return {
        'verdict': {
            'status': status,
            'confidence': confidence,
            'effects': list(effects),
            'indistinguishable': [
                [{'effect': family, 'joint': joint} for family, joint in group] for group in groups
            ],
        }
    }
