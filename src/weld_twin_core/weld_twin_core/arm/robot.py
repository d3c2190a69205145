# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The robot model: Denavit-Hartenberg rows between a base and a tool frame, with link masses."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, readonly, refuse_unknown
from ..errors import DataError, ModelError
from .channels import ROW_CHANNELS
from .controller_frames import ControllerFrames, frame_of, pose_mapping

_CONVENTIONS = ('standard', 'modified')
STANDARD_GRAVITY = (0.0, 0.0, -9.80665)
"""In the world frame [m/s^2], of a robot file that does not say."""
_WORKPIECE_KEYS = {'name', 'convention', 'base', 'tool', 'joints', 'links', 'payload'}
_CONTROL = re.compile(r'[\x00-\x1f\x7f\x85\u2028\u2029]')
"""Control characters, and what ends a line in Unicode."""
_TOP_KEYS = _WORKPIECE_KEYS | {'gravity', 'source', 'plausible', 'controller', 'workpiece'}
UNHURRIED = (1.3, 0.25)
"""Speeds that plans keep where the robot file has none: of a joint that turns, that of the slowest of
the bundled robots' [rad/s]; of a slide, the reduced speed of ISO 10218-1 [m/s]."""
_LIMITS = ('lower', 'upper', 'max_velocity', 'max_acceleration')
_JOINT_KEYS = {'name', 'type', 'a', 'alpha', 'd', 'theta_offset', 'beta', *_LIMITS}
_PER_ROW: tuple[str, ...] = ('a', 'alpha', 'd', 'theta', 'beta', 'prismatic', *_LIMITS)


