# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Parameter values no node should take."""

from __future__ import annotations

from typing import Any

from .bench import Bench

BOMB = 'a: &a [x,x,x,x,x,x,x,x,x]\n' + ''.join(
    f'{b}: &{b} [*{a},*{a},*{a},*{a},*{a},*{a},*{a},*{a},*{a}]\n'
    for a, b in zip('abcdefgh', 'bcdefghi', strict=True)
)
ABUSES: tuple[tuple[str, str, Any], ...] = (
    ('forward_kinematics_twin', 'robot', 'ur10'),
    ('forward_kinematics_twin', 'effects', '[{effect: '),
    ('forward_kinematics_twin', 'effects', '[{effect: rust}]'),
    ('forward_kinematics_twin', 'effects', '!!python/object/apply:os.system ["true"]'),
    ('forward_kinematics_twin', 'effects', BOMB),
    ('forward_kinematics_twin', 'effects', '[' * 5000),
    ('forward_kinematics_twin', 'effects', 'x' * 1_000_000),
    ('forward_kinematics_twin', 'effects', '[{effect: time_delay, delay: .nan}]'),
    ('forward_kinematics_twin', 'effects', 7),
    ('error_injector', 'effects', '[{effect: measurement_noise, sigma: -1}]'),
    ('error_injector', 'effects', '[{effect: joint_offset, joint: knee, offset: 1}]'),
    ('error_injector', 'seed', 3),
    ('deviation_analyzer', 'buffer', -1),
    ('deviation_analyzer', 'metrics_every', 10**12),
    ('live_diagnosis', 'window', 'a minute'),
    ('recorder', 'out', '/etc/passwd'),
    ('deviation_markers', 'tolerance', 0.0),
    ('deviation_markers', 'use_sim_time', 'perhaps'),
)


def abuse(bench: Bench) -> list[dict[str, Any]]:
    """Set each value on the running nodes; return what each answered."""
    rows = []
    for node, name, value in ABUSES:
        answer = bench.cell.set_parameter(node, name, value)
        text = repr(value)
        rows.append(
            {
                'node': node,
                'parameter': name,
                'value': text if len(text) < 60 else f'{text[:40]}... ({len(text)} characters)',
                'refused': not answer.successful,
                'reason': answer.reason[:200],
            }
        )
        bench.run(0.2)
    return rows
