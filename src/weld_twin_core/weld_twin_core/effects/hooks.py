# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What an effect may tell of itself beyond `displace` and `gradient`; everything has a default.

`Traits` is a record of what it is. `TwinHooks`, `SearchHooks` and `FitHooks` are groups of questions,
one for each part of the program that asks: the twin, the search, and the fit. An effect that has more
to tell than the default derives a group and names it, as in ``fit = Hooked(MyFit)``. None of those who
ask knows any effect by name. The page of effects lists all in a table.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..arm.channels import Shift
from ..arm.robot import Robot
from ..arrays import Array
from .view import View

_JOINT_STEP = 1e-5
"""Step of numerical derivatives by a joint's position [rad or m]: rounding and bend weigh alike."""


@dataclass(frozen=True)
class Waves:
    """Which orders of waves in its joint's angle an effect is searched for."""

    dense: int
    """A fit of many small errors takes all orders up to this one along, in cycles per turn."""
    highest: int
    """Single lines are looked for up to this order."""


@dataclass(frozen=True)
class Traits:
    """What an effect is: its words, where it is entered, what brings it out, who looks for it."""

    title: str = ''
    """What people call it; left out, its name with spaces."""
    meaning: str = ''
    """What is wrong with a machine that has it: half a sentence in plain words."""
    formula: str = ''
    """What it does to the channels, as the page of effects lists it."""
    apart: Mapping[str, str] = field(default_factory=dict)
    """What parts it from an effect that moves the tool alike on every motion, by the other's name;
    by its own where two of it do."""
    entered: str = ''
    """Which field of a controller takes a correction of it: 'zero', 'base', 'root', 'tool', 'load',
    'model' or 'ratio'; 'program' where none does and the points of a program can be corrected. Else
    what it is a matter of: then there is nothing to enter."""
    depends_on: str = 'constant'
    """What it depends on: 'constant', 'angle', 'direction', 'speed', 'acceleration', 'load',
    'temperature', 'time' or 'place' (in the workspace)."""
    place: str = 'joint'
    """Where it sits: at its 'joint', or at 'base', 'tool', 'instrument', 'clock' or 'load'."""
    cause: bool = True
    """Whether a diagnosis may name it; noise and the set-up's own motion are nuisance."""
    changes_in_use: bool = False
    """Whether use changes it: belts are taken off, tools are knocked, gears wear, loads are swapped."""
    changes_slowly: bool = False
    """Whether warmth alone changes it in use, which takes no step."""
    set_at_controller: bool = False
    """Whether a person can set it first: named before others that are the same on any motion."""
    fitted_with: str | None = None
    """The frame it is an error of, 'base' or 'tool': no cause where that frame is fitted."""
    of_setup: bool = False
    """Whether it belongs to one set-up and not to the robot."""
    dated: bool = False
    """Whether it sets in at an instant, and is a cause only where the data checks found one."""
    endless: bool = False
    """Whether it grows with the time for ever: how large it is after a recording nobody knows."""
    jumps: bool = False
    """Whether it jumps at an instant or at places of its joint, of which no derivative knows."""
    common: bool = True
    """Whether every arm has a little of it, so that a fit of many small errors takes it along."""
    demand: int = 0
    """What it asks of stations before a fit of many small errors takes it along: 0 as little as
    the geometry, 1 more of them, 2 a great many."""
    by_motion: bool = False
    """Whether a joint must move for it to differ from a constant."""
    everywhere: bool = False
    """Whether a prediction allows for it on every joint, clock or instrument where it was not found."""
    lacking: str = ''
    """What is wrong where it does not fit, after its name; ``robot`` and ``site`` are theirs.
    Without, it is only not looked for there."""
    waves: Waves | None = None
    """Set by a sum of waves in a joint's angle; its search gives `orders`, `with_orders`, `lines`."""
    bends: bool = False
    """Whether it stands for waves of a joint that travels too little; its search gives `bend`."""


class _Hooks:
    """Questions to a kind of effect, or to an effect."""

    def __init__(self, kind: Any, effect: Any) -> None:
        self.kind, self.effect = kind, effect


_G = TypeVar('_G', bound=_Hooks, covariant=True)


class Hooked(Generic[_G]):
    """An attribute of effects that is a group of questions to the effect it is asked of."""

    def __init__(self, group: type[_G]) -> None:
        self.group = group

    def __get__(self, effect: Any, kind: Any) -> _G:
        """Return the group, with the effect that is asked; with the kind alone, where it is."""
        return self.group(kind, effect)


