# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Weld seams: a length, and position, tangent and work normal at any arc length.

A seam is a line, an arc or a circle, a polyline with rounded corners, a spline through points, or a
weave laid over one of these. A path file holds the mapping of one, as ``{'kind': 'line', 'start':
[...], 'end': [...]}``. The other keys are the attributes of the seam's class; a key ``weave`` with
``amplitude``, ``wavelength`` and ``form`` lays a weave over any kind. A key ``torch`` is left to the
caller.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from ...arm.rotation import rotation_matrix, transform
from ...arrays import Array, readonly, refuse_unknown
from ...errors import DataError, PathError


class SeamFrames(NamedTuple):
    """
    The seam at some arc lengths, in the world frame; every field is (N, 3).

    ``tangent`` points along the travel and ``normal`` out of the work, both of length 1 and
    perpendicular to each other.
    """

    position: Array
    tangent: Array
    normal: Array

    @property
    def across(self) -> Array:
        """Return the direction across the seam, normal x tangent, to the left of the travel."""
        return np.cross(self.normal, self.tangent)


class Path(ABC):
    """A seam, sampled by arc length."""

    @property
    @abstractmethod
    def length(self) -> float:
        """Return the length of the seam [m]."""

    @property
    def detail(self) -> float:
        """Return the length [m] over which the seam bends; samples must be closer than that."""
        return self.length

    @abstractmethod
    def sample(self, s: Array) -> SeamFrames:
        """Return the seam at arc lengths s, shape (N,) [m]."""


def _up() -> Array:
    """Return the world's z, the work normal of a seam in the flat position."""
    return np.array([0.0, 0.0, 1.0])


def _unit(vector: ArrayLike, name: str) -> Array:
    """Return a vector of length 1, shape (3,); PathError where it has none."""
    value = readonly(vector, (3,), name)
    size = float(np.linalg.norm(value))
    if size < 1e-12:
        raise PathError(f'{name} must not be the zero vector')
    return readonly(value / size, (3,), name)


def positive(value: object, name: str) -> float:
    """Return a number that is positive and finite; PathError where it is not."""
    if not (isinstance(value, (int, float)) and np.isfinite(value) and value > 0.0):
        raise PathError(f'{name} must be a positive number, got {value!r}')
    return float(value)


def _frames_on(position: Array, tangent: Array, normal: Array) -> SeamFrames:
    """Return frames with a normal (N, 3) made square to the travel; PathError where it lies along."""
    flat = normal - (normal * tangent).sum(axis=-1, keepdims=True) * tangent
    size = np.linalg.norm(flat, axis=-1, keepdims=True)
    if (size < 1e-6).any():
        x, y, z = position[int(np.argmin(size))]
        raise PathError(
            f'the work normal lies along the seam at ({x:.3f}, {y:.3f}, {z:.3f}) m; '
            "give a 'normal' that points out of the work"
        )
    return SeamFrames(position, tangent, flat / size)


@dataclass(frozen=True, eq=False)
class Line(Path):
    """A straight seam from ``start`` to ``end``."""

    start: Array
    end: Array
    """Shape (3,) [m]."""
    normal: Array = field(default_factory=_up)
    """Out of the work, shape (3,); only the part perpendicular to the seam counts."""

    def __post_init__(self) -> None:
        for name in ('start', 'end'):
            vars(self)[name] = readonly(getattr(self, name), (3,), f'line {name}')
        vars(self)['normal'] = _unit(self.normal, 'line normal')
        if self.length < 1e-9:
            raise PathError('the line has no length: start and end are the same point')

    @property
    def length(self) -> float:
        """Return the distance from start to end [m]."""
        return float(np.linalg.norm(self.end - self.start))

    def sample(self, s: Array) -> SeamFrames:
        direction = (self.end - self.start) / self.length
        position = self.start + np.asarray(s)[:, None] * direction
        return _frames_on(position, np.broadcast_to(direction, position.shape), self.normal)


class _Circle(NamedTuple):
    """A circle: its centre, radius and the directions to the start and along the travel."""

    centre: Array
    radius: float
    out: Array
    along: Array

    @classmethod
    def about(cls, centre: Array, axis: Array, start: Array) -> _Circle:
        """Return the circle through a start about a centre and, by the right hand, a unit axis."""
        radius = float(np.linalg.norm(start - centre))
        out = (start - centre) / radius
        return cls(centre, radius, out, np.cross(axis, out))

    def angle_of(self, point: Array) -> float:
        """Return the angle from the start to a point on the circle, in [0, 2 pi)."""
        beam = point - self.centre
        return float(np.arctan2(beam @ self.along, beam @ self.out) % (2.0 * np.pi))

    def sample(self, s: Array, normal: Any) -> SeamFrames:
        angle = np.asarray(s)[:, None] / self.radius
        cosine, sine = np.cos(angle), np.sin(angle)
        position = self.centre + self.radius * (cosine * self.out + sine * self.along)
        return _frames_on(position, cosine * self.along - sine * self.out, normal)


