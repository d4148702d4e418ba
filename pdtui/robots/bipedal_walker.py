"""The BipedalWalker of the paper: a hull on two legs with knees, in Box2D, on flat ground."""

from __future__ import annotations

import math
from typing import Any

import Box2D
import gymnasium
import numpy as np
from gymnasium.envs.box2d import bipedal_walker as stock
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats, wrap_angle
from pdtui.core.robot_data import Link
from pdtui.robots.bipedal_walker_tasks import BIPEDAL_WALKER_TASKS
from pdtui.robots.environments.gymnasium_robot import GymnasiumRobot
from pdtui.robots.robot_goals import WALKING_GOALS
from pdtui.robots.training_recipe import TrainingRecipe

FINISH = (stock.TERRAIN_LENGTH - stock.TERRAIN_GRASS) * stock.TERRAIN_STEP
_GROUND = 2000.0
_JOINTS = ("hip 1", "knee 1", "hip 2", "knee 2")
_DEPTH = 0.2  # of a leg beside the middle, m: the world is flat, its picture need not be
# Both hips and knees at their limits, leg 1 in front on its foot, leg 2 behind on its knee: what a flip may
# end in, and what the shipped policy does not get out of by itself.
_SPLIT_HULL, _SPLIT_HIPS, _SPLIT_KNEES = 0.48, (1.1, -0.8), (-1.6, -1.6)


