# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the real tool goes on the motion of a program, and how sure that is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..arm.chain import forward
from ..arm.robot import Robot
from ..arrays import Array
from ..effects.effect import Effect, MemoryEffect
from ..motion.programs import Piece
from ..recording import JointMotion, Recording, Signal
from .compensation import acts, commandable
from .domain import Domain, Outside
from .features import Features
from .posterior import Drawn, Posterior, places, pose_covariances
from .twin import Twin

_SAME_TOOL = 1e-5
"""Numbers of two tool frames [m, and parts of a unit vector] that mean the same tool: programs are
written to a micrometre and some thousandths of a degree."""
_TOOL_EFFECT = 'tool_pose'


@dataclass(frozen=True, eq=False)
class ProgramModel:
    """What acts on the arm that runs a program."""

    robot: Robot
    """Nominal, with its own base and the tool that the effects were found with."""
    effects: tuple[Effect, ...]
    posterior: Posterior | None = None
    temperature: float | None = None
    """While the program runs [degC]."""
    setup: int = 0
    """Which base frame of the posterior."""
    wrench: Array | None = None
    """On the tool meanwhile, in ``wrench_frame``, shape (6,) [N, N m]."""
    wrench_frame: str = 'tool'
    """'tool' or 'base'."""
    beside_frames: frozenset[str] = frozenset()
    """Errors of frames that were found beside those fitted: what slipped since, or changed."""
    _twins: dict[tuple[bytes, bool], Twin] = field(default_factory=dict, repr=False)

    @property
    def acting(self) -> tuple[Effect, ...]:
        """Return the effects that moves of the arm can mend."""
        return tuple(effect for effect in self.effects if commandable(effect))

    @property
    def lawless(self) -> list[str]:
        """Return the joints of which is known what they lose by direction, and not by which law."""
        lost = [e for e in self.acting if not isinstance(e, MemoryEffect) and e.on == 'direction']
        return sorted({str(effect.site) for effect in lost})

    def without_memory(self) -> ProgramModel | None:
        """Return the model without play, friction and lag; None where it has none of them."""
        still = tuple(e for e in self.effects if not isinstance(e, MemoryEffect))
        return replace(self, effects=still, _twins={}) if len(still) < len(self.effects) else None

    def arm(self, tool: Array) -> Robot:
        """Return the nominal arm with a tool, in its own base."""
        return self.robot.with_frames(base=np.eye(4), tool=tool)

    def twin(self, tool: Array, *, whole: bool = False) -> Twin:
        """
        Return the real arm with a tool; what was found of another tool is left out.

        As far as moves of the arm can mend it, or the ``whole`` of what is off.
        """
        key = np.ascontiguousarray(tool).tobytes(), whole
        if key not in self._twins:
            same = self.same_tool(tool)
            acting = tuple(e for e in self.effects if acts(e)) if whole else self.acting
            effects = [e for e in acting if same or e.name != _TOOL_EFFECT]
            self._twins[key] = Twin(self.robot.with_frames(tool=tool), effects)
        return self._twins[key]

    def same_tool(self, tool: Array) -> bool:
        """Tell whether a tool is the one that the effects were found with."""
        return bool(np.abs(tool - self.robot.T_flange_tool).max() < _SAME_TOOL)

    def wanted(self, piece: Piece) -> Array:
        """Return ``T_base_tool`` as the program means it at every sample, shape (N, 4, 4)."""
        return self._by_tool(piece, lambda tool: forward(self.arm(tool), piece.motion.q))

    def real(self, piece: Piece, motion: JointMotion, *, whole: bool = False) -> Array:
        """Return ``T_base_tool`` of `twin` at every sample of a motion, (N, 4, 4)."""
        back = np.linalg.inv(self.robot.T_world_base)
        recording = self.recording(motion)

        def poses(tool: Array) -> Array:
            return np.asarray(back @ self.twin(tool, whole=whole).poses(recording).matrices)

        return self._by_tool(piece, poses)

    def covariances(self, piece: Piece, motion: JointMotion) -> Array | None:
        """Return how sure the real poses are where it was recorded, (N, 6, 6), seen from the base."""
        if self.posterior is None:
            return None
        posterior, recording = self.posterior, self.recording(motion)
        turn = np.kron(np.eye(2), self.robot.T_world_base[:3, :3].T)

        def sureness(tool: Array) -> Array:
            result = pose_covariances(posterior, self.twin(tool), recording, motion.t, self.setup)
            return np.asarray(turn @ result @ turn.T)

        return self._by_tool(piece, sureness)

    def drawn(self, piece: Piece, motion: JointMotion) -> Drawn | None:
        """Return by how much the tool may be off the model's along a motion, seen from the base."""
        if self.posterior is None:
            return None
        posterior, recording = self.posterior, self.recording(motion)
        at, near = places(motion.t.size)

        def off(tool: Array) -> Array:
            seen = Features(self.twin(tool), recording, motion.t[at])
            return np.asarray(posterior.drawn(seen, self.setup) @ self.robot.T_world_base[:3, :3])

        return Drawn(near, self._by_tool(piece, off, at))

    def outside(self, motion: JointMotion) -> list[Outside]:
        """Return the stretches of a motion outside what was recorded."""
        if self.posterior is None:
            return []
        warm = None
        if self.temperature is not None:
            warm = np.full(motion.t.size, self.temperature)
        domain: Domain = self.posterior.domain
        return domain.outside(motion.q, motion.velocity, None, warm)

    def postures_outside(self, q: Array) -> list[Outside]:
        """Return which of postures (K, n), loaded and warm, are outside what was recorded."""
        if self.posterior is None:
            return []
        pull = None if self.wrench is None else np.repeat(self.wrench[None], len(q), axis=0)
        warm = None if self.temperature is None else np.full(len(q), self.temperature)
        return self.posterior.domain.outside(q, None, pull, warm)

    def recorded(self, q: Array) -> Array:
        """Tell which postures, shape (K, n), are among those recorded, shape (K,)."""
        if self.posterior is None:
            return np.ones(len(q), dtype=bool)
        domain = self.posterior.domain
        return np.asarray((domain.beyond(q) <= np.array(domain.margins)).all(axis=1))

    def recording(self, motion: JointMotion) -> Recording:
        """Return a motion as the twin takes it."""
        pull = None if self.wrench is None else Signal(motion.t[:1], self.wrench[None])
        plain = Recording('program', motion, None, pull, self.wrench_frame)
        return plain if self.temperature is None else plain.at_temperature(self.temperature)

    @staticmethod
    def _by_tool(
        piece: Piece, of: Callable[[Array], Array], at: NDArray[np.int_] | slice = slice(None)
    ) -> Array:
        """Return values at samples, each worked out with the tool of its move."""
        keys = [np.ascontiguousarray(move.tool).tobytes() for move in piece.moves]
        out: Array | None = None
        for key in dict.fromkeys(keys):
            chosen = np.array([k == key for k in keys])[piece.move[at]]
            values = of(piece.moves[keys.index(key)].tool)
            out = values if out is None else out
            out[chosen] = values[chosen]
        assert out is not None
        return out
