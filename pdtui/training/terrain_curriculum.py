"""The grounds on which a batch of legged robots trains: of different friction and, for some, roughness.

A robot that stays on its feet for an episode goes on to rougher ground, and one that falls goes back, as in
the curriculum of Rudin et al., "Learning to Walk in Minutes Using Massively Parallel Deep Reinforcement
Learning" (2021).
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.robots.legged.legged_robot import LeggedRobot
from pdtui.robots.legged.legged_robot_state import GroundHeights
from pdtui.robots.legged.mujoco_ground import lay_rough_ground, load_legged_model
from pdtui.robots.legged.terrain import draw_rough_ground, interpolate_heights

# Lowest and highest friction of the ground, and number of values from one to the other.
_FRICTIONS = (0.5, 1.25, 8)
# Levels from a plane to the robot's roughness, and the seed of their grounds.
_LEVELS, _SEED = 6, 20_000
# Distance of the robots' starts from the edge of the ground, m.
_MARGIN = 1.0


class TerrainCurriculum:
    """Models of one robot, with the friction and the ground of each robot of a batch.

    Attributes:
        models: The model of each robot.
        frictions: Friction of each robot's ground.
        levels: Level of each robot's ground, from 0, a plane, up.

    Args:
        robot: The robot. If it starts on rough ground, its roughness is that of the highest level.
        count: Number of robots.
    """

    def __init__(self, robot: LeggedRobot, count: int) -> None:
        low, high, number = _FRICTIONS
        values = np.linspace(low, high, number)
        self.frictions = np.resize(values, count)
        steps = np.linspace(0.0, robot.roughness, _LEVELS) if robot.terrain == "rough" else [0.0]
        grounds = [draw_rough_ground(np.random.default_rng(_SEED + n), size) for n, size in enumerate(steps)]
        self._rough = len(grounds) > 1
        self._corner, self._extent = grounds[0].corner, grounds[0].extent
        self._heights = np.array([ground.heights for ground in grounds])
        self._shared: list[list[mujoco.MjModel]] = []
        for level, ground in enumerate(grounds):
            models = [
                load_legged_model(robot.description.model, ground if robot.starts else None) for _ in values
            ]
            for model, friction in zip(models, values, strict=True):
                if robot.starts:
                    lay_rough_ground(model, ground if level else None)
                # MuJoCo takes the larger of the two frictions of a contact.
                model.geom_friction[:, 0] = friction
            self._shared.append(models)
        self.set_levels(np.zeros(count, np.intp))

    def set_levels(self, levels: NDArray[np.intp]) -> None:
        """Put every robot on the ground of a level, shape (robots,)."""
        self.levels = levels
        frictions = _FRICTIONS[-1]
        self.models = [self._shared[level][index % frictions] for index, level in enumerate(levels.tolist())]

    def update_levels(
        self, over: NDArray[np.bool_], fell: NDArray[np.bool_], rng: np.random.Generator
    ) -> None:
        """Send robots whose episode is over to rougher ground, or back if they fell.

        Beyond the roughest ground, the next one is drawn.
        """
        if not self._rough or not over.any():
            return
        moved = np.maximum(0, self.levels + np.where(fell, -1, 1) * over)
        beyond = moved >= _LEVELS
        moved[beyond] = rng.integers(0, _LEVELS, int(beyond.sum()))
        self.set_levels(moved)

    def sample_start_places(
        self, which: NDArray[np.bool_], rng: np.random.Generator
    ) -> tuple[Floats | float, Floats | float]:
        """Return places of chosen robots, x and y, shape (n, 2), and heights of the ground there, shape (n,).

        On a plane they all start at the origin.
        """
        if not self._rough:
            return 0.0, 0.0
        low = np.array(self._corner) + _MARGIN
        high = np.array(self._corner) + self._extent - _MARGIN
        places = rng.uniform(low, high, (int(which.sum()), 2))
        chosen = self.levels[which]
        return places, interpolate_heights(self._heights, chosen, places[:, None], self._corner)[:, 0]

    def heights_under(self, which: NDArray[np.bool_] | slice) -> GroundHeights | None:
        """Return what gives the heights of the ground under points of chosen robots; None on a plane."""
        if not self._rough:
            return None
        levels = self.levels[which]
        return lambda points: interpolate_heights(self._heights, levels, points, self._corner)