class FlatBipedalWalker(stock.BipedalWalker):
    """Gymnasium's BipedalWalker on flat ground that goes on behind the finish, with motors as one likes.

    The ground is one edge: on stock's many short ones, feet catch on the seams.

    Every reset makes a new world: Box2D does not repeat itself in one that was used before.

    Args:
        torque: of the strongest motor command, N m; Gymnasium's is 80. The bodies are made lighter instead
            of the motors stronger, which is the same motion.
    """

    def __init__(self, torque: float) -> None:
        super().__init__()
        self.strength = torque / float(stock.MOTORS_TORQUE)
        self.hull: Any

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Start standing or, with ``start: split`` in the options, with the legs spread on the ground."""
        self._destroy()
        self.world = Box2D.b2World()
        observation, info = super().reset(seed=seed)
        for body in (self.hull, *self.legs):
            for fixture in body.fixtures:
                fixture.density /= self.strength
            body.ResetMassData()
        if options is not None and options.get("start") == "split":
            observation = self._split()
        return observation, info

    def step(self, action: NDArray[np.float32]) -> Any:
        observation, reward, terminated, truncated, info = super().step(action)
        x = float(self.hull.position.x)
        finished = x > FINISH and not self.game_over
        if self.game_over:
            info["reason"] = "fell: the hull touched the ground"
        elif not 0.0 <= x <= _GROUND:
            terminated, finished, info["reason"] = True, False, "walked off the end of the ground"
        elif terminated and finished:
            terminated = False  # stock Gymnasium ends the episode at the finish
        return observation, reward, terminated, truncated, {**info, "finished": finished}

    def _generate_terrain(self, hardcore: bool) -> None:
        del hardcore
        self.fd_edge.shape.vertices = [(0.0, stock.TERRAIN_HEIGHT), (_GROUND, stock.TERRAIN_HEIGHT)]
        ground = self.world.CreateStaticBody(fixtures=self.fd_edge)
        ground.color1 = ground.color2 = (76, 204, 76)
        self.terrain = [ground]
        corners = [(0.0, stock.TERRAIN_HEIGHT), (_GROUND, stock.TERRAIN_HEIGHT), (_GROUND, 0.0), (0.0, 0.0)]
        self.terrain_poly = [(corners, (102, 153, 76))]

    def _generate_clouds(self) -> None:
        self.cloud_poly: list[Any] = []

    def _split(self) -> Any:
        """Spread the legs on the ground, a little differently for every seed."""
        angle = _SPLIT_HULL + self.np_random.uniform(-0.03, 0.03)
        poses, lowest = [], 0.0
        for hip, knee in zip(_SPLIT_HIPS, _SPLIT_KNEES, strict=True):
            thigh = angle + hip + self.np_random.uniform(-0.02, 0.02)
            shin = thigh + knee + self.np_random.uniform(-0.02, 0.02)
            down = np.array([math.sin(thigh), -math.cos(thigh)]) * stock.LEG_H
            foot = down + np.array([math.sin(shin), -math.cos(shin)]) * stock.LEG_H
            poses += [(down / 2, thigh), ((down + foot) / 2, shin)]
            lowest = min(lowest, float(foot[1]), float(down[1]))
        hip_at = np.array([self.hull.position.x, stock.TERRAIN_HEIGHT - lowest + stock.LEG_W / 2])
        hull_at = hip_at - stock.LEG_DOWN * np.array([-math.sin(angle), math.cos(angle)])
        for body, (place, turned) in zip(
            (self.hull, *self.legs), [(hull_at - hip_at, angle), *poses], strict=True
        ):
            body.transform = ((hip_at + place).tolist(), turned)
            body.linearVelocity, body.angularVelocity = (0.0, 0.0), 0.0
        return super().step(np.zeros(4, np.float32))[0]


class BipedalWalker(GymnasiumRobot):
    """Gymnasium's BipedalWalker on flat ground; 0.02 s a control step.

    Observation (24): hull angle and velocities, angles and speeds of the joints, foot contacts, 10 distances
    to the ground. Reward is Gymnasium's: about 300 for the way to the finish, less the motors' effort, −100
    for a fall. The ground goes on for 2 km; ``finished`` in the info says when the finish is passed.

    Lengths are Box2D's, taken for metres. Pitch is positive leaning forward. It can also start with its legs
    split on the ground.

    Args:
        torque: of the strongest motor command, N m. Gymnasium's is 80, too weak for flips.
    """

    name = "bipedal_walker"
    title = "BipedalWalker (Box2D)"
    goals = WALKING_GOALS
    tasks = BIPEDAL_WALKER_TASKS
    # A fall costs 100, as much as a third of the way earns: rewards are scaled up from PPO's usual 0.02.
    training_recipe = TrainingRecipe(settings={"reward_scale": 0.1, "evaluate_steps": 1600})
    episode_steps = 1600
    starts = ("split",)

    def __init__(self, torque: float = 300.0) -> None:
        self._torque = torque
        super().__init__(self.name, self.title)
        self.links = _links()
        self.attributes = (
            Attribute("vx", "m/s", scale=0.3 * stock.VIEWPORT_W / stock.SCALE / stock.FPS),
            Attribute("vz", "m/s", scale=0.3 * stock.VIEWPORT_H / stock.SCALE / stock.FPS),
            Attribute("speed", "m/s"),
            Attribute("height", "m"),
            Attribute("pitch", "rad", wraps=True),
            Attribute("pitch rate", "rad/s", scale=2.0 / stock.FPS),
            *(Attribute(f"{joint} angle", "rad") for joint in _JOINTS),
            *(Attribute(f"{joint} torque", "N m", scale=1.0 / torque) for joint in _JOINTS),
            Attribute("foot 1 contact", ""),
            Attribute("foot 2 contact", ""),
        )

    def make_world(self) -> gymnasium.Env[Any, Any]:
        return FlatBipedalWalker(self._torque)

    def read_attributes(self) -> Floats:
        world = self.world
        (vx, vz), hull = world.hull.linearVelocity, world.hull
        height = hull.position.y - stock.TERRAIN_HEIGHT
        angles = [joint.angle for joint in world.joints]
        torques = [joint.GetMotorTorque(stock.FPS) * world.strength for joint in world.joints]
        feet = [float(world.legs[index].ground_contact) for index in (1, 3)]
        pitch, rate = wrap_angle(-hull.angle), -hull.angularVelocity
        return np.array([vx, vz, math.hypot(vx, vz), height, pitch, rate, *angles, *torques, *feet])

    def read_poses(self) -> Floats:
        poses = np.zeros((5, 7))
        for row, body in zip(poses, (self.world.hull, *self.world.legs), strict=True):
            half = -body.angle / 2  # about y, which points into the picture
            row[:] = (*body.position, 0.0, math.cos(half), 0.0, math.sin(half), 0.0)
        poses[:, 1:3] = np.stack((np.zeros(5), poses[:, 1] - stock.TERRAIN_HEIGHT), axis=1)
        return poses


def _links() -> tuple[Link, ...]:
    corners = np.array(stock.HULL_POLY) / stock.SCALE
    (left, bottom), (right, top) = corners.min(0), corners.max(0)
    width = stock.LEG_W / 2
    straight = (1.0, 0.0, 0.0, 0.0)
    hull = Link(
        "hull",
        0,
        "box",
        ((right - left) / 2, _DEPTH + width, (top - bottom) / 2),
        ((left + right) / 2, 0.0, (bottom + top) / 2),
        straight,
    )
    legs = [
        Link(
            f"{part} {leg + 1}",
            1 + 2 * leg + joint,
            "box",
            (thick, width, stock.LEG_H / 2),
            (0.0, side, 0.0),
            straight,
        )
        for leg, side in enumerate((_DEPTH, -_DEPTH))
        for joint, (part, thick) in enumerate((("thigh", width), ("shin", 0.8 * width)))
    ]
    return (hull, *legs)