@dataclass(frozen=True, eq=False)
class Arc(Path):
    """The circular arc from ``start`` through ``middle`` to ``end``."""

    start: Array
    middle: Array
    end: Array
    """Shape (3,) [m]."""
    normal: Array | None = None
    """Out of the work, shape (3,); left out, the normal of the arc's plane that looks up (or, for
    a plane that is upright, the one about which the arc turns left)."""

    def __post_init__(self) -> None:
        for name in ('start', 'middle', 'end'):
            vars(self)[name] = readonly(getattr(self, name), (3,), f'arc {name}')
        axis = self._circle[1]
        normal = axis * (-1.0 if axis[2] < -1e-9 else 1.0) if self.normal is None else self.normal
        vars(self)['normal'] = _unit(normal, 'arc normal')

    @cached_property
    def _circle(self) -> tuple[_Circle, Array]:
        """Return the circle that the arc is of, and its axis."""
        first, second = self.middle - self.start, self.end - self.start
        plane = np.cross(first, second)
        area = float(np.linalg.norm(plane))
        if area < 1e-9 * float(first @ first + second @ second) or area == 0.0:
            raise PathError('the three points of the arc lie on a line; use a line')
        # Circumcentre of the triangle.
        centre = self.start + np.cross(
            (second @ second) * first - (first @ first) * second, plane
        ) / (-2.0 * area**2)
        axis = plane / area
        return _Circle.about(centre, axis, self.start), axis

    @property
    def radius(self) -> float:
        """Return the radius [m]."""
        return self._circle[0].radius

    @property
    def centre(self) -> Array:
        """Return the centre, shape (3,) [m]."""
        return self._circle[0].centre

    @property
    def length(self) -> float:
        """Return the length of the arc [m]."""
        return self._circle[0].angle_of(self.end) * self.radius

    @property
    def middle_share(self) -> float:
        """Return at which share of its length the arc passes ``middle``."""
        return self._circle[0].angle_of(self.middle) / self._circle[0].angle_of(self.end)

    def sample(self, s: Array) -> SeamFrames:
        return self._circle[0].sample(s, self.normal)


@dataclass(frozen=True, eq=False)
class Circle(Path):
    """A circular seam about an axis, as round a pipe stub."""

    centre: Array
    """Shape (3,) [m]."""
    radius: float
    """[m]"""
    axis: Array = field(default_factory=_up)
    """The travel turns left about it, shape (3,)."""
    start: Array | None = None
    """Direction from the centre to where the seam begins, shape (3,); left out, along world x as
    far as the axis lets it."""
    turns: float = 1.0
    """How much of a turn; more than 1 overlaps."""
    normal: Array | None = None
    """Out of the work, shape (3,); left out, the axis."""

    def __post_init__(self) -> None:
        axis = _unit(self.axis, 'circle axis')
        vars(self).update(centre=readonly(self.centre, (3,), 'circle centre'), axis=axis)
        for name in ('radius', 'turns'):
            vars(self)[name] = positive(getattr(self, name), f'circle {name}')
        aside = np.eye(3)[0 if abs(axis[0]) < 0.9 else 1] if self.start is None else self.start
        aside = np.asarray(aside, dtype=np.float64)
        start = _unit(aside - (aside @ axis) * axis, 'circle start across the axis')
        circle = _Circle.about(self.centre, axis, self.centre + self.radius * start)
        normal = axis if self.normal is None else _unit(self.normal, 'circle normal')
        vars(self).update(_circle=circle, normal=normal)

    @property
    def length(self) -> float:
        """Return the length of the seam [m]."""
        return 2.0 * np.pi * self.turns * self.radius

    def sample(self, s: Array) -> SeamFrames:
        circle: _Circle = vars(self)['_circle']
        return circle.sample(s, self.normal)