class TwinHooks(_Hooks):
    """What the twin asks, and who takes an effect to another recording."""

    @property
    def settles(self) -> bool:
        """Return whether a spring takes the load of the posture that it has sagged to."""
        return True

    @property
    def by_effort(self) -> float:
        """Return what load torque it takes for each N m of measured effort; 0 where statics tell."""
        return 0.0

    def slope(self, view: View) -> Shift:
        """Return d displacement / d own joint position, per ('q', i) channel; empty when none."""
        return {}

    def load_slope(self, view: View) -> Array:
        """
        Return how the load torques that this adds change with the joints, shape (n, n, ..., N).

        Torque first, then joint. Unless an effect gives the closed form, by central differences.
        """
        n = view.robot.n
        slope = np.zeros((n, n, *view.frames.position.shape[:-1]))
        for j in range(n):
            high, low = (
                self.effect.displace(view.displaced({('q', j): np.full(view.t.shape, step)}))
                for step in (_JOINT_STEP, -_JOINT_STEP)
            )
            for channel, value in high.items():
                slope[channel[1], j] = (value - low[channel]) / (2.0 * _JOINT_STEP)
        return slope

    def lasting(self) -> Any:
        """Return what is left of it for the robot ever after; None for what a set-up had."""
        return None if self.effect.traits.of_setup else self.effect

    def jump(self, view: View) -> Shift:
        """Return by how much a law that jumps does so from each sample to the next, shape (N - 1,)."""
        return {channel: np.diff(value) for channel, value in self.effect.displace(view).items()}

    def off_outside(self) -> float:
        """Return how far its joint may be off where nothing was recorded, [rad or m]."""
        return 0.0


class SearchHooks(_Hooks):
    """What the search asks, with the fit of many small errors."""

    def fits(self, robot: Robot, joint: str | None) -> bool:
        """Return whether a robot, or one of its joints, has what this can be an error of."""
        return True

    @property
    def moved_by(self) -> str | None:
        """Return the joint that must move for it to be seen; None where none has to."""
        site: str | None = self.effect.site
        return site if self.effect.traits.by_motion else None

    def constants(self, view: View, joint: str | None) -> Any:
        """
        Yield instances that are no more than a constant of the joint on this motion.

        No search can tell them from one, so none looks for them; they are named beside it.
        """
        return ()

    def trials(self, view: View, joint: str | None) -> float:
        """Return how many instances `seeds` chose among; 0 means as many as it yields."""
        return 0.0

    def surprise(self, among: float) -> float:
        """Return minus the log probability of this instance, of so many: all are as likely."""
        return float(np.log(max(among, 1.0)))

    @property
    def joins(self) -> bool:
        """Return whether two of a kind on one joint are one effect."""
        return type(self).joined is not SearchHooks.joined

    def joined(self, other: Any) -> Any:
        """Return this effect and another of its kind and joint as one; None where one has to do."""
        return None

    def small(self, view: View, joint: str | None, most: int) -> list[Any]:
        """
        Return the instances that a fit of many small errors takes along, of hardly any size.

        ``most`` pairs of coordinates is what the measurements allow every joint.
        """
        return list(self.kind.seeds(view, joint))[:2]

    def bend(self, joint: str, angles: Array) -> Any:
        """Return an instance of no size that bends a joint at angles (M,), None over too few."""
        return None

    def orders(self) -> Array:
        """Return the orders of the waves that this instance is a sum of, in cycles per turn."""
        return np.zeros(0)

    def lines(self, joint: str, orders: Array) -> list[Any]:
        """Return an instance of a single wave of no size for each order, shape (K,) [1/rev]."""
        return []

    def with_orders(self, orders: Array) -> Any:
        """Return its waves of these orders and no others, shape (K,); new ones of no size yet."""
        return self.effect


