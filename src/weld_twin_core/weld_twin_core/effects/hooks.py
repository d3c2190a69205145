# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What an effect may tell of itself beyond `displace` and `gradient`; every hook has a default.

The search, the fit of many small errors, the standard errors and the verdict ask these hooks and
nothing else, so that none of them knows any effect by name. The page of effects lists them in a
table.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, ClassVar, TypeVar

import numpy as np

from ..arm.channels import Shift
from ..arm.robot import Robot
from ..arrays import Array
from .parametric import Parametric
from .view import Stage, View

H = TypeVar('H', bound='Hooks')


@dataclass(frozen=True)
class Waves:
    """
    Which orders of waves in its joint's angle an effect is searched for.

    Attributes
    ----------
    dense : int
        A fit of many small errors takes all orders up to this one along, in cycles per turn.
    highest : int
        Single lines are looked for up to this order.

    """

    dense: int
    highest: int


@dataclass(frozen=True, eq=False)
class Hooks(Parametric, ABC):
    """The optional part of the contract; `Effect` is the rest."""

    of: ClassVar[str]
    """What it sits on: 'joint', 'link', 'links' or 'robot'."""
    stage: ClassVar[Stage]
    needs: ClassVar[frozenset[str]] = frozenset()
    """Inputs beyond joint position: velocity, order, time, wrench, load, temperature."""
    cause: ClassVar[bool] = True
    """Whether a diagnosis may name it; noise and the set-up's own motion are nuisance."""
    title: ClassVar[str] = ''
    """What people call it; left out, its name with spaces."""
    entered: ClassVar[str] = ''
    """Which field of a controller takes a correction of it: 'zero', 'base', 'root', 'tool', 'load',
    'model' or 'ratio'; 'program' where none does and the points of a program can be corrected. Else
    what it is a matter of: then there is nothing to enter."""
    changes_in_use: ClassVar[bool] = False
    """Whether use changes it: belts are taken off, tools are knocked, gears wear, loads are swapped."""
    set_at_controller: ClassVar[bool] = False
    """Whether a person can set it first: told before others that are the same on any motion."""
    depends_on: ClassVar[str] = 'constant'
    """What it depends on: 'constant', 'angle', 'direction', 'speed', 'acceleration', 'load',
    'temperature', 'time' or 'place' (in the workspace)."""
    place: ClassVar[str] = 'joint'
    """Where it sits: at its 'joint', or at 'base', 'tool', 'instrument', 'clock' or 'load'."""
    fitted_with: ClassVar[str | None] = None
    """The frame it is an error of, 'base' or 'tool': no cause where that frame is fitted."""
    of_setup: ClassVar[bool] = False
    """Whether it belongs to one set-up and not to the robot."""
    dated: ClassVar[bool] = False
    """Whether it sets in at an instant, and is a cause only where the data checks found one."""
    common: ClassVar[bool] = True
    """Whether every arm has a little of it, so that a fit of many small errors takes it along."""
    demand: ClassVar[int] = 0
    """What it asks of stations before a fit of many small errors takes it along: 0 as little as
    the geometry, 1 more of them, 2 a great many."""
    by_motion: ClassVar[bool] = False
    """Whether a joint must move for it to be told from a constant."""
    everywhere: ClassVar[bool] = False
    """Whether a prediction allows for it on every joint, or clock, where it was not found."""
    waves: ClassVar[Waves | None] = None
    """Set by an effect that is a sum of waves in its joint's angle; it also gives `orders`,
    `with_orders` and `lines`."""

    bends: ClassVar[bool] = False
    """Whether it stands for waves of a joint that travels too little for them; then gives
    `bend`."""

    @abstractmethod
    def gradient(self, view: View) -> list[Shift | None]:
        """Return d displacement / d component for every component; None where there is none."""

    @property
    def site(self) -> str | None:
        """Return the joint the effect sits on, or None for the robot as a whole."""
        return getattr(self, 'joint', None)

    @property
    def at(self) -> str:
        """Return where it sits: the name of its joint, or its `place`."""
        if self.place != 'joint':
            return self.place
        return 'base' if self.site is None else str(self.site)

    @property
    def on(self) -> str:
        """Return what it depends on."""
        return self.depends_on

    @property
    def key(self) -> tuple[str, ...]:
        """Return what tells this effect from others of the file: name, joint and options."""
        extra = tuple(str(getattr(self, k)) for k in self.options if k != 'joint')
        return (self.name, self.site or '', *extra)

    @classmethod
    def _at(cls, joint: str | None, **values: Any) -> Any:
        if cls.of in ('joint', 'link'):
            values['joint'] = joint
        return cls(**values)

    @property
    def moved_by(self) -> str | None:
        """Return the joint that must move for it to be seen; None where none has to."""
        return self.site if self.by_motion else None

    def lasting(self) -> Any:
        """Return what is left of it for the robot ever after; None for what a set-up had."""
        return None if self.of_setup else self

    # The twin: derivatives through effects that act later ---------------------------------------

    @property
    def settles(self) -> bool:
        """Return whether a spring takes the load of the posture that it has sagged to."""
        return True

    @property
    def by_effort(self) -> bool:
        """Return whether it takes the joints' measured effort in the place of the statics."""
        return False

    def slope(self, view: View) -> Shift:
        """Return d displacement / d own joint position, per ('q', i) channel; empty when none."""
        return {}

    # The search ---------------------------------------------------------------------------------

    lacking: ClassVar[str] = ''
    """What is wrong where it does not fit, after its name; ``robot`` and ``site`` are theirs. Without,
    it is only not looked for there."""

    @classmethod
    def fits(cls, robot: Robot, joint: str | None) -> bool:
        """Return whether a robot, or one of its joints, has what this can be an error of."""
        return True

    @classmethod
    def applicable(cls, view: View, joint: str | None) -> str | None:
        """Return why the data cannot show this effect at all, or None when they can."""
        if not cls.fits(view.robot, joint):
            return 'the robot has no part there that it could be an error of'
        if 'velocity' in cls.needs and view.static:
            return 'static stations carry no velocity'
        if 'wrench' in cls.needs and view.wrench is None:
            return 'no tool wrench was recorded'
        if 'load' in cls.needs and view.wrench is None and view.robot.mass is None:
            return 'the robot model has no link masses and no wrench was recorded'
        if 'temperature' in cls.needs and view.temperature is None:
            return 'no temperature was recorded'
        return None

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Any]:
        """
        Yield the instances a search starts from; each spans one linear subspace.

        Parameters
        ----------
        view : View
        joint : str or None
        pull : array, shape (N,), optional
            How strongly the residual would move the joint at every sample; an effect too fine to
            search on a grid may look for itself in it.

        """
        yield cls._at(joint)

    @classmethod
    def constants(cls, view: View, joint: str | None) -> Iterable[Any]:
        """
        Yield instances that are no more than a constant of the joint on this motion.

        No search can tell them from one, so none looks for them; they are named beside it.

        Parameters
        ----------
        view : View
        joint : str or None

        """
        return ()

    @classmethod
    def trials(cls, view: View, joint: str | None) -> float:
        """Return how many instances `seeds` chose among; 0 means as many as it yields."""
        return 0.0

    def atoms(self, view: View) -> list[Shift]:
        """Return the linear features of this instance; their combinations start a fit."""
        return [shift for shift in self.gradient(view) if shift is not None]

    def from_atoms(self: H, coefficients: Array) -> H:
        """Return the instance that a combination of `atoms` stands for, inside its bounds."""
        low, high = np.array([(p.lower, p.upper) for p, _ in self.components()]).T
        return self.with_vector(np.clip(np.asarray(coefficients, dtype=np.float64), low, high))

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
        return type(self).starts is not Hooks.starts

    def joined(self: H, other: H) -> H | None:
        """Return this effect and another of its kind and joint as one; None where one has to do."""
        return None

    @property
    def ideal(self) -> float:
        """Return by how much its formula errs on real arms, as a share of what is usual."""
        return 1.0

    # The fit ------------------------------------------------------------------------------------

    def coordinate_shifts(self, view: View) -> list[Shift]:
        """Return d displacement / d fit coordinates."""
        gradient = self.gradient(view)
        shifts = (gradient[k] for k in self.fitted())
        return [shift for shift in shifts if shift is not None]

    # Many small errors at once ------------------------------------------------------------------

    @classmethod
    def small(cls, view: View, joint: str | None, most: int) -> list[Any]:
        """
        Return the instances that a fit of many small errors takes along, of hardly any size.

        Parameters
        ----------
        view : View
        joint : str or None
        most : int
            Pairs of coordinates that the measurements allow every joint.

        """
        return list(cls.seeds(view, joint))[:2]

    @classmethod
    def bend(cls, joint: str, angles: Array) -> Any:
        """
        Return an instance of no size that bends a joint where it was, None over too short a way.

        Parameters
        ----------
        joint : str
        angles : array, shape (M,) [rad]
            Where the joint was measured.

        """
        return None

    def alike(self) -> list[tuple[str, ...]]:
        """Return a label for every fit coordinate; those of one label are expected alike in size."""
        return [(self.name,)] * self.coordinates().size

    def turned(self: H) -> H:
        """Return what data that push this instance to its bound ask for instead; else itself."""
        return self

    def orders(self) -> Array:
        """Return the orders of the waves that this instance is a sum of, in cycles per turn."""
        return np.zeros(0)

    @classmethod
    def lines(cls, joint: str, orders: Array) -> list[Any]:
        """Return an instance of a single wave of no size for each order, shape (K,) [1/rev]."""
        return []

    def with_orders(self: H, orders: Array) -> H:
        """Return its waves of these orders and no others, shape (K,); new ones of no size yet."""
        return self

    # The verdict --------------------------------------------------------------------------------

    def causes(self) -> int:
        """Return how many separate causes this instance stands for."""
        return max(1, self.orders().size)

    # The advice ---------------------------------------------------------------------------------

    @abstractmethod
    def remedy(self, robot: Robot) -> str:
        """
        Return what to mend where it was found, as one sentence with its size.

        Parameters
        ----------
        robot : Robot
            The nominal model: what is entered in the controller now.

        """

    # The prediction -----------------------------------------------------------------------------

    def off_outside(self) -> float:
        """Return how far its joint may be off where nothing was recorded, [rad or m]."""
        return 0.0


SAME = 1e-3
"""Positions [rad] closer than this are one: no wave of an order below 3,000 fits between them."""


def highest_order(q: Array) -> float:
    """
    Return the highest order [1/rev] that a joint's positions can tell, shape (N,).

    Above it waves look like slower ones: positions on a grid of whole degrees show nothing beyond
    180. Half a wave needs a position of its own, and positions that all but coincide are one.
    """
    apart = np.diff(np.unique(q))
    clusters = 1 + int((apart > SAME).sum())
    span = float(np.ptp(q)) if q.size else 0.0
    return np.pi * (clusters - 1) / span if span > SAME else 0.0