@dataclass(frozen=True, eq=False)
class Robot:
    """
    A serial robot, or the chain from a workpiece that is moved to the tool of a robot.

    A standard row is Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta), the seed equation of the paper
    with Hayati's beta at its end; a modified (Craig) row is
    Rx(alpha) Ry(beta) Tx(a) Rz(theta) Tz(d). A joint moves ``theta`` (revolute) or ``d``
    (prismatic).

    The joints of a positioner come first, the one at the workpiece foremost. The chain passes
    their rows backwards: a row is of its own chain, from the positioner's foot outward, and so are
    the sign of its joint and every error of it.

    Raises
    ------
    ModelError
        No joints, a name used twice, an unknown convention, limits the wrong way round.
    DataError
        An array has the wrong shape or a value that is not finite.

    References
    ----------
    .. [1] S. Hayati, "Robot arm geometric link parameter estimation", IEEE CDC 1983.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> rows = [{'name': 'j1', 'a': 0.4, 'd': 0.3}, {'name': 'j2', 'a': 0.3}]
    >>> robot = wt.Robot.from_mapping({'name': 'scara', 'joints': rows})
    >>> robot.n, robot.joint_names, robot.a.tolist()
    (2, ('j1', 'j2'), [0.4, 0.3])

    """

    name: str
    joint_names: tuple[str, ...]
    a: Array
    alpha: Array
    d: Array
    theta: Array
    beta: Array
    """DH values at joint position zero, shape (n,) [m, rad]."""
    prismatic: NDArray[np.bool_]
    """Shape (n,)."""
    lower: Array
    upper: Array
    max_velocity: Array
    max_acceleration: Array
    """Shape (n,) [rad or m, per s, per s^2]."""
    convention: str = 'standard'
    T_world_base: Array = field(default_factory=lambda: np.eye(4))
    T_flange_tool: Array = field(default_factory=lambda: np.eye(4))
    """Where the chain begins (at the end of a positioner's rows) and ends, shape (4, 4)."""
    mass: Array | None = None
    """Of the links, shape (n,) [kg]."""
    com: Array | None = None
    """Their centres in the DH frame at the end of each link, shape (n, 3) [m]."""
    payload_mass: float = 0.0
    """[kg]"""
    payload_com: Array = field(default_factory=lambda: np.zeros(3))
    """In the tool frame, shape (3,) [m]."""
    gravity: Array = field(default_factory=lambda: np.array(STANDARD_GRAVITY))
    """In the frame where the robot's rows begin, which stands still, shape (3,) [m/s^2]."""
    source: str = ''
    """Where the numbers come from."""
    plausible: Mapping[str, Mapping[str, Mapping[str, float]]] = field(default_factory=dict)
    """What this robot's errors can be where it is known better than of robots at large: effect,
    parameter, and ``sd``, ``low``, ``high``; see `weld_twin_core.effects.plausible`."""
    controller: ControllerFrames | None = None
    """Where the controller has its base and flange, of a robot that says so, as a URDF does."""
    behind: int = 0
    """Rows that the chain passes backwards: joints of the positioner, 0 for a robot alone."""
    T_root_base: Array = field(default_factory=lambda: np.eye(4))
    """Where the robot's rows begin, seen from where those of the positioner do, (4, 4) [m]."""

    def __post_init__(self) -> None:
        n = len(self.joint_names)
        self._refuse_names()
        if self.convention not in _CONVENTIONS:
            raise ModelError(
                f'convention of robot {self.name!r} must be one of {", ".join(_CONVENTIONS)}, '
                f'got {self.convention!r}'
            )
        shapes: dict[str, tuple[int | None, ...]] = {
            **dict.fromkeys(('a', 'alpha', 'd', 'theta', 'beta'), (n,)),
            'payload_com': (3,),
            'gravity': (3,),
            'T_world_base': (4, 4),
            'T_flange_tool': (4, 4),
            'T_root_base': (4, 4),
        }
        if not 0 <= self.behind < n:
            raise ModelError(
                f'robot {self.name!r} has {n} joints; {self.behind} of them cannot be a positioner'
            )
        if self.mass is not None:
            shapes |= {'mass': (n,), 'com': (n, 3)}
        for key, shape in shapes.items():
            self._set(key, readonly(getattr(self, key), shape, f'{key} of robot {self.name!r}'))
        for key in _LIMITS:
            value = readonly(getattr(self, key), (n,), f'{key} of {self.name!r}', finite=False)
            self._set(key, value)
        prismatic = readonly(self.prismatic, (n,), f'prismatic of {self.name!r}').astype(bool)
        prismatic.setflags(write=False)
        self._set('prismatic', prismatic)
        wrong = ~(self.lower < self.upper)
        if wrong.any():
            k = int(np.argmax(wrong))
            raise ModelError(f'joint {self.joint_names[k]!r}: lower limit is not below upper')
        if self.mass is not None and (self.mass < 0.0).any():
            raise ModelError(f'robot {self.name!r} has a link of negative mass')

    def _refuse_names(self) -> None:
        if not self.joint_names:
            raise ModelError(f'robot {self.name!r} has no joints')
        for name in (self.name, *self.joint_names):
            if _CONTROL.search(name):
                raise ModelError(
                    f'the name {name!r} has a line end or another control character; names are lines '
                    'of programs and tables, so write it without'
                )
        if len(set(self.joint_names)) < len(self.joint_names):
            raise ModelError(f'robot {self.name!r} uses a joint name twice: {self.joint_names}')

    def _set(self, key: str, value: Any) -> None:
        object.__setattr__(self, key, value)

    @property
    def n(self) -> int:
        """Return the number of joints."""
        return len(self.joint_names)

    @property
    def planned_velocity(self) -> Array:
        """Return the speeds that plans keep, shape (n,) [rad/s or m/s]: limits, or `UNHURRIED`."""
        usual = np.where(self.prismatic, UNHURRIED[1], UNHURRIED[0])
        return np.where(np.isfinite(self.max_velocity), self.max_velocity, usual)

    @property
    def T_base_origin(self) -> Array:
        """Return the link that poses are measured from where the chain begins: foot or table, (4, 4)."""
        if self.controller is None or self.controller.foot is None:
            return np.eye(4)
        return self.controller.foot

    @property
    def T_base_foot(self) -> Array:
        """Return the link that the arm stands in, in the frame where its rows begin, (4, 4) [m]."""
        if not self.behind:
            return self.T_base_origin
        return np.eye(4) if self.controller is None else self.controller.base

    @property
    def T_world_origin(self) -> Array:
        """Return the base that people speak of in the world, shape (4, 4) [m]: the arm's foot."""
        if self.controller is None:
            return self.T_world_base
        return np.asarray(self.T_world_base @ self.T_base_origin)

    @cached_property
    def branches(self) -> tuple[Robot, Robot]:
        """
        Return the positioner and the robot beside it, each from its own foot outward.

        Both stand in the frame where the positioner's rows begin. The tool of the positioner is the
        frame that the chain is measured in. ModelError for a robot alone.
        """
        if not self.behind:
            raise ModelError(f'robot {self.name!r} has no joints between workpiece and foot')
        still = np.eye(4)
        first = self.part(
            range(self.behind)[::-1],
            T_world_base=still,
            T_flange_tool=np.linalg.inv(self.T_world_base),
            gravity=self.T_root_base[:3, :3] @ self.gravity,
            payload_mass=0.0,
            controller=None,
        )
        return first, self.part(range(self.behind, self.n), T_world_base=self.T_root_base)

    def index(self, joint: str) -> int:
        """Return a joint's place in the chain, from 0; ModelError lists the joints there are."""
        try:
            return self.joint_names.index(joint)
        except ValueError:
            raise ModelError(
                f'robot {self.name!r} has no joint {joint!r}; its joints are '
                + ', '.join(self.joint_names)
            ) from None

    @cached_property
    def row_values(self) -> list[dict[str, float]]:
        """Return the values of every row by their channels, as plain numbers."""
        each = zip(*(getattr(self, key).tolist() for key in ROW_CHANNELS), strict=True)
        return [dict(zip(ROW_CHANNELS, values, strict=True)) for values in each]

    def with_frames(self, *, base: Array | None = None, tool: Array | None = None) -> Robot:
        """Return the same arm with other frames ``T_world_base``, ``T_flange_tool``, (4, 4) [m]."""
        frames = {'T_world_base': base, 'T_flange_tool': tool}
        new = {key: frame for key, frame in frames.items() if frame is not None}
        if all(frame is getattr(self, key) for key, frame in new.items()):
            return self
        out = copy(self)  # everything else has been checked already
        out.__dict__.pop('branches', None)
        for key, frame in new.items():
            out._set(key, readonly(frame, (4, 4), f'{key} of robot {self.name!r}'))
        return out

    def with_origin(self, T_world_origin: Array) -> Robot:
        """Return the same arm with its foot elsewhere, see `T_world_origin`, shape (4, 4) [m]."""
        if self.controller is None:
            return self.with_frames(base=T_world_origin)
        return self.with_frames(base=T_world_origin @ np.linalg.inv(self.T_base_origin))

    def part(self, which: Sequence[int], **changes: Any) -> Robot:
        """Return some rows, in the order of the new chain, as a robot alone with some changes."""
        keys = _PER_ROW if self.mass is None else (*_PER_ROW, 'mass', 'com')
        rows = {key: getattr(self, key)[list(which)] for key in keys}
        names = tuple(self.joint_names[k] for k in which)
        alone = {'behind': 0, 'T_root_base': np.eye(4), 'joint_names': names}
        return replace(self, **{**rows, **alone, **changes})

    def behind_workpiece(self, positioner: Robot) -> Robot:
        """
        Return the chain from the tool of a positioner to the tool of this robot.

        The positioner's payload is the workpiece; the bases of both say where they stand in one world.
        ModelError for a joint name twice, or rows of two conventions.
        """
        if positioner.convention != self.convention:
            raise ModelError(
                f'the workpiece has {positioner.convention} rows and the robot {self.convention} '
                'ones; give both the same convention'
            )
        keys, chains = _PER_ROW, (_laden(positioner), self)
        if any(chain.mass is not None for chain in chains):
            keys = (*_PER_ROW, 'mass', 'com')
            chains = _weighed(chains[0]), _weighed(chains[1])
        rows: dict[str, Any] = {
            key: np.concatenate([getattr(chains[0], key)[::-1], getattr(chains[1], key)])
            for key in keys
        }
        return replace(
            self,
            **rows,
            joint_names=positioner.joint_names[::-1] + self.joint_names,
            behind=positioner.n,
            T_world_base=np.asarray(np.linalg.inv(positioner.T_flange_tool)),
            T_root_base=np.asarray(np.linalg.inv(positioner.T_world_base) @ self.T_world_base),
        )

    def refuse_positioner(self, what: str) -> None:
        """Raise ModelError where what is asked for, a noun, is there for a robot alone."""
        if self.behind:
            moved = ', '.join(self.joint_names[: self.behind])
            raise ModelError(
                f'{what} is not there yet for a workpiece that a positioner moves ({moved}); take '
                "the robot alone: in a URDF --base-link of its foot, in a robot file no 'workpiece'"
            )

    def check_positions(self, q: Array) -> None:
        """Raise DataError where joints (..., n) [rad or m] look like degrees, or are beyond limits."""
        values = np.asarray(q).reshape(-1, self.n)
        slack = 1e-6
        outside = (values < self.lower - slack) | (values > self.upper + slack)
        if not outside.any():
            return
        k, j = (int(i) for i in np.argwhere(outside)[0])
        value, name = values[k, j], self.joint_names[j]
        hint = 'check the limits in the robot file'
        if not self.prismatic[j] and np.abs(values[:, ~self.prismatic]).max() > 4.0 * np.pi:
            hint = 'this looks like degrees in a radian field'
        raise DataError(
            f'joint {name!r} is at {value:.6g} in sample {k}, outside its limits '
            f'[{self.lower[j]:.6g}, {self.upper[j]:.6g}]; {hint}'
        )

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any]) -> Robot:
        """
        Build a robot from the mapping a robot file holds.

        Parameters
        ----------
        data : mapping
            The keys of a robot file; only ``joints`` is required, each with a ``name``.

        Raises
        ------
        ModelError
            A key is missing, unknown or has a wrong value.

        """
        if not isinstance(data, Mapping):
            raise ModelError(f'a robot file must be a mapping of keys, got {type(data).__name__}')
        _known(data, _TOP_KEYS, 'robot file')
        name = str(data.get('name', 'robot'))
        robot = cls._alone(name, data)
        if data.get('workpiece') is None:
            return robot
        other = data['workpiece']
        if not isinstance(other, Mapping):
            raise ModelError(f"'workpiece' of robot {name!r} must be a mapping with joints")
        _known(other, _WORKPIECE_KEYS, f'workpiece of robot {name!r}')
        shared = {'convention': robot.convention, 'name': f'{name}, workpiece'}
        return robot.behind_workpiece(cls._alone(f'{name}, workpiece', {**shared, **other}))

    @classmethod
    def _alone(cls, name: str, data: Mapping[str, Any]) -> Robot:
        """Return the robot of a mapping without what holds its workpiece."""
        rows = data.get('joints')
        if not isinstance(rows, Sequence) or isinstance(rows, str) or not rows:
            raise ModelError(f"robot {name!r} needs a list 'joints' in chain order")
        for k, row in enumerate(rows):
            if not isinstance(row, Mapping) or 'name' not in row:
                raise ModelError(f"joint {k} of robot {name!r} needs a 'name'")
            _known(row, _JOINT_KEYS, f'joint {row["name"]!r}')
            if row.get('type', 'revolute') not in ('revolute', 'prismatic'):
                raise ModelError(
                    f'joint {row["name"]!r}: type must be revolute or prismatic, '
                    f'got {row["type"]!r}'
                )
        try:
            return cls._from_rows(name, rows, data)
        except (DataError, TypeError, ValueError, KeyError, AttributeError) as error:
            raise ModelError(f'robot {name!r}: {error}') from None

    @classmethod
    def _from_rows(cls, name: str, rows: Sequence[Any], data: Mapping[str, Any]) -> Robot:
        links, frames = data.get('links'), data.get('controller')
        payload = data.get('payload') or {}
        if links is not None and len(links) != len(rows):
            raise ModelError(
                f'robot {name!r} has {len(links)} links for {len(rows)} joints; give one per joint'
            )
        return cls(
            name=name,
            joint_names=tuple(str(row['name']) for row in rows),
            theta=_column(rows, 'theta_offset'),
            **{key: _column(rows, key) for key in ('a', 'alpha', 'd', 'beta')},
            prismatic=np.array([row.get('type', 'revolute') == 'prismatic' for row in rows]),
            lower=_column(rows, 'lower', -np.inf),
            **{key: _column(rows, key, np.inf) for key in _LIMITS[1:]},
            convention=str(data.get('convention', 'standard')),
            T_world_base=frame_of(data.get('base'), 'base'),
            T_flange_tool=frame_of(data.get('tool'), 'tool'),
            mass=None if links is None else _column(links, 'mass'),
            com=None if links is None else _column(links, 'com', (0.0, 0.0, 0.0)),
            payload_mass=float(payload.get('mass', 0.0)),
            payload_com=payload.get('com', np.zeros(3)),
            gravity=data.get('gravity', STANDARD_GRAVITY),
            source=str(data.get('source', '')),
            plausible=_plausible(data.get('plausible')),
            controller=None if frames is None else ControllerFrames.from_mapping(frames),
        )

    def to_mapping(self) -> dict[str, Any]:
        """Return the mapping that `from_mapping` reads: plain numbers, lists and strings."""
        if not self.behind:
            return self._own_mapping()
        positioner, robot = self.branches
        # People know where the positioner stands in the robot's base: so they type it in.
        out = robot.with_frames(base=np.eye(4))._own_mapping()
        there = np.asarray(np.linalg.inv(self.T_root_base))
        foot = positioner.with_frames(base=there)._own_mapping()
        kept = _WORKPIECE_KEYS - {'name', 'convention', 'payload'}
        out['workpiece'] = {key: value for key, value in foot.items() if key in kept}
        return out

    def _own_mapping(self) -> dict[str, Any]:
        """Return the mapping of a robot alone."""
        joints = []
        for k, name in enumerate(self.joint_names):
            row: dict[str, Any] = {'name': name, 'a': float(self.a[k])}
            row |= {'alpha': float(self.alpha[k]), 'd': float(self.d[k])}
            row['theta_offset'] = float(self.theta[k])
            if self.beta[k] != 0.0:
                row['beta'] = float(self.beta[k])
            if self.prismatic[k]:
                row['type'] = 'prismatic'
            for key in _LIMITS:
                value = float(getattr(self, key)[k])
                if np.isfinite(value):
                    row[key] = value
            joints.append(row)
        out: dict[str, Any] = {
            'name': self.name,
            'convention': self.convention,
            'gravity': self.gravity.tolist(),
            'base': pose_mapping(self.T_world_base),
            'tool': pose_mapping(self.T_flange_tool),
            'joints': joints,
        }
        if self.mass is not None and self.com is not None:
            out['links'] = [
                {'mass': float(m), 'com': c.tolist()}
                for m, c in zip(self.mass, self.com, strict=True)
            ]
        out['payload'] = {'mass': float(self.payload_mass), 'com': self.payload_com.tolist()}
        if self.source:
            out['source'] = self.source
        if self.plausible:
            out['plausible'] = _plausible(self.plausible)
        if self.controller is not None:
            out['controller'] = self.controller.to_mapping()
        return out