class FitHooks(_Hooks):
    """
    What a least-squares fit asks: the coordinates that it turns, and where it starts.

    Most effects fit their parameters. One whose parameters bend (amplitude and phase) gives
    coordinates in which it is straight.
    """

    def fitted(self) -> list[int]:
        """Return which components a fit turns, as places in `Effect.components`."""
        return [k for k, (p, _) in enumerate(self.effect.components()) if p.differentiable]

    def coordinates(self) -> Array:
        """Return the fit coordinates, shape (K,)."""
        return np.asarray(self.effect.vector()[self.fitted()])

    def with_coordinates(self, values: Array) -> Any:
        """Return the same at other fit coordinates, kept inside the physical bounds."""
        vector = np.array(self.effect.vector())
        specs = self.effect.components()
        for k, value in zip(self.fitted(), values, strict=True):
            vector[k] = min(max(float(value), specs[k][0].lower), specs[k][0].upper)
        return self.effect.with_vector(vector)

    def straight(self) -> NDArray[np.bool_]:
        """Return in which fit coordinates the displacement is a straight line, shape (K,)."""
        specs = self.effect.components()
        return np.array([specs[k][0].linear for k in self.fitted()], dtype=bool)

    def coordinate_scales(self) -> Array:
        """Return the typical size of every fit coordinate, shape (K,)."""
        specs = self.effect.components()
        return np.array([specs[k][0].typical for k in self.fitted()])

    def coordinate_shifts(self, view: View) -> list[Shift]:
        """Return d displacement / d fit coordinates."""
        gradient = self.effect.gradient(view)
        shifts = (gradient[k] for k in self.fitted())
        return [shift for shift in shifts if shift is not None]

    def errors(self, std: Array) -> dict[str, Any]:
        """Return standard errors by parameter from those of coordinates, (K,); None for NaN."""
        out: dict[str, Any] = {}
        values = iter(None if np.isnan(value) else float(value) for value in std)
        specs = self.effect.components()
        for parameter, index in (specs[k] for k in self.fitted()):
            if index is None:
                out[parameter.name] = next(values)
            else:
                out.setdefault(parameter.name, []).append(next(values))
        return {
            name: value
            for name, value in out.items()
            if value is not None and value != [None] * len(np.atleast_1d(value))
        }

    def alike(self) -> list[tuple[str, ...]]:
        """Return a label for every fit coordinate; those of one label are expected alike in size."""
        return [(self.effect.name,)] * self.coordinates().size

    def turned(self) -> Any:
        """Return what data that push this instance to its bound ask for instead; else itself."""
        return self.effect

    @property
    def ideal(self) -> float:
        """Return by how much its formula errs on real arms, as a share of what is usual."""
        return 1.0

    def starts(self, view: View, zoom: int) -> tuple[list[Any], Array] | None:
        """
        Return instances to choose a fit's start from, and what each displaces, shape (D, N).

        For an effect on one joint whose response bends so much with a parameter that a local fit
        would stop beside the best. ``zoom`` counts up from 0, each time about the best so far,
        until there are none. Where a parameter is linear, the instances have it at one.
        """
        return None

    @property
    def searched(self) -> bool:
        """Return whether a fit of it has to search for its start among its `starts`."""
        return type(self).starts is not FitHooks.starts

    @property
    def chosen(self) -> bool:
        """
        Return whether that search is all of it: no coordinate is left that a fit could turn.

        Its displacement is then its one linear feature. Where data are left out in turn, it is
        chosen anew without them.
        """
        return self.searched and not self.fitted()


_GROUPS: dict[str, type[_Hooks]] = {'twin': TwinHooks, 'search': SearchHooks, 'fit': FitHooks}
"""Groups of questions by the attribute of an effect that answers them."""
TRAITS = frozenset(each.name for each in fields(Traits))
OF_GROUP = {k: at for at, g in _GROUPS.items() for k in vars(g) if not k.startswith('_')}
"""Which group has a question."""


def gathered(kind: Any) -> None:
    """Put what a class has in the form of version 0.1, one attribute a hook, where it belongs now."""
    own = {k: v for k, v in vars(kind).items() if k not in vars(kind).get('__annotations__', {})}
    traits = {k: own[k] for k in own if k in TRAITS}
    asked = {k: own[k] for k in own if k in OF_GROUP}
    if not traits and not asked:
        return
    misplaced = ', '.join(sorted([*traits, *asked]))
    text = (
        f'{kind.__name__}: {misplaced} belong to traits, twin, search or fit; see docs/effects.md'
    )
    warnings.warn(text, DeprecationWarning, stacklevel=4)
    kind.traits = replace(kind.traits, **traits)
    for at in {OF_GROUP[k] for k in asked}:
        base = type(getattr(kind, at))
        body = {k: _forward(v) for k, v in asked.items() if OF_GROUP[k] == at}
        setattr(kind, at, Hooked(type(f'{kind.__name__}{base.__name__}', (base,), body)))
    for name in (*traits, *asked):
        delattr(kind, name)


def _forward(old: Any) -> Any:
    """Return a question of a group that is answered by what an effect had itself."""
    if isinstance(old, property):
        return property(lambda group: old.__get__(group.effect, group.kind))
    return lambda group, *given: old.__get__(group.effect, group.kind)(*given)


_SAME = 1e-3
"""Positions [rad] closer than this are one: no wave of an order below 3,000 fits between them."""


def highest_order(q: Array) -> float:
    """
    Return the highest order [1/rev] that a joint's positions (N,) can tell.

    Above it waves look like slower ones: positions on a grid of whole degrees show nothing beyond
    180. Half a wave needs a position of its own, and positions that all but coincide are one.
    """
    q = np.unique(q)
    span = float(np.ptp(q)) if q.size else 0.0
    if span <= _SAME:
        return 0.0
    # What is passed slowly coincides step by step all the way, and is as many as fit into it.
    ends = np.flatnonzero(np.diff(q) > _SAME)
    ways = q[np.append(ends, q.size - 1)] - q[np.append(0, ends + 1)]
    return np.pi * float(ends.size + (ways // _SAME).sum()) / span


def highest_order_alone(q: Array) -> float:
    """
    Return the highest order [1/rev] of a wave that a joint's positions (N,) can tell by itself.

    On a grid it is that of all together. Positions at random lie closer in places, and no slower wave
    passes through all of them: half a wave fits between neighbours as near as half of them are.
    """
    steps = np.diff(np.unique(q))
    steps = steps[steps > _SAME]
    alone = np.pi / float(np.median(steps)) if steps.size else 0.0
    return max(alone, highest_order(q))
