# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What goes wrong between a controller, a tracker and the nodes: one cell for each, in real time.

A scene passes when the nodes are well before it, one of them tells the fault in a sentence within
its time, and all is well again once it is mended.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.arrays import Array
from weld_twin_core.errors import TwinError
from weld_twin_msgs_py.messages.topics import (
    JOINT_STATES,
    ROBOT_DESCRIPTION,
    TEMPERATURE,
    TOOL_WRENCH,
)
from weld_twin_msgs_py.robots import write_urdf
from weld_twin_nodes.harness import Cell

from .fault_cells import Stand
from .message_packages import messages_importable

TWIN, ANALYZER = '/forward_kinematics_twin', '/deviation_analyzer'
OFFSETS = (0.05, -0.05, 0.8, -0.8, 60.0, -60.0)
"""Clock offsets [s] that are tried one after the other."""
PROMPT = 5.0
"""Seconds within which an offset must be named."""
SOON = 10.0
"""Seconds within which every other fault must be told: some looks at the health."""
DRIFT = 100e-6
"""Seconds that the tracker's clock gains in a second: what a cheap oscillator does."""
DRIFTING = 90.0
"""Seconds within which a drift must be told: at 100 ppm it takes 40 until it is 4 ms."""
STARTED = 40.0
"""Seconds the nodes have to be well at first, on a crowded machine."""
LEARNING = 12.0
"""Seconds of sound motion before a fault: the clocks are compared over 8 of them."""

Reported = tuple[str, str, float, 'float | None', str]
"""What is done, who is to tell, within what time, after what time it did, and what it said [s]."""


class Scene(NamedTuple):
    """One fault."""

    name: str
    run: Callable[[Stand], Iterator[Reported]]
    """Does it on a stand whose nodes run; yields what was told."""
    nodes: dict[str, dict[str, Any]]
    """Nodes that run, with their parameters."""
    mended: tuple[str, ...] = ()
    """Nodes that must be well again at the end."""


def _turned(x: float, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0, x], [s, c, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0, 0, 0, 1.0]])


TRACKER = _turned(2.0, 0.7)
"""Where the tracker is in the world."""


def _reported(stand: Stand, what: str, node: str, words: str, within: float = SOON) -> Reported:
    seconds, said = stand.reported(node, words, within)
    return what, node, within, seconds, said


def _wrong_frame(stand: Stand) -> Iterator[Reported]:
    stand.frame = 'camera'
    yield _reported(stand, 'camera', ANALYZER, "given in 'camera', but measuring_frame is 'world'")
    stand.frame = 'world'


def _by_tf(stand: Stand, *, moving: bool) -> Callable[[str, str, Array], None]:
    """Let the tracker measure in a frame of its own, which `/tf` tells; return what tells it."""
    tell = stand.transforms(static=not moving)
    tell('world', 'tracker', TRACKER)
    stand.frame = 'tracker'
    stand.T_seen = np.asarray(np.linalg.inv(TRACKER), dtype=np.float64)
    return tell


def _silent_tf(stand: Stand) -> Iterator[Reported]:
    tell = _by_tf(stand, moving=True)

    def beat(k: int) -> None:
        if k % 5 == 0:
            tell('world', 'tracker', TRACKER)

    stand.beats.append(beat)
    stand.run(LEARNING)
    yield _reported(stand, 'while it is told', ANALYZER, 'is taken for', 0.0)
    stand.beats.clear()
    yield _reported(stand, 'silence', ANALYZER, "last transform of 'tracker' in 'world' is")
    stand.beats.append(beat)


def _loop(stand: Stand) -> Iterator[Reported]:
    _by_tf(stand, moving=False)
    stand.run(
        LEARNING
    )  # the right way is known first: which of two makes the loop is a matter of order
    wrong = stand.transforms(static=False)
    stand.beats.append(lambda k: None if k % 10 else wrong('tracker', 'world', np.eye(4)))
    yield _reported(stand, 'world in tracker', ANALYZER, "'world' makes a loop")
    stand.beats.clear()


def _moving_base(stand: Stand) -> Iterator[Reported]:
    """The node waits for its base, so the base is told before."""
    tell = stand.transforms(static=True)
    tell('world', 'base_link', np.eye(4))
    stand.run(LEARNING)
    tell('world', 'base_link', _turned(0.004, 0.0))
    yield _reported(stand, '4 mm', TWIN, "'base_link' has moved in 'world' by 4 mm")
    tell('world', 'base_link', np.eye(4))


def _clock(stand: Stand) -> Iterator[Reported]:
    for offset in OFFSETS:
        stand.run(LEARNING)
        stand.offset = lambda _, o=offset: o  # type: ignore[misc]
        what, node, _, seconds, said = _reported(stand, f'{offset:+g} s', ANALYZER, ' the joints')
        right = seconds is not None and seconds <= PROMPT and _names(said, offset)
        yield what, node, PROMPT, seconds, said if right else ''
        stand.offset = lambda _: 0.0
        stand.well(ANALYZER, STARTED)


def _names(said: str, offset: float) -> bool:
    """Return whether a sentence names an offset [s], to a twentieth of it."""
    match = re.search(r'are ([\d.]+) s (ahead of|behind) the joints', said)
    if match is None:
        return False
    named = float(match[1]) * (1.0 if match[2] == 'ahead of' else -1.0)
    return abs(named - offset) <= 0.05 * abs(offset)


