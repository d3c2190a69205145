# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The causes that a reader can think away."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.result import Cause, Diagnosis, Site

from .words import CURVES, listed, open_sets, site_name, someplace
from .words import cause as called

MOST = 8
"""Causes with a switch of their own; the others share one."""
OTHERS = 'all smaller ones together'
_NAMED = 3
"""Names in a heading; more are counted."""


class Switch(NamedTuple):
    """One switch: its name, and the causes (as the contributions count them) that it mends."""

    label: str
    members: tuple[int, ...]


def cause_name(diagnosis: Diagnosis, cause: Cause) -> str:
    """Return a cause as a heading: every name it may have, or its place where it has none."""
    named = [site for site, _ in cause.name if site.effect not in CURVES]
    if not named:
        return someplace(cause)
    if diagnosis.families and len(named) > 1:
        return _together(named)
    alike = alternatives(diagnosis, cause) or tuple(named[:1])
    more = [f'{len(alike) - _NAMED} more'] if len(alike) > _NAMED else []
    return listed([*map(site_name, alike[:_NAMED]), *more], 'or')


def _together(sites: Sequence[Site]) -> str:
    """Return a kind of small errors with the joints that need it, and what would do as well."""
    kind = sites[0].effect
    own = [str(site.joint) for site in sites if site.effect == kind and site.joint]
    more = [f'{len(own) - _NAMED} more'] if len(own) > _NAMED else []
    name = called(kind, listed([*own[:_NAMED], *more]) if own else None)
    return listed([name, *(site_name(site) for site in sites if site.effect != kind)], 'or')


def alternatives(diagnosis: Diagnosis, cause: Cause) -> tuple[Site, ...]:
    """Return what these data cannot tell apart, the most probable first; nothing where one is."""
    result = [effect for k, effect in enumerate(diagnosis.model.found) if k in cause.members]
    own = {Site(effect.name, effect.site) for effect in result} | {s for s, _ in cause.name[:1]}
    return next((group for group in open_sets(diagnosis) if own & set(group)), ())


def switches(diagnosis: Diagnosis) -> tuple[Switch, ...]:
    """Return the switches, largest share first; none where no cause can be thought away."""
    contributions = diagnosis.contributions
    if contributions is None or not contributions.parts or diagnosis.contacts is not None:
        return ()
    count = contributions.parts[0].shape[0]
    own = [k for k, cause in enumerate(diagnosis.causes) if cause.members]
    out = [Switch(cause_name(diagnosis, diagnosis.causes[k]), (k,)) for k in own[:MOST]]
    rest = tuple(own[MOST:]) + tuple(range(len(diagnosis.causes), count))
    return (*out, *([Switch(OTHERS, rest)] if rest else []))


def parted(diagnosis: Diagnosis) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Return what is left, (M, 3), and what switches add to it, (S, M, 3), by recording."""
    traces, contributions, all_switches = (
        diagnosis.traces,
        diagnosis.contributions,
        switches(diagnosis),
    )
    if contributions is None or not all_switches:
        return traces.after, tuple(np.zeros((0, *part.shape)) for part in traces.after)
    return contributions.left, tuple(
        np.array([part[list(switch.members)].sum(axis=0) for switch in all_switches])
        for part in contributions.parts
    )


def as_it_is(diagnosis: Diagnosis, k: int) -> Array:
    """Return the deviation of a recording before anything is mended, (M, 3) [m]."""
    remaining, parts = (item[k] for item in parted(diagnosis))
    return remaining + parts.sum(axis=0) if parts.size else diagnosis.traces.before[k]


def trusted(diagnosis: Diagnosis, k: int) -> np.ndarray:
    """Return which samples of a recording to draw: a gross outlier would hide all the others."""
    traces = diagnosis.traces
    if traces.trusted:
        return traces.trusted[k]
    return np.ones(traces.t[k].size, dtype=bool)
