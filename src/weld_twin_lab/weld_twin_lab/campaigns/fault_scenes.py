# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Cells whose controller can be made to misbehave, and what goes wrong between it, a tracker and nodes.

A scene is a cell of its own, in real time. It passes when the nodes are well before it, one of them
tells the fault in a sentence within its time, and all is well again once it is mended.
"""

from __future__ import annotations

import re
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock
from scipy.spatial.transform import Rotation

from weld_twin_core.arm import catalog
from weld_twin_core.arm.chain import forward
from weld_twin_core.arrays import Array
from weld_twin_core.errors import TwinError
from weld_twin_msgs_py.messages.topics import (
    DEVIATION,
    JOINT_STATES,
    MEASURED_POSE,
    ROBOT_DESCRIPTION,
    TEMPERATURE,
    TOOL_WRENCH,
    TWIN_POSE,
    Topic,
)
from weld_twin_msgs_py.robots import write_urdf
from weld_twin_nodes.harness import Cell, NodeProcess
from weld_twin_nodes.harness.cell import HealthListener

from .message_packages import messages_importable
from .party import REST

RATE = 100.0
"""Joint states a second."""
S = 1_000_000_000
"""Nanoseconds."""
HISTORY = 1000
"""Messages a controller keeps; an empty one is in the way of reliable readers until it has left."""
LISTENERS = 4
"""Twin, injector, live diagnosis and recorder take joint states."""
SURE = {'use_sim_time': True, 'reliable_inputs': True}
NODES: dict[str, dict[str, Any]] = {
    'recorder': {},
    'live_diagnosis': {'least': 600.0},
    'deviation_markers': {},
    'deviation_analyzer': {'metrics_every': 50},
    'forward_kinematics_twin': {},
    'error_injector': {},
}
"""The nodes of the cell; without effects, so that every deviation must be zero."""


class Bench:
    """The cell, its clock, and the joint states sent so far."""

    def __init__(self, cell: Cell, bag: Path) -> None:
        self.cell = cell
        self.robot = catalog.load('ur5')
        self.make = cell.messages
        self.sent: dict[int, list[Array]] = defaultdict(list)
        self.stamp = 1000 * S
        self.phase = 0.0
        self.ticking = True
        self.health = HealthListener(cell.node)
        self.processes: dict[str, NodeProcess] = {}
        for name in NODES:
            self.start(name, **({'out': str(bag)} if name == 'recorder' else {}))
        self.taps = {t.name: cell.collect(t.name) for t in (TWIN_POSE, MEASURED_POSE, DEVIATION)}
        self._clock = cell.node.create_publisher(Clock, '/clock', 10)
        self._joints = self.publisher(JOINT_STATES)

    def start(self, name: str, **parameters: Any) -> None:
        self.processes[name] = self.cell.start(name, **SURE, **NODES[name], **parameters)

    def publisher(self, topic: Topic) -> Any:
        """Return one more publisher of a topic, with the short history of a controller."""
        qos = replace(topic.offered, depth=HISTORY)
        return self.cell.node.create_publisher(topic.message_class(), topic.name, qos.to_rclpy())

    def ready(self) -> None:
        count = self.cell.node.count_subscribers
        self.cell.wait(lambda: count(JOINT_STATES.name) >= LISTENERS, 'listeners', 120.0)
        self.cell.meet()

    # The controller --------------------------------------------------------------------------

    def tick(self, step: int) -> None:
        """Let the time of the cell go on [ns]."""
        self.stamp += step
        if self.ticking:
            self._clock.publish(Clock(clock=self.make.time(self.stamp)))

    def joint_state(self) -> Any:
        """Return the next sound joint state; the arm goes on, not so its record."""
        self.phase += 0.3 / RATE
        q = REST + 0.2 * np.sin(self.phase + np.arange(6))
        return self.make.joint_state(self.stamp, self.robot.joint_names, q, np.zeros(6))

    def send(self, message: Any, *, sound: bool = True) -> None:
        """Publish a joint state or bytes; ``sound`` ones may show up in the output."""
        if sound:
            ns = message.header.stamp.sec * S + message.header.stamp.nanosec
            self.sent[ns].append(np.array(message.position))
        self._joints.publish(message)

    def run(
        self, seconds: float, each: Callable[[int], None] | None = None, rate: float = RATE
    ) -> None:
        """Send joint states on the beat; ``each`` does it instead, told the number."""
        begin, count = time.monotonic(), round(seconds * rate)
        sent = 0

        def due() -> bool:
            nonlocal sent
            while sent < count and time.monotonic() - begin >= sent / rate:
                self.tick(round(S / rate))
                if each is None:
                    self.send(self.joint_state())
                else:
                    each(sent)
                sent += 1
            return sent == count

        self.cell.wait(due, 'the joint states to be sent', limit=seconds + 60.0)

    def rest(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        self.cell.wait(lambda: time.monotonic() >= end, 'a rest', seconds + 60.0)


JOINT_RATE, POSE_RATE = 100.0, 60.0
"""Messages a second of the controller and of the tracker."""
NOISE = 2e-5
"""Standard deviation of the tracker [m]: that of a good one."""
MEETING = 60.0
"""Seconds the nodes have to meet."""


class Stand:
    """Joint states and measured poses on a beat of the machine's clock; a fault changes one of them."""

    def __init__(self, cell: Cell, folder: Path) -> None:
        self.cell, self.folder = cell, folder
        self.robot = catalog.load('ur5')
        self.health = HealthListener(cell.node)
        self.offset: Callable[[float], float] = lambda _: 0.0
        self.frame = 'world'
        self.T_seen: Array = np.eye(4)
        self.beats: list[Callable[[int], None]] = []
        self._rng = np.random.default_rng(5)
        self._begun, self._epoch = time.monotonic(), time.time_ns()
        self._sent = [0, 0]
        self._context = rclpy.Context()
        rclpy.init(context=self._context, domain_id=cell.domain)
        self.other = Node('other', context=self._context)
        self.joints: Any = self.publisher(JOINT_STATES)
        self.poses = self.publisher(MEASURED_POSE)

    def close(self) -> None:
        self.other.destroy_node()
        self._context.try_shutdown()

    def publisher(self, topic: Topic, name: str = '') -> Any:
        return self.other.create_publisher(
            topic.message_class(), name or topic.name, topic.offered.to_rclpy()
        )

    def transforms(self, *, static: bool) -> Callable[[str, str, Array], None]:
        """Return what publishes where a frame is in another, at the time of the stand."""
        kind = import_module('tf2_msgs.msg').TFMessage
        stamped = import_module('geometry_msgs.msg').TransformStamped
        durability = DurabilityPolicy.TRANSIENT_LOCAL if static else DurabilityPolicy.VOLATILE
        qos = QoSProfile(depth=100, durability=durability)
        publisher = self.other.create_publisher(kind, '/tf_static' if static else '/tf', qos)

        def publish(parent: str, child: str, T: Array) -> None:
            each = stamped(child_frame_id=child)
            each.header.stamp = self.cell.messages.time(self.now)
            each.header.frame_id = parent
            p, q = each.transform.translation, each.transform.rotation
            p.x, p.y, p.z = T[:3, 3].tolist()
            q.x, q.y, q.z, q.w = Rotation.from_matrix(T[:3, :3]).as_quat().tolist()
            publisher.publish(kind(transforms=[each]))

        return publish

    @property
    def now(self) -> int:
        """Return the time of the controller [ns]."""
        return self._epoch + round((time.monotonic() - self._begun) * S)

    def q(self, t: float) -> Array:
        """Return the joints at a time [s]; the tool goes some cm/s, never twice the same way."""
        return REST + 0.15 * np.sin(np.array([0.8, 1.1, 0.5, 0.7, 0.9, 1.3]) * t + np.arange(6))

    def step(self) -> None:
        t = time.monotonic() - self._begun
        while self._sent[0] / JOINT_RATE < t:
            at = self._sent[0] / JOINT_RATE
            stamp = self._epoch + round(at * S)
            names = self.robot.joint_names
            self.joints.publish(self.cell.messages.joint_state(stamp, names, self.q(at)))
            for beat in self.beats:
                beat(self._sent[0])
            self._sent[0] += 1
        while self._sent[1] / POSE_RATE < t:
            self._measure(self._sent[1] / POSE_RATE)
            self._sent[1] += 1

    def _measure(self, at: float) -> None:
        T = self.T_seen @ forward(self.robot, self.q(at))
        stamp = self._epoch + round((at + self.offset(at)) * S)
        seen = T[:3, 3] + self._rng.normal(scale=NOISE, size=3)
        self.poses.publish(self.cell.messages.pose(stamp, seen, T[:3, :3], self.frame))

    # Waiting ---------------------------------------------------------------------------------

    def reported(self, node: str, words: str, within: float) -> tuple[float | None, str]:
        """Return after how long [s] a node's health tells something, and the whole sentence."""
        self.health.clear()
        begun = time.monotonic()

        def told() -> str:
            entries = (
                entry
                for name, every in self.health.told.items()
                for entry in every
                if name == node or name.startswith(f'{node}: ')
            )
            return next((text for level, text in entries if words in text and level != 'ok'), '')

        self._until(lambda: bool(told()), within, f'{words!r} to be told')
        sentence = told()
        return (time.monotonic() - begun if sentence else None), sentence

    def well(self, node: str, within: float = 30.0) -> bool:
        """Return whether a node says within a time [s] that it is well, and nothing else."""
        self.health.clear()

        def running() -> bool:
            return ('ok', 'running') in self.health.told.get(node, ())

        self._until(running, within, f'{node} to be well')
        return running()

    def run(self, seconds: float) -> None:
        self._until(lambda: False, seconds, 'some time to pass')

    def _until(self, there: Callable[[], bool], within: float, what: str) -> None:
        """Go on sending until something is there, or a time [s] is over."""
        end = time.monotonic() + within

        def over() -> bool:
            self.step()
            return there() or time.monotonic() > end

        self.cell.wait(over, what, limit=within + MEETING)


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

Reported = dict[str, Any]
"""What is done, who is to tell, within what time [s], after what time it did, and what it said."""


class Scene(NamedTuple):
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
    return {'what': what, 'node': node, 'within_s': within, 'seconds': seconds, 'said': said}


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
        row = _reported(stand, f'{offset:+g} s', ANALYZER, ' the joints')
        right = (row['seconds'] or np.inf) <= PROMPT and _names(row['said'], offset)
        yield row | {'within_s': PROMPT, 'said': row['said'] if right else ''}
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
    row = _reported(stand, '100 ppm', ANALYZER, 'drifts by', DRIFTING)
    rate = re.search(r'drifts by ([+-]\d+) ppm', row['said'])
    right = rate is not None and abs(float(rate[1]) - DRIFT * 1e6) <= 0.3 * DRIFT * 1e6
    yield row | {'said': row['said'] if right else ''}
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
    rows = list(scene.run(stand))
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