def _drift(stand: Stand) -> Iterator[Reported]:
    stand.offset = lambda t: 0.02 + DRIFT * t
    what, node, within, seconds, said = _reported(
        stand, '100 ppm', ANALYZER, 'drifts by', DRIFTING
    )
    rate = re.search(r'drifts by ([+-]\d+) ppm', said)
    right = rate is not None and abs(float(rate[1]) - DRIFT * 1e6) <= 0.3 * DRIFT * 1e6
    yield what, node, within, seconds, said if right else ''
    stand.offset = lambda _: 0.0


def _other_type(stand: Stand) -> Iterator[Reported]:
    publisher = stand.other.create_publisher(
        TEMPERATURE.message_class(), TOOL_WRENCH.name, TOOL_WRENCH.offered.to_rclpy()
    )
    words = '/other sends sensor_msgs/msg/Temperature, this node needs geometry_msgs'
    yield _reported(stand, 'wrench', TWIN, words)
    stand.other.destroy_publisher(publisher)


def _namespace(stand: Stand) -> Iterator[Reported]:
    own = stand.joints
    stand.joints = stand.publisher(JOINT_STATES, '/left/joint_states')
    stand.other.destroy_publisher(own)
    words = '/joint_states has no publisher, but /other publishes /left/joint_states'
    yield _reported(stand, 'left', TWIN, words)
    stand.other.destroy_publisher(stand.joints)
    stand.joints = stand.publisher(JOINT_STATES)


def _urdf(stand: Stand, name: str) -> Any:
    file = stand.folder / f'{name}.urdf'
    if not file.exists():
        write_urdf(file, catalog.load(name))
    return ROBOT_DESCRIPTION.message_class()(data=file.read_text())


def _description(stand: Stand) -> Iterator[Reported]:
    publisher = stand.publisher(ROBOT_DESCRIPTION)
    publisher.publish(_urdf(stand, 'ur5'))
    stand.run(LEARNING)
    publisher.publish(_urdf(stand, 'ur10'))
    yield _reported(stand, 'UR10', TWIN, 'another robot is told on /robot_description now')
    publisher.publish(_urdf(stand, 'ur5'))


def _controller(stand: Stand) -> Iterator[Reported]:
    """Another controller takes over: other node, other order of the joints."""
    own = stand.joints
    second = stand.cell.node.create_publisher(
        JOINT_STATES.message_class(), JOINT_STATES.name, JOINT_STATES.offered.to_rclpy()
    )
    stand.joints = second
    stand.other.destroy_publisher(own)
    words = '/joint_states comes from /harness now, it came from /other'
    yield _reported(stand, 'harness', TWIN, words)


BOTH: dict[str, dict[str, Any]] = {'forward_kinematics_twin': {}, 'deviation_analyzer': {}}
WORLD: dict[str, dict[str, Any]] = {
    'forward_kinematics_twin': {},
    'deviation_analyzer': {'measuring_frame': 'world'},
}
ON_TF = {'measuring_frame': 'world', 'base_frame': 'base_link', 'base_from_tf': True}
SCENES = (
    Scene('wrong frame', _wrong_frame, WORLD, (ANALYZER,)),
    Scene('moving frame', _moving_base, {'forward_kinematics_twin': ON_TF}, (TWIN,)),
    Scene('clock offset', _clock, BOTH, (ANALYZER,)),
    Scene('drift of 100 ppm', _drift, BOTH),
    Scene('type mismatch', _other_type, BOTH, (TWIN,)),
    Scene('namespace mix-up', _namespace, BOTH, (TWIN,)),
    Scene('TF that stops', _silent_tf, WORLD, (ANALYZER,)),
    Scene('TF loop', _loop, WORLD, (ANALYZER,)),
    Scene(
        'description changed at run time',
        _description,
        {'forward_kinematics_twin': {'robot': 'topic'}},
        (TWIN,),
    ),
    Scene('controller switched', _controller, BOTH, (TWIN,)),
)
"""What can be wrong between a controller, a tracker and the nodes."""


def play(scene: Scene, folder: Path) -> dict[str, Any]:
    try:
        with messages_importable(), Cell(folder) as cell:
            stand = Stand(cell, folder)
            try:
                return _played(scene, stand)
            finally:
                stand.close()
    except (TwinError, TimeoutError) as error:
        return {'fault': scene.name, 'passed': False, 'told': [], 'reason': str(error)[:2000]}


def _played(scene: Scene, stand: Stand) -> dict[str, Any]:
    for name, parameters in scene.nodes.items():
        stand.cell.start(name, **parameters)
    first = next(iter(scene.nodes))
    waits = scene.nodes[first].get('robot') == 'topic' or 'base_from_tf' in scene.nodes[first]
    before = waits or all(stand.well(f'/{name}', STARTED) for name in scene.nodes)
    rows = [
        {'what': what, 'node': node, 'within_s': within, 'seconds': seconds, 'said': said}
        for what, node, within, seconds, said in scene.run(stand)
    ]
    expected = [row for row in rows if row['within_s']]
    false = [row for row in rows if not row['within_s'] and row['said']]
    after = {node: stand.well(node) for node in scene.mended}
    passed = before and not false and all(row['said'] for row in expected) and all(after.values())
    return {
        'fault': scene.name,
        'well_before': before,
        'told': rows,
        'well_after': after,
        'passed': bool(passed),
    }
