"""What the Ant observes, what is measured of it and when it has fallen, computed by JAX from MJX's data."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from pdtui.robots.ant import Ant


class JaxAntFormulas:
    """The Ant's formulas of `pdtui.robots.ant`, for one world; `jax.vmap` gives those of many.

    Args:
        ant: The robot whose motors and attributes they are.
    """

    def __init__(self, ant: Ant) -> None:
        self.physics_steps = ant.frame_skip
        self._heights = ant.torso_heights
        self._gears = jnp.asarray(ant.model.actuator_gear[:, 0], jnp.float32)
        self.wraps = tuple(attribute.wraps for attribute in ant.attributes)

    def observe(self, data: Any) -> Any:
        """Return the observation, shape (27,)."""
        return jnp.concatenate([data.qpos[2:], data.qvel])

    def read_attributes(self, data: Any) -> Any:
        """Return the attributes in the robot's order, shape (J,)."""
        height, (w, x, y, z) = data.qpos[2], data.qpos[3:7]
        vx, vy, _, a, b, c = data.qvel[:6]
        roll = jnp.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
        pitch = jnp.arcsin(jnp.clip(2 * (w * y - z * x), -1.0, 1.0))
        yaw = jnp.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        yaw_rate = 2 * (x * z - w * y) * a + 2 * (y * z + w * x) * b + (1 - 2 * (x * x + y * y)) * c
        trunk = jnp.stack([vx, vy, jnp.hypot(vx, vy), yaw, yaw_rate, roll, pitch, height])
        return jnp.concatenate([trunk, self._gears * jnp.clip(data.ctrl, -1.0, 1.0)])

    def has_fallen(self, data: Any) -> Any:
        """Return whether the episode is over: outside the heights, on its back, or no number any more."""
        height, (_, x, y, _) = data.qpos[2], data.qpos[3:7]
        low, high = self._heights
        within = (height >= low) & (height <= high)  # false for NaN
        return ~within | (1 - 2 * (x * x + y * y) < 0)