@dataclass(frozen=True, eq=False)
class Polyline(Path):
    """Straight pieces through points, each corner replaced by an arc of the blend radius."""

    points: Array
    """M at least 2, shape (M, 3) [m]; inner points are the corners."""
    blend: float = 0.005
    """Radius of the rounded corners [m]."""
    normal: Array = field(default_factory=_up)
    """Out of the work, shape (3,)."""

    def __post_init__(self) -> None:
        points = readonly(self.points, (None, 3), 'polyline points')
        if len(points) < 2:
            raise PathError(f'a polyline needs at least 2 points, got {len(points)}')
        vars(self).update(points=points, blend=positive(self.blend, 'polyline blend'))
        pieces = _pieces(points, self.blend)
        ends = np.cumsum([piece.length for piece in pieces])
        normal = _unit(self.normal, 'polyline normal')
        vars(self).update(normal=normal, _pieces=pieces, _ends=ends)

    @property
    def length(self) -> float:
        """Return the length of the rounded seam [m]."""
        return float(vars(self)['_ends'][-1])

    @property
    def detail(self) -> float:
        """Return the radius of the rounded corners [m]."""
        return min(self.blend, self.length)

    def sample(self, s: Array) -> SeamFrames:
        s = np.asarray(s, dtype=np.float64)
        ends, pieces = vars(self)['_ends'], vars(self)['_pieces']
        which = np.minimum(np.searchsorted(ends, s, side='right'), len(pieces) - 1)
        position, tangent = np.empty((2, s.size, 3))
        for k, piece in enumerate(pieces):
            here = which == k
            frames = piece.sample(s[here] - (ends[k] - piece.length))
            position[here], tangent[here] = frames.position, frames.tangent
        return _frames_on(position, tangent, self.normal)


def _pieces(points: Array, blend: float) -> list[Path]:
    steps = np.diff(points, axis=0)
    sizes = np.linalg.norm(steps, axis=1)
    if (sizes < 1e-9).any():
        k = int(np.argmin(sizes))
        raise PathError(f'polyline points {k} and {k + 1} are the same; drop one')
    directions = steps / sizes[:, None]
    cosines = np.clip((directions[:-1] * directions[1:]).sum(axis=1), -1.0, 1.0)
    if (cosines < -1.0 + 1e-9).any():
        k = int(np.argmin(cosines)) + 1
        raise PathError(f'the polyline turns straight back at point {k}; split it there')
    cuts = np.concatenate([[0.0], blend * np.tan(0.5 * np.arccos(cosines)), [0.0]])
    pieces: list[Path] = []
    for k, size in enumerate(sizes):
        room = size - cuts[k] - cuts[k + 1]
        if room < -1e-12:
            raise PathError(
                f'a blend radius of {blend:g} m does not fit between polyline points {k} and '
                f'{k + 1}, {size:g} m apart; take a smaller radius'
            )
        start = points[k] + cuts[k] * directions[k]
        end = points[k + 1] - cuts[k + 1] * directions[k]
        if room > 1e-9:
            aside = np.eye(3)[int(np.argmin(np.abs(end - start)))]
            pieces.append(Line(start, end, aside))
        if cuts[k + 1] > 1e-9:
            pieces.append(_corner(points[k + 1], directions[k : k + 2], cuts[k + 1], blend))
    return pieces


def _corner(corner: Array, directions: Array, cut: float, blend: float) -> Arc:
    """Return the arc that leaves the first direction and joins the second."""
    inward = directions[1] - directions[0]
    inward = inward / np.linalg.norm(inward)
    middle = corner + (np.hypot(cut, blend) - blend) * inward
    return Arc(corner - cut * directions[0], middle, corner + cut * directions[1])


_CELLS = 32
"""Pieces of a spline's span over which the arc length is integrated."""


@dataclass(frozen=True, eq=False)
class Spline(Path):
    """The cubic spline through points, in arc length."""

    points: Array
    """At least two, as taught or imported, shape (M, 3) [m]."""
    normal: Array = field(default_factory=_up)
    """Out of the work, shape (3,) or (M, 3); one per point is interpolated."""

    def __post_init__(self) -> None:
        points = readonly(self.points, (None, 3), 'spline points')
        if len(points) < 2:
            raise PathError(f'a spline needs at least 2 points, got {len(points)}')
        chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
        if (chords < 1e-9).any():
            k = int(np.argmin(chords))
            raise PathError(f'spline points {k} and {k + 1} are the same; drop one')
        knots = np.concatenate([[0.0], np.cumsum(chords)])
        curve = CubicSpline(knots, points)
        vars(self).update(points=points, _curve=curve, _parameter=_by_arc_length(curve, knots))
        if np.ndim(self.normal) == 1:
            vars(self).update(normal=_unit(self.normal, 'spline normal'), _normal_curve=None)
        else:
            normals = readonly(self.normal, (knots.size, 3), 'spline normals')
            vars(self).update(normal=normals, _normal_curve=CubicSpline(knots, normals))

    @property
    def length(self) -> float:
        """Return the arc length [m]."""
        return float(vars(self)['_parameter'].x[-1])

    @property
    def detail(self) -> float:
        """Return a few times the mean distance between points [m]."""
        return 6.0 * self.length / (len(self.points) - 1)

    def sample(self, s: Array) -> SeamFrames:
        curve, parameter = vars(self)['_curve'], vars(self)['_parameter']
        u = parameter(np.asarray(s, dtype=np.float64))
        velocity = curve(u, 1)
        tangent = velocity / np.linalg.norm(velocity, axis=1, keepdims=True)
        varying = vars(self)['_normal_curve']
        return _frames_on(curve(u), tangent, self.normal if varying is None else varying(u))


