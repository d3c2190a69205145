# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""JAX: the chain compiled for a whole batch, derivatives by forward mode."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array

from ..arms import DH_KEYS
from . import Peer


def make(robot: Robot) -> Peer:
    """Return the peer; the derivative is that of the tool point alone."""
    jax.config.update('jax_enable_x64', True)
    nominal = jnp.array([getattr(robot, key) for key in DH_KEYS])
    pose = _chain(jnp.array(robot.T_world_base), jnp.array(robot.T_flange_tool), robot.n)
    every = jax.jit(jax.vmap(lambda q: pose(q, nominal)))
    point = jax.jacfwd(lambda q, rows: pose(q, rows)[:3, 3], argnums=1)
    both = jax.jit(jax.vmap(lambda q: (pose(q, nominal), point(q, nominal))))

    def poses(q: Array) -> Array:
        return np.asarray(every(q))

    def dh(q: Array) -> tuple[Array, Array]:
        found, derivative = both(q)
        return np.asarray(found), np.asarray(derivative).swapaxes(2, 3).reshape(len(q), 3, -1)

    return Peer(poses, dh=dh, loops=False)


def _chain(base: jax.Array, tool: jax.Array, n: int) -> Callable[..., jax.Array]:
    def pose(q: jax.Array, rows: jax.Array) -> jax.Array:
        out = base
        for i in range(n):
            theta, d, a, alpha = rows[0, i] + q[i], rows[1, i], rows[2, i], rows[3, i]
            c, s, ca, sa = jnp.cos(theta), jnp.sin(theta), jnp.cos(alpha), jnp.sin(alpha)
            out = out @ jnp.array(
                [
                    [c, -s * ca, s * sa, a * c],
                    [s, c * ca, -c * sa, a * s],
                    [0.0, sa, ca, d],
                    [0.0, 0.0, 0.0, 1.0],
                ]
            )
        return out @ tool

    return pose
