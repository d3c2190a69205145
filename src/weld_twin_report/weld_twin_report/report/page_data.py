# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the page of a diagnosis draws from, and the three directions that it speaks of everywhere."""

from typing import Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_core.recording import Recording
from weld_twin_core.twin.twin import Twin
from weld_twin_nodes.wording.mending import as_it_is, parted, switches, trusted
from weld_twin_nodes.wording.quantities import fine, millimetres

from .charts import thinned

_POINTS = 6000
"""Points of all recordings and lines together: half a megabyte on the page."""


def static(diagnosis: Diagnosis, k: int) -> bool:
    """Tell whether a recording is of stations at rest."""
    return k < len(diagnosis.recordings) and bool(diagnosis.recordings[k].joints.static)


def drawn(diagnosis: Diagnosis, k: int) -> np.ndarray:
    """Return which samples of a recording the page shows, the largest deviations among them."""
    remaining, parts = parted(diagnosis)
    good = np.flatnonzero(trusted(diagnosis, k))
    if not good.size:
        return good
    each = max(_POINTS // (len(remaining) * (2 + parts[k].shape[0])), 60)
    sizes = [np.linalg.norm(v[good], axis=1) for v in (as_it_is(diagnosis, k), remaining[k])]
    return np.asarray(good[thinned(sizes, each)])


def along(diagnosis: Diagnosis, k: int) -> Array:
    """Return the time [s] of every sample along the recording; the number of a station at rest."""
    t = diagnosis.traces.t[k]
    return np.arange(1.0, t.size + 1.0) if static(diagnosis, k) else t - t[:1]


def squares(diagnosis: Diagnosis) -> list[list[float]]:
    """
    Return the mean products [mm^2] of what is left and what each switch adds, over good samples.

    With ones for what is there and zeros for what is mended, v' S v is the mean square deviation.
    """
    if diagnosis.contacts is not None:
        return [[0.0]]
    remaining, parts = parted(diagnosis)
    stacked = [
        np.concatenate([one[None], more])[:, trusted(diagnosis, k)]
        for k, (one, more) in enumerate(zip(remaining, parts, strict=True))
    ]
    if not stacked:
        return [[0.0]]
    fields = 1e3 * np.concatenate(stacked, axis=1)
    count = max(fields.shape[1], 1)
    return [[float(v) for v in row] for row in np.einsum('imc,jmc->ij', fields, fields) / count]


def page_data(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return what the scripts of the page draw from; lengths in um, angles in degrees."""
    remaining, parts = parted(diagnosis)
    shown = range(0 if diagnosis.contacts is not None else len(remaining))
    runs = [_run(diagnosis, k, remaining[k], parts[k]) for k in shown]
    top, floor = _large(diagnosis), diagnosis.gap.noise_floor_m
    # Deviations are drawn 1, 2 or 5 times a power of ten larger than life.
    points = np.concatenate([*diagnosis.traces.measured, np.zeros((0, 3))])
    extent = float(np.ptp(points, axis=0).max()) if points.size else 1.0
    wanted = max(_SHOWN * extent / top, 1.0)
    power = 10 ** int(np.floor(np.log10(wanted)))
    return {
        'runs': runs,
        'joints': list(diagnosis.model.robot.joint_names),
        'found': bool(diagnosis.model.found),
        'switches': [switch.label for switch in switches(diagnosis)],
        'squares': squares(diagnosis),
        'top': round(1e6 * top, 1),
        'stretch': int(power * max(step for step in (1, 2, 5) if step * power <= wanted * 1.0001)),
        # Unsound stations have none.
        'floor': round(1e3 * floor, 5) if np.isfinite(floor) else None,
    }


def _run(diagnosis: Diagnosis, k: int, remaining: Array, parts: Array) -> dict[str, Any]:
    traces, index = diagnosis.traces, drawn(diagnosis, k)
    recording = diagnosis.recordings[k] if k < len(diagnosis.recordings) else None
    bare = {} if parts.size else {'before': _micrometres(traces.before[k][index])}
    return {
        **bare,
        'name': recording.name if recording is not None else f'recording {k + 1}',
        'dots': static(diagnosis, k),
        't': [round(float(t), 3) for t in along(diagnosis, k)[index]],
        'path': _micrometres((traces.measured[k] - traces.before[k])[index]),
        'left': _micrometres(remaining[index]),
        'parts': [_micrometres(part[index]) for part in parts],
        'joints': [] if recording is None else _joints(diagnosis, recording, traces.t[k][index]),
    }


def _joints(diagnosis: Diagnosis, recording: Recording, t: Array) -> list[list[float]]:
    """Return the joint positions at some times, by joint: degrees, or mm where it slides."""
    motion, robot = recording.joints, diagnosis.model.robot
    factors = [1e3 if slides else 180.0 / np.pi for slides in robot.prismatic]
    return [
        [round(factor * float(v), 2) for v in np.interp(t, motion.t, motion.q[:, i])]
        for i, factor in enumerate(factors)
    ]


def _micrometres(points: Array) -> list[float]:
    return [round(float(value), 2) for value in np.nan_to_num(1e6 * points).ravel()]


def _large(diagnosis: Diagnosis) -> float:
    """Return a deviation [m] that hardly any sample exceeds, never quite nothing."""
    if diagnosis.contacts is not None:
        return 1e-6
    sizes = [
        np.linalg.norm(as_it_is(diagnosis, k)[trusted(diagnosis, k)], axis=1)
        for k in range(len(diagnosis.traces.t))
    ]
    every = np.concatenate([np.zeros(0), *sizes])
    return max(float(np.percentile(every, 98)), 1e-6) if every.size else 1e-6


_SHOWN = 0.04
"""Part of the seam's extent that a large deviation is drawn at."""


SEEN = 5e-4
"""Share of the squared gap below which a row would read 0.0 %."""


def remainder(diagnosis: Diagnosis) -> tuple[tuple[str, float], ...]:
    """Return what the causes do not hold: what has no name, what is not explained, what is noise."""
    rest = diagnosis.shares
    if any(cause.rest for cause in diagnosis.causes):
        # What is left has a row of its own, with the place where most of it is.
        return (('noise', rest.noise),)
    products: Any = np.array(squares(diagnosis))  # the first is of what is left of all
    whole = float(products.sum())
    remaining = max((float(products[0, 0]) / whole if whole > 0.0 else 1.0) - rest.noise, 0.0)
    unnamed = rest.unexplained - remaining
    # What has a place and no name is not explained by that.
    named = bool(diagnosis.effects or diagnosis.families or not diagnosis.causes)
    rows = [('not explained' if named else 'not placed', rest.unexplained), ('noise', rest.noise)]
    if unnamed >= _SPLIT:
        rows[:1] = [('fitted, but not to be named', unnamed), ('not explained', remaining)]
    return tuple(rows)


_SPLIT = 0.02
"""Share from which what is fitted without a name has a row of its own."""


def places(diagnosis: Diagnosis) -> int:
    """Return the decimals of every share of a page: one where any interval needs it, or none."""
    return int(any(fine(*cause.share_ci90) for cause in diagnosis.causes if cause.share >= SEEN))


_STILL = 1e-9
"""Travel [m] between samples below which there is no direction of travel."""
_SIDES = (
    ('ahead', 'behind'),
    ('to the left', 'to the right'),
    ('out along the tool', 'back along the tool'),
)
"""What the sign of each direction is called: left as seen from the tool, out is its axis z."""
_SEEN = 5e-7
"""Length [m] that would read 0.000 mm."""


def components(diagnosis: Diagnosis, k: int, vectors: Array) -> Array | None:
    """
    Return vectors of a recording along the seam, across it and along the tool, (M, 3) [m].

    Along is the direction of travel, which stations lack; the tool's axis z is made square to it.
    """
    traces, model = diagnosis.traces, diagnosis.model
    if static(diagnosis, k) or k >= len(diagnosis.recordings) or len(vectors) < 3:
        return None
    robot = model.robot.with_frames(base=model.bases[k]) if k < len(model.bases) else model.robot
    tool = Twin(robot).poses(diagnosis.recordings[k], traces.t[k]).rotation[:, :, 2]
    along, out = _travel(traces.measured[k] - traces.before[k]), tool
    if along is None:
        return None
    out = _unit(out - along * (out * along).sum(axis=1, keepdims=True))
    axes = np.stack([along, np.cross(along, out), out], axis=1)
    return np.asarray(np.einsum('mij,mj->mi', axes, vectors))


def _travel(position: Array) -> Array | None:
    """Return the direction of travel; of samples at rest that of the nearest that moves."""
    along = _unit(np.gradient(position, axis=0))
    moves = np.flatnonzero(along.any(axis=1))
    if not moves.size:
        return None
    samples = np.arange(len(along))
    after = np.clip(np.searchsorted(moves, samples), 0, moves.size - 1)
    before = np.maximum(after - 1, 0)
    nearer = np.abs(moves[before] - samples) < np.abs(moves[after] - samples)
    return np.asarray(along[moves[np.where(nearer, before, after)]])


def _unit(vectors: Array) -> Array:
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(
        np.divide(vectors, size, out=np.zeros_like(vectors), where=size > _STILL), dtype=float
    )


def rms_words(parts: Array) -> str:
    """Return the RMS along each direction, in words; parts are (M, 3) [m]."""
    along, across, tool = np.sqrt((parts**2).mean(axis=0))
    return (
        f'{millimetres(along)} along the seam, {millimetres(across)} across it, '
        f'{millimetres(tool)} along the tool'
    )


def sides_words(part: Array) -> str:
    """Return to which side and how far, in words; a part is (3,) [m]."""
    sides = [
        f'{millimetres(abs(float(value)))} {side[int(value < 0.0)]}'
        for value, side in zip(part, _SIDES, strict=True)
        if abs(value) >= _SEEN
    ]
    return ', '.join(sides)


def worst(diagnosis: Diagnosis) -> tuple[int, int, float] | None:
    """Return the recording, the sample and the size [m] of the largest trusted deviation."""
    best: tuple[int, int, float] | None = None
    for k in range(len(diagnosis.traces.t)):
        size = np.linalg.norm(as_it_is(diagnosis, k), axis=1) * trusted(diagnosis, k)
        if size.size and (best is None or size.max() > best[2]):
            best = k, int(np.argmax(size)), float(size.max())
    return best


def at_rest(diagnosis: Diagnosis) -> bool:
    """Tell whether all that was recorded are stations at rest."""
    return bool(diagnosis.recordings) and all(r.joints.static for r in diagnosis.recordings)


def left_out(diagnosis: Diagnosis) -> tuple[int, int]:
    """Return how many samples no figure counts, and how many there are."""
    good = [trusted(diagnosis, k) for k in range(len(diagnosis.traces.t))]
    return sum(int((~g).sum()) for g in good), sum(g.size for g in good)


def seen_at(diagnosis: Diagnosis, k: int, sample: int, size: float) -> str:
    """Return where along a recording a deviation [m] is, in words."""
    return f'{millimetres(size)} at {instant(diagnosis, k, sample)}'


def instant(diagnosis: Diagnosis, k: int, sample: int) -> str:
    """Return when a sample of a recording was taken, or which station it is."""
    if static(diagnosis, k):
        return f'station {sample + 1}'
    return f'{along(diagnosis, k)[sample]:.1f} s'