def _by_arc_length(curve: CubicSpline, knots: Array) -> CubicHermiteSpline:
    """Return the curve's parameter as a function of arc length."""
    fraction = np.arange(_CELLS) / _CELLS
    grid = (knots[:-1, None] + np.diff(knots)[:, None] * fraction).ravel()
    grid = np.append(grid, knots[-1])
    nodes, weights = np.polynomial.legendre.leggauss(6)
    half, middle = 0.5 * np.diff(grid), 0.5 * (grid[1:] + grid[:-1])
    speeds = np.linalg.norm(curve(middle[:, None] + half[:, None] * nodes, 1), axis=-1)
    length = np.concatenate([[0.0], np.cumsum((speeds * weights).sum(axis=1) * half)])
    speed = np.linalg.norm(curve(grid, 1), axis=1)
    if speed.min() < 1e-6 * speed.max():
        raise PathError('the spline turns back on itself at a point; add points or drop that one')
    return CubicHermiteSpline(length, grid, 1.0 / speed)


FORMS = ('sine', 'zigzag', 'triangle')


@dataclass(frozen=True, eq=False)
class Weave(Path):
    """
    A swing laid over a seam.

    Arc length, tangent and normal stay those of the seam underneath: speed is travel speed, and
    the torch does not turn with the swing.
    """

    seam: Path
    amplitude: float
    """Largest distance from the seam, to either side [m]."""
    wavelength: float
    """Travel per full swing [m]."""
    form: str = 'sine'
    """'sine'; 'zigzag', straight from side to side; or 'triangle', which runs down the work to
    each side of the corner of a fillet: the torch also lifts by the distance from the seam."""

    def __post_init__(self) -> None:
        if self.form not in FORMS:
            raise PathError(f'weave form must be one of {", ".join(FORMS)}, got {self.form!r}')
        for name in ('amplitude', 'wavelength'):
            vars(self)[name] = positive(getattr(self, name), f'weave {name}')

    @property
    def length(self) -> float:
        """Return the length of the seam underneath [m]."""
        return self.seam.length

    @property
    def detail(self) -> float:
        """Return the travel over which the torch swings [m]."""
        return min(self.wavelength, self.seam.detail)

    def sample(self, s: Array) -> SeamFrames:
        """Return the woven position and the seam's own frame at arc lengths s, shape (N,) [m]."""
        frames = self.seam.sample(s)
        swing = self.amplitude * self._swing(np.asarray(s) / self.wavelength)
        position = frames.position + swing[:, None] * frames.across
        if self.form == 'triangle':
            position = position + np.abs(swing)[:, None] * frames.normal
        return frames._replace(position=position)

    def _swing(self, cycles: Array) -> Array:
        """Return the swing between -1 and 1; it starts on the seam, to the left."""
        if self.form == 'sine':
            return np.sin(2.0 * np.pi * cycles)
        return np.abs((4.0 * cycles - 1.0) % 4.0 - 2.0) - 1.0


SEAMS: dict[str, type[Any]] = {
    'line': Line,
    'arc': Arc,
    'circle': Circle,
    'polyline': Polyline,
    'spline': Spline,
    'points': Spline,
}
"""The seams by their ``kind``."""
_BESIDE = ('kind', 'weave', 'torch', 'external')
"""Keys of a path file that are no arguments of its seam."""


