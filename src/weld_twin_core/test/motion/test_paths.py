# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Seams by hand values and by integration, the torch on them, and refusals."""

import numpy as np
import pytest
import yaml
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

from weld_twin_core import PathError, catalog, default_seam, solve_path
from weld_twin_core.motion.paths import (
    KINDS,
    Arc,
    Circle,
    Line,
    Polyline,
    Spline,
    Torch,
    Weave,
    from_mapping,
)

SEAMS = {
    'line': Line([0.3, 0.1, 0.2], [0.4, 0.3, 0.1]),
    'arc': Arc([0.3, 0.0, 0.2], [0.4, 0.1, 0.25], [0.3, 0.2, 0.2]),
    'circle': Circle([0.4, 0.0, 0.2], 0.1, [0.2, 0.1, 1.0]),
    'polyline': Polyline([[0, 0, 0], [0.2, 0, 0], [0.2, 0.1, 0.02], [0.4, 0.1, 0]], 0.02),
    'spline': Spline([[0, 0, 0], [0.1, 0.05, 0], [0.2, 0, 0.02], [0.3, 0.05, 0]]),
}


@pytest.mark.parametrize('seam', SEAMS.values(), ids=SEAMS)
def test_a_seam_is_travelled_at_unit_speed_along_its_tangent(seam):
    s = np.linspace(1e-4, seam.length - 1e-4, 301)
    frames, step = seam.sample(s), 1e-6
    slope = (seam.sample(s + step).position - seam.sample(s - step).position) / (2.0 * step)
    np.testing.assert_allclose(slope, frames.tangent, atol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(frames.tangent, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(frames.normal, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose((frames.normal * frames.tangent).sum(axis=1), 0.0, atol=1e-12)


def test_an_arc_passes_its_three_points_and_has_the_hand_length():
    # Quarter circle of radius 0.1 about the origin, in a plane tilted by nothing.
    half = 0.1 * np.sqrt(0.5)
    arc = Arc([0.1, 0, 0], [half, half, 0], [0, 0.1, 0])
    assert arc.radius == pytest.approx(0.1)
    assert arc.length == pytest.approx(0.05 * np.pi)
    np.testing.assert_allclose(
        arc.sample(arc.length * np.array([0.0, 0.5, 1.0])).position,
        [[0.1, 0, 0], [half, half, 0], [0, 0.1, 0]],
        atol=1e-12,
    )


def test_an_arc_through_the_far_side_takes_the_long_way():
    arc = Arc([0.1, 0, 0], [0, -0.1, 0], [0, 0.1, 0])
    assert arc.length == pytest.approx(0.15 * np.pi)


def test_a_circle_closes_and_starts_where_it_is_told():
    circle = Circle([0.4, 0.1, 0.2], 0.05, start=[0.0, 1.0, 0.0])
    ends = circle.sample(np.array([0.0, circle.length / 4, circle.length])).position
    np.testing.assert_allclose(ends, [[0.4, 0.15, 0.2], [0.35, 0.1, 0.2], [0.4, 0.15, 0.2]])


def test_a_rounded_corner_has_the_hand_length_and_stays_in_its_radius():
    corner = Polyline([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0]], 0.02)
    # Each leg loses r tan(45 deg); the corner is a quarter circle.
    assert corner.length == pytest.approx(0.2 - 0.04 + 0.02 * np.pi / 2)
    middle = corner.sample(np.array([corner.length / 2]))
    np.testing.assert_allclose(
        middle.position[0, :2], [0.08 + 0.02 * 0.5**0.5, 0.02 - 0.02 * 0.5**0.5]
    )
    np.testing.assert_allclose(middle.tangent[0], [0.5**0.5, 0.5**0.5, 0.0], atol=1e-12)


def test_a_spline_passes_its_points_and_its_length_is_the_integral():
    points = np.array([[0, 0, 0], [0.1, 0.05, 0], [0.2, 0, 0.02], [0.3, 0.05, 0]])
    spline = Spline(points)
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
    curve = CubicSpline(np.append(0.0, np.cumsum(chords)), points)
    length = quad(lambda u: np.linalg.norm(curve(u, 1)), 0, curve.x[-1], limit=200, epsabs=1e-12)[
        0
    ]
    assert spline.length == pytest.approx(length, abs=1e-10)
    dense = spline.sample(np.linspace(0.0, spline.length, 20001)).position
    for point in points:
        assert np.linalg.norm(dense - point, axis=1).min() < 1e-5


def test_a_normal_per_point_is_followed():
    points = [[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0]]
    spline = Spline(points, [[0, 0, 1], [0, 1, 1], [0, 1, 0]])
    normal = spline.sample(np.array([0.0, 0.1, 0.2])).normal
    np.testing.assert_allclose(normal, [[0, 0, 1], [0, 0.5**0.5, 0.5**0.5], [0, 1, 0]], atol=1e-12)


@pytest.mark.parametrize('form, quarter_way', [('sine', 0.5**0.5), ('zigzag', 0.5)])
def test_a_weave_swings_by_hand_values(form, quarter_way):
    weave = Weave(Line([0, 0, 0], [0.1, 0, 0]), 0.002, 0.008, form)
    s = 0.008 * np.array([0.0, 0.125, 0.25, 0.5, 0.75, 1.0])
    frames = weave.sample(s)
    np.testing.assert_allclose(frames.position[:, 0], s)
    swing = 0.002 * np.array([0.0, quarter_way, 1.0, 0.0, -1.0, 0.0])
    np.testing.assert_allclose(frames.position[:, 1], swing, atol=1e-15)
    np.testing.assert_allclose(frames.position[:, 2], 0.0)
    np.testing.assert_allclose(frames.tangent, np.tile([1.0, 0.0, 0.0], (6, 1)))
    assert weave.length == pytest.approx(0.1)


def test_a_triangle_weave_lifts_as_far_as_it_swings():
    weave = Weave(Line([0, 0, 0], [0.1, 0, 0]), 0.002, 0.008, 'triangle')
    position = weave.sample(0.008 * np.array([0.0, 0.25, 0.75])).position
    expected = 0.002 * np.array([[0, 0], [1, 1], [-1, 1]])
    np.testing.assert_allclose(position[:, 1:], expected, atol=1e-15)


def test_an_upright_torch_points_its_wire_at_the_work_and_x_along_the_travel():
    frames = Line([0, 0, 0], [0, 0.1, 0]).sample(np.array([0.05]))
    pose = Torch().poses(frames)[0]
    np.testing.assert_allclose(pose[:3, 2], [0, 0, -1], atol=1e-12)
    np.testing.assert_allclose(pose[:3, 0], [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(pose[:3, 3], [0, 0.05, 0], atol=1e-12)


@pytest.mark.parametrize('heading', ['fixed', 'seam'])
@pytest.mark.parametrize(
    'angles, wire',
    [
        ({'travel': 0.2}, [np.sin(0.2), 0, -np.cos(0.2)]),
        ({'travel': -0.2}, [-np.sin(0.2), 0, -np.cos(0.2)]),
        ({'work': 0.3}, [0, np.sin(0.3), -np.cos(0.3)]),
        ({'rotation': 0.4}, [0, 0, -1]),
    ],
)
def test_torch_angles_lean_the_wire_as_documented(angles, wire, heading):
    frames = Line([0, 0, 0], [0.1, 0, 0]).sample(np.array([0.05]))
    pose = Torch(**angles, heading=heading).poses(frames)[0]
    np.testing.assert_allclose(pose[:3, 2], wire, atol=1e-12)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)


def test_a_fixed_heading_does_not_turn_round_a_circle_and_a_seam_heading_does():
    circle = Circle([0.4, 0, 0.2], 0.1)
    frames = circle.sample(np.linspace(0.0, circle.length, 9))
    fixed = Torch().poses(frames)[:, :3, :3]
    np.testing.assert_allclose(fixed, np.broadcast_to(fixed[0], (9, 3, 3)), atol=1e-12)
    following = Torch(heading='seam').poses(frames)[:, :3, 0]
    np.testing.assert_allclose(following, frames.tangent, atol=1e-12)


def test_a_leaning_torch_keeps_its_angles_all_the_way_round():
    circle = Circle([0.4, 0, 0.2], 0.1)
    frames = circle.sample(np.linspace(0.0, circle.length, 40))
    wire = Torch(work=0.3, travel=0.2).poses(frames)[:, :3, 2]
    along, out = (wire * frames.tangent).sum(axis=1), -(wire * frames.normal).sum(axis=1)
    np.testing.assert_allclose(along, np.sin(0.2), atol=1e-12)
    np.testing.assert_allclose(out, np.cos(0.2) * np.cos(0.3), atol=1e-12)


BUILT = yaml.safe_load("""
- [{kind: line, start: [0, 0, 0], end: [1, 0, 0], normal: [0, 1, 0]}, "Line"]
- [{kind: arc, start: [0, 0, 0], middle: [1, 1, 0], end: [2, 0, 0]}, "Arc"]
- [{kind: circle, centre: [0, 0, 0], radius: 0.1, turns: 0.5}, "Circle"]
- [{kind: polyline, points: [[0, 0, 0], [1, 0, 0], [1, 1, 0]], blend: 0.1}, "Polyline"]
- [{kind: spline, points: [[0, 0, 0], [1, 0, 0], [1, 1, 0]]}, "Spline"]
- [{kind: points, points: [[0, 0, 0], [1, 0, 0], [1, 1, 0]]}, "Spline"]
- - {kind: line, start: [0, 0, 0], end: [1, 0, 0], weave: {amplitude: 0.01, wavelength: 0.02,
    form: zigzag}}
  - Weave
""")


@pytest.mark.parametrize('data, cls', BUILT)
def test_every_kind_is_built_from_its_mapping(data, cls):
    assert type(from_mapping(data)).__name__ == cls


LINE = {'kind': 'line', 'start': [0, 0, 0], 'end': [1, 0, 0]}


WRONG = yaml.safe_load(r"""
- [{kind: lime}, "'kind' must be one of line, arc, .*, got 'lime'"]
- [{kind: line, start: [0, 0, 0]}, "kind 'line' needs the key 'end'"]
- [{stop: 1}, "kind 'line' has the unknown key 'stop'; known keys are start"]
- [{end: [0, 0]}, 'kind ''line'': line end must have shape \(3\), got \(2,\)']
- [{end: [0, 0, 0]}, "the line has no length"]
- [{normal: [0, 0, 0]}, "line normal must not be the zero vector"]
- [{weave: {amplitude: 0.1}}, "'weave' needs the key 'wavelength'"]
- [{weave: 3}, "'weave' must be a mapping of keys, got int"]
- [{weave: {amplitude: 0.1, wavelength: 0.0}}, "weave wavelength must be a pos"]
- [{weave: {amplitude: 1, wavelength: 1, form: u}}, "weave form must be one"]
- [{kind: arc, start: [0, 0, 0], middle: [1, 0, 0], end: [2, 0, 0]}, "lie on a line"]
- [{kind: circle, centre: [0, 0, 0], radius: a}, "radius must be a positive number"]
- [{kind: polyline, points: [[0, 0, 0]]}, "needs at least 2 points, got 1"]
- [{kind: polyline, points: [[0, 0, 0], [0, 0, 0]]}, "points 0 and 1 are the same"]
- [{kind: polyline, points: [[0, 0, 0], [1, 0, 0], [0, 0, 0]]}, "back at point 1"]
- - {kind: polyline, points: [[0, 0, 0], [1, 0, 0], [1, 1, 0]], blend: 2.0}
  - a blend radius of 2 m does not fit between polyline points 0 and 1, 1 m apart
- - {kind: spline, points: [[0, 0, 0], [0, 0, .nan]]}
  - value.s. that are not fin
- [3, "a path must be a mapping of keys, got int"]
""")


@pytest.mark.parametrize('data, sentence', WRONG)
def test_a_wrong_description_is_refused_in_one_sentence(data, sentence):
    changed = isinstance(data, dict) and 'kind' not in data
    with pytest.raises(PathError, match=sentence) as refused:
        from_mapping(LINE | data if changed else data)
    assert '\n' not in str(refused.value)


def test_a_normal_along_the_seam_is_refused():
    with pytest.raises(PathError, match=r'normal lies along the seam at \(0\.000, 0\.000, 0\.50'):
        Line([0, 0, 0], [0, 0, 1]).sample(np.array([0.5]))


@pytest.mark.parametrize(
    'data, sentence',
    [
        ({'wrk': 1.0}, "torch has the unknown key 'wrk'; known keys are work"),
        ({'work': 'a'}, "torch work must be an angle in radians, got 'a'"),
        ({'travel': 15.0}, 'torch travel must be an angle in radians, got 15.0'),
        ({'heading': 'x'}, "torch heading must be one of fixed, seam, got 'x'"),
    ],
)
def test_a_wrong_torch_is_refused(data, sentence):
    with pytest.raises(PathError, match=sentence):
        Torch.from_mapping(data)


@pytest.mark.parametrize('kind', KINDS)
def test_the_bundled_seam_is_in_reach_of_a_robot_that_hangs_from_a_moved_base(kind):
    robot = catalog.load('abb_irb120')
    base = np.diag([1.0, -1.0, -1.0, 1.0])
    base[:3, 3] = [2.0, 1.0, 3.0]
    hanging = type(robot).from_mapping(robot.to_mapping() | {'gravity': [0.0, 0.0, 9.80665]})
    hanging = hanging.with_frames(base=base)
    seam = default_seam(hanging, kind)
    frames = seam.sample(np.linspace(0.0, seam.length, 30))
    assert (frames.normal[:, 2] > 0.99).all()
    assert (frames.position[:, 2] < 3.0).all()
    assert solve_path(hanging, Torch().poses(frames)).residual.max() < 1e-9


def test_an_unknown_bundled_seam_is_refused_with_the_known_ones():
    with pytest.raises(PathError, match="kind 'heart'; there are line, arc"):
        default_seam(catalog.load('ur5'), 'heart')