def _laden(positioner: Robot) -> Robot:
    """Return a positioner whose payload is part of its last link."""
    if not positioner.payload_mass:
        return positioner
    weighed = _weighed(positioner)
    assert weighed.mass is not None and weighed.com is not None
    load, mass, com = positioner.payload_mass, weighed.mass.copy(), weighed.com.copy()
    tool = positioner.T_flange_tool
    moment = mass[-1] * com[-1] + load * (tool[:3, :3] @ positioner.payload_com + tool[:3, 3])
    mass[-1] += load
    com[-1] = moment / mass[-1]
    return replace(weighed, mass=mass, com=com, payload_mass=0.0)


def _weighed(robot: Robot) -> Robot:
    """Return a robot with link masses, of zero where it has none."""
    if robot.mass is not None:
        return robot
    return replace(robot, mass=np.zeros(robot.n), com=np.zeros((robot.n, 3)))


def _known(mapping: Mapping[str, Any], keys: set[str], where: str) -> None:
    refuse_unknown(mapping, sorted(keys), where, ModelError)


def _plausible(value: Any) -> dict[str, dict[str, dict[str, float]]]:
    """Return what a robot file says about the size of errors, checked."""
    out: dict[str, dict[str, dict[str, float]]] = {}
    for effect, parameters in (value or {}).items():
        for parameter, limits in parameters.items():
            _known(limits, {'sd', 'low', 'high'}, f'plausible {effect}.{parameter}')
            numbers = {key: float(number) for key, number in limits.items()}
            if not numbers.get('sd', 1.0) > 0.0:
                raise ModelError(f'plausible {effect}.{parameter}: sd must be above zero')
            if not numbers.get('low', -np.inf) < numbers.get('high', np.inf):
                raise ModelError(f'plausible {effect}.{parameter}: low must be below high')
            out.setdefault(str(effect), {})[str(parameter)] = numbers
    return out


def _column(rows: Sequence[Any], key: str, default: Any = 0.0) -> Any:
    return [row.get(key, default) for row in rows]