def from_mapping(data: Mapping[str, Any]) -> Path:
    """
    Return the seam a mapping describes.

    Parameters
    ----------
    data : mapping
        ``kind`` and the arguments of that kind of seam, and ``weave`` where it weaves.

    Raises
    ------
    PathError
        The kind is unknown, or a key is missing, unknown or has a wrong value.

    """
    if not isinstance(data, Mapping):
        raise PathError(f'a path must be a mapping of keys, got {type(data).__name__}')
    kind = data.get('kind')
    if not isinstance(kind, str) or kind not in SEAMS:
        raise PathError(f"path 'kind' must be one of {', '.join(SEAMS)}, got {kind!r}")
    rest = {str(k): v for k, v in data.items() if k not in _BESIDE}
    seam: Path = _build(SEAMS[kind], rest, f'path of kind {kind!r}')
    weave = data.get('weave')
    if weave is None:
        return seam
    if not isinstance(weave, Mapping):
        raise PathError(f"'weave' must be a mapping of keys, got {type(weave).__name__}")
    woven: Path = _build(Weave, {'seam': seam, **weave}, "'weave'")
    return woven


def _build(cls: type[Any], values: dict[str, Any], what: str) -> Any:
    known = {field.name: field for field in fields(cls)}
    refuse_unknown(values, known, what, PathError)
    missing = [
        name
        for name, field in known.items()
        if field.default is MISSING and field.default_factory is MISSING and name not in values
    ]
    if missing:
        raise PathError(f'{what} needs the key {missing[0]!r}')
    try:
        return cls(**values)
    except (DataError, TypeError, ValueError, OverflowError) as error:
        raise PathError(f'{what}: {error}') from None


HEADINGS = ('fixed', 'seam')


@dataclass(frozen=True)
class Torch:
    """
    How the torch stands on the seam: its angles, counted from the perpendicular [1]_.

    The tool's z is the wire and points to the work. With all angles zero the wire runs against the
    work normal, the tool's x points along the travel and its y to the right of it. From there the
    torch is turned about its own axes: by ``work`` about x (it leans to the side), by ``travel``
    about y (positive: the wire points forward, *push*; negative: *drag*), by ``rotation`` about the
    wire.

    References
    ----------
    .. [1] AWS A3.0M, Standard Welding Terms and Definitions: work angle, travel angle.

    """

    work: float = 0.0
    travel: float = 0.0
    rotation: float = 0.0
    """[rad]"""
    heading: str = 'fixed'
    """'fixed': the torch turns about the wire no more than it must, as the wire does not care;
    'seam': the tool's x follows the travel."""

    def __post_init__(self) -> None:
        if self.heading not in HEADINGS:
            raise PathError(
                f'torch heading must be one of {", ".join(HEADINGS)}, got {self.heading!r}'
            )
        for name in ('work', 'travel', 'rotation'):
            value = getattr(self, name)
            if not (isinstance(value, (int, float)) and abs(value) <= 2.0 * np.pi):
                raise PathError(f'torch {name} must be an angle in radians, got {value!r}')

    def poses(self, frames: SeamFrames, first: SeamFrames | None = None) -> Array:
        """Return tool poses (N, 4, 4); a fixed heading refers to the first frame, or ``frames[0]``."""
        tilted = self._tilted(frames)
        if self.heading == 'fixed':
            start = frames if first is None else first
            reference = self._tilted(SeamFrames(*(field[:1] for field in start)))[0, :, 0]
            tilted = _headed(tilted[..., 2], reference)
        turned = tilted @ rotation_matrix([0.0, 0.0, self.rotation])
        return transform(turned, frames.position)

    def _tilted(self, frames: SeamFrames) -> Array:
        upright = np.stack([frames.tangent, -frames.across, -frames.normal], axis=-1)
        lean = rotation_matrix([self.work, 0.0, 0.0]) @ rotation_matrix([0.0, self.travel, 0.0])
        return upright @ lean

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any]) -> Torch:
        """Build a torch from a mapping of its attributes; PathError where one is wrong."""
        if not isinstance(data, Mapping):
            raise PathError(f"'torch' must be a mapping of keys, got {type(data).__name__}")
        refuse_unknown(data, cls.__dataclass_fields__, 'torch', PathError)
        return cls(**data)


def _headed(wire: Array, reference: Array) -> Array:
    """Return rotations with z along the wire and x as near the reference as that allows."""
    x = reference - (wire @ reference)[:, None] * wire
    size = np.linalg.norm(x, axis=1, keepdims=True)
    if (size < 1e-3).any():
        raise PathError(
            'the wire turns into the direction the torch heads for; '
            "use heading 'seam' or split the seam"
        )
    x = x / size
    return np.stack([x, np.cross(wire, x), wire], axis=-1)
