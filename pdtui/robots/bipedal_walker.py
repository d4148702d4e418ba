"""The BipedalWalker of the paper: a hull on two legs with knees, in Box2D, on flat ground."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import Box2D
import gymnasium
import numpy as np
from gymnasium.envs.box2d import bipedal_walker as stock
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats, wrap_angle
from pdtui.core.errors import RobotError
from pdtui.core.outcome import Outcome, fall_info
from pdtui.core.robot_links_and_state import Foot, Link
from pdtui.robots.environments.gymnasium_robot import GymnasiumRobot
from pdtui.robots.simulators.joint_and_trunk_attributes import torque_attributes
from pdtui.robots.tasks.bipedal_walker_tasks import BIPEDAL_WALKER_TASKS
from pdtui.robots.training_recipe import TrainingRecipe

FINISH = (stock.TERRAIN_LENGTH - stock.TERRAIN_GRASS) * stock.TERRAIN_STEP
_GROUND_LENGTH = 2000.0  # m
_JOINTS = ("hip 1", "knee 1", "hip 2", "knee 2")
_MAX_TORQUE = 10_000.0  # N m, beyond which the bodies are too light for the simulator
_LEG_OFFSET = 0.2  # of a drawn leg from the middle, m: the world is flat, its picture need not be
# Angles of a split (rad): hips and knees are at their limits, leg 1 in front on its foot, leg 2 behind on its
# knee. A flip may end like this, and the shipped policy does not get up by itself.
_SPLIT_HULL, _SPLIT_HIPS, _SPLIT_KNEES = 0.48, (1.1, -0.8), (-1.6, -1.6)


class FlatBipedalWalker(stock.BipedalWalker):
    """Gymnasium's BipedalWalker on flat ground that continues behind the finish, with a choice of motors.

    The ground is one edge, because feet catch on the seams between Gymnasium's many short ones. Every reset
    makes a new world, because Box2D does not repeat itself in a used one.

    Args:
        torque: Torque of the strongest motor command, N m; Gymnasium's is 80. The bodies are made lighter
            instead of the motors stronger, which gives the same motion.
        friction: Factor on the friction of every contact.
        mass: Factor on all masses and inertias.
    """

    def __init__(self, torque: float, friction: float = 1.0, mass: float = 1.0) -> None:
        super().__init__()
        self.strength = torque / float(stock.MOTORS_TORQUE)
        # Box2D takes the geometric mean of two frictions, and one of them is always that of the ground.
        self.fd_edge.friction *= friction**2
        self._mass = mass
        self.hull: Any

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Start standing or, with ``start: split`` in the options, with the legs spread on the ground."""
        self._destroy()
        self.world = Box2D.b2World()
        observation, info = super().reset(seed=seed)
        for body in (self.hull, *self.legs):
            for fixture in body.fixtures:
                fixture.density *= self._mass / self.strength
            body.ResetMassData()
        if options is not None and options.get("start") == "split":
            observation = self._split()
        return observation, info

    def step(self, action: NDArray[np.float32]) -> Any:
        observation, reward, terminated, truncated, info = super().step(action)
        x = float(self.hull.position.x)
        if self.game_over:
            info |= fall_info("fell: the hull touched the ground")
        elif not 0.0 <= x <= _GROUND_LENGTH:
            terminated = True
            info |= {"outcome": Outcome.LEFT_ROAD, "reason": "walked off the end of the ground"}
        elif x > FINISH:
            terminated = False  # Gymnasium's ends the episode at the finish
            info["outcome"] = Outcome.ARRIVED
        return observation, reward, terminated, truncated, info

    def _generate_terrain(self, hardcore: bool) -> None:
        del hardcore
        surface = [(0.0, stock.TERRAIN_HEIGHT), (_GROUND_LENGTH, stock.TERRAIN_HEIGHT)]
        self.fd_edge.shape.vertices = surface
        ground = self.world.CreateStaticBody(fixtures=self.fd_edge)
        ground.color1 = ground.color2 = (76, 204, 76)
        self.terrain = [ground]
        corners = [*surface, (_GROUND_LENGTH, 0.0), (0.0, 0.0)]
        self.terrain_poly = [(corners, (102, 153, 76))]

    def _generate_clouds(self) -> None:
        self.cloud_poly: list[Any] = []

    def _split(self) -> Any:
        """Spread the legs on the ground, slightly differently for every seed."""
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
    """Gymnasium's BipedalWalker on flat ground; a control step is 0.02 s.

    The observation (24) holds the hull's angle and velocities, angles and speeds of the joints, foot
    contacts, and 10 distances to the ground. The reward is Gymnasium's: about 300 for the way to the finish,
    minus the motors' effort, and −100 for a fall. The robot has arrived once it is past the finish; the
    ground continues for 2 km.

    Box2D's lengths are taken for meters. Pitch is positive when leaning forward. The start ``split`` has the
    legs spread on the ground.

    Args:
        torque: Torque of the strongest motor command, N m. Gymnasium's is 80, which is too weak for flips.

    Raises:
        RobotError: The torque is not from 1 to 10,000 N m.
    """

    name = "bipedal_walker"
    title = "BipedalWalker (Box2D)"
    feet = tuple(
        Foot(f"foot {leg}", f"shin {leg}", contact=f"foot {leg} contact", contact_delay=1) for leg in (1, 2)
    )
    tasks = BIPEDAL_WALKER_TASKS
    # A fall costs only a third of what the whole way earns, so rewards are scaled up from PPO's usual 0.02.
    training_recipe = TrainingRecipe(settings={"reward_scale": 0.1, "evaluate_steps": 1600})
    episode_steps = 1600
    outcomes = (Outcome.ARRIVED, Outcome.FELL, Outcome.LEFT_ROAD)
    starts = ("split",)

    def __init__(self, torque: float = 300.0) -> None:
        if not 1.0 <= torque <= _MAX_TORQUE:
            raise RobotError(f"{self.name}: expected a torque of 1 to {_MAX_TORQUE:g} N m, found {torque:g}")
        self._torque, self._scales = torque, (1.0, 1.0)
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
            *torque_attributes(_JOINTS, (torque,) * 4),
            Attribute("foot 1 contact", ""),
            Attribute("foot 2 contact", ""),
        )

    def make_world(self) -> gymnasium.Env[Any, Any]:
        return FlatBipedalWalker(self._torque, *self._scales)

    @property
    def offers_pushes(self) -> bool:
        return True

    def push_trunk(self, vx: float, vy: float) -> None:
        self._actions.append_push(vx, vy)  # its world is a plane, so vy has no effect
        for body in (self.world.hull, *self.world.legs):
            x, z = body.linearVelocity
            body.linearVelocity = (x + vx, z)

    @property
    def offers_scaled_physics(self) -> bool:
        return True

    @contextmanager
    def scaled_physics(self, friction: float, mass: float) -> Iterator[None]:
        before = self._scales
        self._scales = (friction, mass)  # a reset makes the world anew
        try:
            yield
        finally:
            self._scales = before

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
            half, (x, z) = -body.angle / 2, body.position  # about y, which points into the picture
            row[:] = (x, 0.0, z - stock.TERRAIN_HEIGHT, math.cos(half), 0.0, math.sin(half), 0.0)
        return poses


def _links() -> tuple[Link, ...]:
    corners = np.array(stock.HULL_POLY) / stock.SCALE
    (left, bottom), (right, top) = corners.min(0), corners.max(0)
    width, straight = stock.LEG_W / 2, (1.0, 0.0, 0.0, 0.0)
    hull_size = ((right - left) / 2, _LEG_OFFSET + width, (top - bottom) / 2)
    hull = Link("hull", 0, "box", hull_size, ((left + right) / 2, 0.0, (bottom + top) / 2), straight)
    legs = []
    for leg, side in enumerate((_LEG_OFFSET, -_LEG_OFFSET)):
        for joint, (part, thick) in enumerate((("thigh", width), ("shin", 0.8 * width))):
            size, body = (thick, width, stock.LEG_H / 2), 1 + 2 * leg + joint
            legs.append(Link(f"{part} {leg + 1}", body, "box", size, (0.0, side, 0.0), straight))
    return (hull, *legs)
