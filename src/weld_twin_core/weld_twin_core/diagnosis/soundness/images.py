# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Cameras and targets that are not what they were said to be.

Lenses, swapped cameras and mirrored targets show in the images alone: points are not where they
should be, and are so once the mistake is undone. How large a target is shows only beside the arm.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from ...arrays import Array
from ...bundle import adjusted
from ...cameras import Sightings
from ...cameras.sightings import Fitted, located
from ...errors import DataError
from ..algebra.definite import outside, span_of
from ..algebra.problem import ROWS
from ..limits import ENOUGH, FEW, HALVED, STRAY, WORTH
from .evidence import Case, Finding, mistake, note

IMAGE_FAR = 1.5
"""Noise of a pixel [px] from which images are looked into. Corners of boards are found within 0.05 to
0.5 px, circles of markers within 1 px."""
DOUBT = STRAY / 2.0
"""How far a lens may be from its calibration, in spreads between calibrations of one lens, before it is
looked into; twice as far it is another one. Calibrations with few images of a board are off by two or
three of them; another lens, or another zoom, by ten and more."""
TARGET_SCALE = 6e-3
"""Share by which all that cameras measure may be too large for the way of the arm. Links off by some
millimetres in a metre make half of it; a printer that fits the page makes 2 % and more."""
CALIBRATE = 'calibrate the camera, at the focus and zoom that it is used with'


def images(case: Case) -> Sequence[Finding]:
    seen = [r.images for r in case.recordings if r.images is not None]
    result = [finding for one in seen for finding in _by_themselves(one)]
    if result or not seen:
        return result
    pixels = (one.fitted.pixel for one in seen if one.fitted is not None)
    said = (note(f'Points are found within {pixel:.2f} px.') for pixel in pixels)
    return [*_beside_the_arm(case), *said]


def _by_themselves(seen: Sightings) -> Iterator[Finding]:
    fitted = seen.fitted
    if fitted is None:
        return
    for k, target in enumerate(seen.targets):
        if target.facing and _from_behind(seen, k):
            yield mistake(
                f'Board {target.name!r} is seen from behind in every image: its points are '
                'given, or printed, mirror-wise.',
                'target_mirrored',
                (target.name,),
                'give its points as the camera sees them, or do not mirror the images',
            )
            return
    far = float(np.abs(fitted.off).max())
    if fitted.pixel < IMAGE_FAR and far < DOUBT:
        return
    for suspicion, trial in _trials(seen):
        try:
            then = adjusted(trial)
        except DataError:
            continue
        if _undone(fitted, Fitted(then.pixel, then.off)):
            sentence = (
                f'{suspicion.sentence}; undone, points are found within {then.pixel:.2f} px instead '
                f'of {fitted.pixel:.2f} px, and lenses are as they were calibrated.'
            )
            yield suspicion._replace(sentence=sentence)
            return
    if far >= STRAY:
        c = int(np.abs(fitted.off).max(axis=1).argmax())
        name = seen.cameras[c].name
        yield mistake(
            f'The intrinsics of camera {name!r} are not those of its images: they are off by '
            f'{far:.0f} times what calibrations of one lens differ by.',
            'intrinsics',
            (name,),
            CALIBRATE,
        )


def _undone(before: Fitted, then: Fitted) -> bool:
    if float(np.abs(then.off).max()) > DOUBT:
        return False
    nearer = float((before.off**2).sum() - (then.off**2).sum())
    return HALVED * then.pixel < before.pixel or (
        WORTH * then.pixel < before.pixel and nearer > DOUBT**2
    )


