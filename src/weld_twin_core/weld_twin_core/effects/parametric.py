# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of an effect as fields, as one vector, as fit coordinates, as a file's entry."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from math import isfinite
from typing import Any, ClassVar, TypeVar

import numpy as np

from ..arrays import Array
from ..errors import ModelError
from .view import Parameter

_P = TypeVar('_P', bound='Parametric')


@dataclass(frozen=True, eq=False)
class Parametric:
    """
    Something with named parameters; see `weld_twin_core.effects.effect.Effect`.

    Parameters may carry a leading axis of draws, shape (D,) or (D, size). A parameter of any
    length (``size`` 0) is one number, a list (K,), or draws of a list (D, K).
    """

    name: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]]
    options: ClassVar[tuple[str, ...]] = ()
    """Fields that choose a variant and are never fitted."""

    def __post_init__(self) -> None:
        for parameter in self.parameters:
            value = getattr(self, parameter.name)
            if np.ndim(value):
                object.__setattr__(self, parameter.name, self._frozen(parameter, value))

    def _frozen(self, parameter: Parameter, value: Any) -> Array:
        array: Array = np.array(self._numeric(parameter, value))
        array.setflags(write=False)
        return array

    def _numeric(self, parameter: Parameter, value: Any) -> Array:
        try:
            return np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            raise ModelError(
                f'{self.name}: {parameter.name} must be a number, got {value!r}'
            ) from None

    def _check_values(self) -> None:
        """Raise ModelError for a wrong length, no number, or one outside the bounds; look once."""
        if '_sound' in self.__dict__:
            return
        for parameter in self.parameters:
            given = getattr(self, parameter.name)
            plain = isinstance(given, float) and parameter.size < 2 and isfinite(given)
            if plain and parameter.lower <= given <= parameter.upper:
                continue  # most are; arrays of one number take thirty times as long to look at
            value = self._numeric(parameter, given)
            if parameter.size > 1 and (value.ndim == 0 or value.shape[-1] != parameter.size):
                raise ModelError(
                    f'{self.name}: {parameter.name} needs {parameter.size} numbers, '
                    f'got shape {value.shape}'
                )
            if not np.isfinite(value).all():
                raise ModelError(f'{self.name}: {parameter.name} is not finite')
            if value.size and not parameter.lower <= value.min() <= value.max() <= parameter.upper:
                raise ModelError(
                    f'{self.name}: {parameter.name} = {value} {parameter.unit} is outside '
                    f'[{parameter.lower:g}, {parameter.upper:g}]'
                )
        self.__dict__['_sound'] = True

    def _is_number(self, parameter: Parameter) -> bool:
        if parameter.size:
            return parameter.size == 1
        return np.ndim(getattr(self, parameter.name)) == 0

    def components(self) -> list[tuple[Parameter, int | None]]:
        """Return every scalar component: its parameter and its index, None for a plain number."""
        return self._components

    # A search asks the same instance hundreds of times, and its fields never change.
    @cached_property
    def _components(self) -> list[tuple[Parameter, int | None]]:
        out: list[tuple[Parameter, int | None]] = []
        for parameter in self.parameters:
            if self._is_number(parameter):
                out.append((parameter, None))
            else:
                count = np.shape(getattr(self, parameter.name))[-1]
                out += [(parameter, k) for k in range(count)]
        return out

    @cached_property
    def draws(self) -> tuple[int, ...]:
        """Return the draw axis of the parameters: (D,), or () for plain numbers."""
        if all(isinstance(getattr(self, p.name), float) for p in self.parameters):
            return ()
        return self.vector().shape[:-1]

    def vector(self) -> Array:
        """Return all components as one vector, shape (P,), or (D, P) with draws; not to be written."""
        return self._vector

    @cached_property
    def _vector(self) -> Array:
        values = [getattr(self, p.name) for p in self.parameters]
        if all(isinstance(value, float) for value in values):
            out = np.array(values, dtype=np.float64)  # most effects
        else:
            parts = [
                np.asarray(getattr(self, p.name), dtype=np.float64)[... if k is None else (..., k)]
                for p, k in self.components()
            ]
            out = np.stack(np.broadcast_arrays(*parts), axis=-1)
        out.setflags(write=False)
        return out

    def with_vector(self: _P, vector: Array) -> _P:
        """Return the same with other components, shape (P,) or draws (D, P)."""
        wanted = np.asarray(vector, dtype=np.float64)
        values: dict[str, Any] = {}
        at = 0
        for parameter in self.parameters:
            number = self._is_number(parameter)
            count = 1 if number else np.shape(getattr(self, parameter.name))[-1]
            part: Any = wanted[..., at : at + count]
            # Draws of one number where a list is allowed stay draws of a list of one.
            plain = number and (parameter.size == 1 or wanted.ndim == 1)
            if plain:  # a number of Python is looked at in a tenth of the time of an array of one
                part = float(part[0]) if wanted.ndim == 1 else part[..., 0]
            values[parameter.name] = part
            at += count
        return replace(self, **values)

    def _plain(self, name: str) -> float:
        return float(np.asarray(getattr(self, name)))

    def number(self, name: str, k: int | None = None) -> Array:
        """Return one component ready to broadcast with samples: scalar, or shape (D, 1)."""
        value = np.asarray(getattr(self, name), dtype=np.float64)
        if k is not None:
            value = value[..., k]
        return value[..., None] if value.ndim else value

    def to_mapping(self) -> dict[str, Any]:
        """Return the entry of an effects file that makes this effect."""
        out: dict[str, Any] = {'effect': self.name}
        for item in fields(self):
            value = getattr(self, item.name)
            if value is None or (item.name in self.options and value == item.default):
                continue
            out[item.name] = np.asarray(value).tolist() if not isinstance(value, str) else value
        return out
