# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Poses through a compensator, beside a relay that copies them, at one beat in one run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from weld_twin_core.arm import catalog
from weld_twin_msgs_py.files.yaml_file import yaml_text
from weld_twin_msgs_py.messages.cdr_write import JointStateEncoder
from weld_twin_msgs_py.messages.topics import JOINT_STATES, POSE_OUT

from ..live.latency_race import Contender, Race
from ..live.pulse import BEAT, HOME, ROBOT

ARM = '/race/arm'
"""Where the arm's joint states are told."""
CAUSES = (
    {'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': 4e-4},
    {'effect': 'link_twist', 'joint': 'elbow_joint', 'dalpha': 4e-4},
    {
        'effect': 'transmission_ripple',
        'joint': 'shoulder_pan_joint',
        'amplitude': 2e-4,
        'order': 2.0,
        'phase': 0.3,
    },
    {'effect': 'joint_compliance', 'joint': 'shoulder_lift_joint', 'compliance': 4e-6},
)
"""What the model holds: constants, a gear's error and a spring."""
SECONDS = BEAT
"""Length of a turn [s]: there and back, so that the next one begins where this one ended."""


def race(turns: int, rate: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return the latency of each contender [us], the ratios, and what was lost."""
    with TemporaryDirectory() as place:
        model = Path(place) / 'effects.yaml'
        model.write_text(yaml_text(list(CAUSES)))
        kind = POSE_OUT.message_class()
        relay = Contender(
            'relay', 'weld_twin_lab.campaigns.live.relay', kind, ('-p', 'poses:=true')
        )
        own = Contender(
            'compensator',
            'weld_twin_nodes.live.compensator',
            kind,
            _words(f'robot:={ROBOT}', f'model:={model}', 'apply:=true', 'managed:=false'),
            {'~/pose_in': 'given', '~/pose_out': 'answer', JOINT_STATES.name: ARM},
        )
        with Race((relay, own), poses=True) as both:
            both.meanwhile = _arm(both)
            for contender in (own, relay, own):
                both.turn(contender, rate, SECONDS)
            for contender in (own, relay):
                contender.clear()
            for k in range(turns):
                for contender in (own, relay) if k % 2 else (relay, own):
                    both.turn(contender, rate, SECONDS)
    out = {each.name: each.result() for each in (relay, own)}
    for name, row in out.items():
        tell(f'{rate:.0f} poses/s  {name:12} {row}')
    ratio = {
        key: round(out['compensator'][key] / out['relay'][key], 3) for key in ('p50_us', 'p99_us')
    }
    tell(f'compensator / relay {ratio}')
    return {**out, 'rate_hz': rate, 'ratio': ratio, 'lost': out['compensator']['lost']}


def _words(*settings: str) -> tuple[str, ...]:
    return tuple(word for setting in settings for word in ('-p', setting))


def _arm(both: Race) -> Callable[[], None]:
    """Return what tells, again and again, where the arm stands."""
    encode = JointStateEncoder(catalog.load(ROBOT).joint_names)
    publisher = both.node.create_publisher(
        JOINT_STATES.message_class(), ARM, JOINT_STATES.offered.to_rclpy()
    )
    clock = both.node.get_clock()
    return lambda: publisher.publish(encode(clock.now().nanoseconds, HOME))