def _trials(seen: Sightings) -> Iterator[tuple[Finding, Sightings]]:
    for one, other in combinations(range(len(seen.cameras)), 2):
        cameras = list(seen.cameras)
        first, second = cameras[one], cameras[other]
        cameras[one] = replace(first, lens=second.lens, mount=second.mount)
        cameras[other] = replace(second, lens=first.lens, mount=first.mount)
        words = f'Cameras {first.name!r} and {second.name!r} are swapped'
        swapped = mistake(words, 'cameras_swapped', (first.name,), 'exchange the two names')
        yield swapped, replace(seen, cameras=tuple(cameras))
    for k, target in enumerate(seen.targets):
        targets = list(seen.targets)
        targets[k] = replace(target, points=target.points * [-1.0, 1.0, 1.0])
        words = f'The points of target {target.name!r} are given mirror-wise'
        remedy = 'give them in a right-handed frame, as the camera sees them'
        mirrored = mistake(words, 'target_mirrored', (target.name,), remedy)
        yield mirrored, replace(seen, targets=tuple(targets))


def _from_behind(seen: Sightings, k: int) -> bool:
    """Return whether a board shows its back in most images that show it well."""
    sides = []
    for image in np.unique(seen.image[seen.target == k])[:ENOUGH]:
        for c, camera in enumerate(seen.cameras):
            rows = (seen.image == image) & (seen.camera == c) & (seen.target == k)
            points = seen.targets[k].points[seen.point[rows]]
            pose = located(camera.lens, points, seen.pixel[rows])
            if pose is not None:
                sides.append(float(pose[:3, 2] @ pose[:3, 3]))
    return bool(sides) and float(np.mean(np.array(sides) < 0.0)) > 1.0 - 2.0 * FEW


def _beside_the_arm(case: Case) -> Iterator[Finding]:
    """Report what is measured too large, or too far from the camera, for the way of the arm."""
    problem = case.problem.thinned(ROWS).of_frames()
    scale = problem.unit_scale()
    parts, _ = problem.frame_columns(problem.features(case.model))
    remaining = problem.whitened(problem.residuals(case.model), scale)
    frames = problem.whitened(parts, scale)
    span = span_of(frames)
    remaining = outside(remaining[None], span)[0]
    explanations: list[tuple[float, float, str]] = []
    for kind, axis in _too_large_along([r.images for r in problem.recordings]).items():
        each = zip(problem.recordings, problem.rows, problem.samples, strict=True)
        rows = [
            np.concatenate([(r.seen.position * axis).T, np.zeros((c - 3, m))]) for r, c, m in each
        ]
        column = outside(problem.whitened(rows, scale)[None], span)[0]
        size = float(column @ column)
        share = float(column @ remaining) / size
        explanations.append((share**2 * size / float(remaining @ remaining), share, kind))
    explained, share, kind = max(explanations, default=(0.0, 0.0, ''))
    if abs(share) > TARGET_SCALE and HALVED * explained > 1.0:
        yield _too_large(case, kind, share)


def _too_large_along(images: Sequence[Sightings | None]) -> dict[str, Array]:
    """Return what of a position may be too large: all, or the sight of one camera that stands."""
    every = [seen.cameras for seen in images if seen is not None]
    if len(every) < len(images):
        return {}
    alone = all(len(cameras) == 1 and cameras[0].mount == 'world' for cameras in every)
    sight = {'intrinsics': np.array([0.0, 0.0, 1.0])} if alone else {}
    return {'target_scale': np.ones(3), **sight}


def _too_large(case: Case, kind: str, share: float) -> Finding:
    seen = next(r.images for r in case.recordings if r.images is not None)
    size, large = f'{100.0 * abs(share):.1f} %', share > 0.0
    if kind == 'intrinsics':
        name, remedy = seen.cameras[0].name, CALIBRATE
        words = (
            f'Camera {name!r} sees everything {size} too {"far" if large else "near"} for the way of '
            'the arm: its focal length is off by as much.'
        )
    else:
        name, remedy = seen.targets[0].name, 'measure it with a calliper and give its true size'
        words = (
            f'All that the cameras measure is {size} too {"large" if large else "small"} for the way '
            f'of the arm: target {name!r} is {"smaller" if large else "larger"} than it was said to '
            'be.'
        )
    return mistake(words, kind, (name,), remedy)
