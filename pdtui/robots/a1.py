"""The Unitree A1 of the paper, in PyBullet: a quadruped that senses only its own body."""

from __future__ import annotations

import math
from typing import Any, Literal

import gymnasium
import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats
from pdtui.core.errors import RobotError, SimulationDiverged
from pdtui.core.outcome import fall_info
from pdtui.core.robot_links_and_state import Foot, FootPlace
from pdtui.core.scenery import NO_SCENERY, Scenery
from pdtui.robots.geometry import roll_pitch_yaw
from pdtui.robots.legged.terrain import draw_rough_ground, scatter_trees
from pdtui.robots.observation_edits.a1_observation_edits import a1_observation_edits
from pdtui.robots.robot import ResetResult, StepResult
from pdtui.robots.simulators import bullet_robot
from pdtui.robots.simulators.bullet_robot import BulletRobot
from pdtui.robots.simulators.joint_and_trunk_attributes import TRUNK_ATTRIBUTES, torque_attributes
from pdtui.robots.simulators.urdf_link_shapes import read_urdf_link_shapes
from pdtui.robots.task import Task
from pdtui.robots.tasks.a1_tasks import A1_TASKS
from pdtui.robots.training_recipe import TrainingRecipe

_LEGS: dict[str, FootPlace] = {"FR": "front right", "FL": "front left", "RR": "rear right", "RL": "rear left"}
_JOINTS = tuple(f"{leg}_{part}" for leg in _LEGS for part in ("hip", "upper", "lower"))
# Joint angles at action 0, and their change per unit of action, rad.
_STANCE = np.array([0.0, 0.9, -1.8] * 4)
_ACTION_SCALE = np.array([0.05, 0.5, 0.5] * 4)
# The action of each joint. Diagonal legs share theirs: FR and RL the first three, FL and RR the last three.
_DIAGONALS = np.array([0, 1, 2, 3, 4, 5, 3, 4, 5, 0, 1, 2])
_KP, _KD = 80.0, 0.4  # gains of the joints' controllers, N m/rad and N m s/rad
# Physics step (s), physics steps per control step, and age of what is observed, in physics steps.
_DT, _SUBSTEPS, _LATENCY = 0.001, 16, 2
_START_HEIGHT, _START_NOISE = 0.28, 0.05  # of the trunk, m, and of the joints, rad
# Below this height (m), or with less than this share of its vertical axis upright, the robot has fallen.
_MIN_HEIGHT, _MIN_UPRIGHT = 0.2, 0.6
_FRICTION = {"lateralFriction": 1.0, "spinningFriction": 0.01, "rollingFriction": 0.01}
# Distance to a trunk of a tree within which the legs may touch it (m), and control steps between two hits.
_REACH, _STEPS_BETWEEN_HITS = 0.8, 31
_ALIVE_REWARD, _FALL_PENALTY, _ENERGY_WEIGHT = 0.3, 10.0, 0.0005


class A1(BulletRobot):
    """PyBullet's model of the Unitree A1; a control step is 16 physics steps of 1 ms.

    The observation (93) holds values of the last 3 control steps, the newest first: the trunk's displacement
    in each step in the world's frame (3 × 3), its roll, pitch, yaw and yaw rate (3 × 4), the joints' target
    angles (3 × 12) and the joints' angles (3 × 12). Angles and rates are 2 ms old. Ground and trees are not
    observed.

    The action (6), each number in [−1, 1], moves hip, upper and lower joint of one pair of diagonal legs
    (front right and rear left), then of the other; 0 is standing. A proportional-derivative controller
    without a torque limit moves the joints to these targets.

    The reward is vx in m/s, up to `top_speed`, plus 0.3, minus 0.0005 times the motors' power in W, and −10
    for a fall. An episode ends when the trunk is less than 0.2 m above the ground or leans by more than 53°.
    Every collision with a tree costs 1, unless the same tree was touched within the last half second.

    Ground, trees and the small deviations of the joints at the start are functions of the seed: the same seed
    gives the same rough ground with and without trees.

    Args:
        terrain: Where the robot starts unless `reset` says otherwise: on a ``plane``, on ``rough`` ground, or
            in a ``forest`` on rough ground.
        roughness: Largest height of rough ground, m.
        density: Trees of the forest per square meter.
        top_speed: Speed beyond which going faster is not rewarded, m/s.
    """

    name = "a1"
    title = "Unitree A1 (PyBullet)"
    feet = tuple(Foot(place, f"{leg}_toe", place, f"{place} contact") for leg, place in _LEGS.items())
    observation_edits = a1_observation_edits(_DT * _SUBSTEPS)
    tasks: tuple[Task, ...] = A1_TASKS
    # A policy that runs faster cannot be steered between trees. PyBullet holds Python's lock while it steps,
    # and its steps are slow: batches smaller than the paper's 16384 learn from fewer. A robot takes 70 MB.
    training_recipe = TrainingRecipe(
        options={"terrain": "rough", "top_speed": 2.0},
        settings={
            "layers": (256, 256, 256, 256),
            "processes": True,
            "worlds": 32,
            "chunk": 128,
            "minibatch": 512,
            "total_steps": 6_000_000,
            "evaluate_every": 163_840,
            "evaluate_steps": 400,
        },
    )
    starts = ("plane", "rough", "forest")
    episode_steps = 400
    control_dt = _DT * _SUBSTEPS
    state_arrays = (
        "_place", "_displacements", "_attitudes", "_targets", "_angles", "_torques", "_contacts", "_untouched"
    )  # fmt: skip

    def __init__(
        self,
        terrain: Literal["plane", "rough", "forest"] = "plane",
        roughness: float = 0.05,
        density: float = 0.15,
        top_speed: float = math.inf,
    ) -> None:
        super().__init__()
        if terrain not in self.starts:
            raise RobotError(f"{self.name}: no terrain '{terrain}'; available: {', '.join(self.starts)}")
        self._terrain, self._roughness, self._density = terrain, roughness, density
        self._top_speed = top_speed
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (93,), np.float64)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (6,), np.float32)
        self._urdf = bullet_robot.bullet_data_folder() / "a1" / "a1.urdf"
        self.links = read_urdf_link_shapes(self._urdf, ("trunk", *_JOINTS))
        self.rebuild_world(0, terrain)
        limits = [self.bullet.getJointInfo(self.robot_id, joint)[10] for joint in self._joints]
        self.attributes = (
            *TRUNK_ATTRIBUTES,
            Attribute("distance", "m"),
            *torque_attributes([f"{_LEGS[joint[:2]]} {joint[3:]}" for joint in _JOINTS], limits),
            *(Attribute(f"{leg} contact", "") for leg in _LEGS.values()),
        )

    def build_world(self, seed: int, start: str) -> int:
        bullet, rng = self.bullet, np.random.default_rng(seed)
        bullet.setGravity(0, 0, -10)
        bullet.setTimeStep(_DT)
        bullet.setPhysicsEngineParameter(numSolverIterations=18, enableConeFriction=0)
        angles = _STANCE + rng.uniform(-_START_NOISE, _START_NOISE, 12)
        self.ground = None if start == "plane" else draw_rough_ground(rng, self._roughness)
        if self.ground is None:
            bullet_robot.add_ground_plane(bullet, _FRICTION)
        else:
            bullet_robot.add_rough_ground(bullet, self.ground, _FRICTION)
        trees = scatter_trees(rng, self._density) if start == "forest" else None
        self.scenery = NO_SCENERY if trees is None else Scenery(cylinders=trees)
        self._trees = bullet_robot.add_trees(bullet, self.scenery.cylinders)
        flags = bullet.URDF_IGNORE_VISUAL_SHAPES
        robot: int = bullet.loadURDF(str(self._urdf), [0, 0, _START_HEIGHT], flags=flags)
        names = {bullet.getJointInfo(robot, j)[12].decode(): j for j in range(bullet.getNumJoints(robot))}
        self._joints = [names[joint] for joint in _JOINTS]
        self._shins = [{names[f"{leg}_lower"], names[f"{leg}_toe"]} for leg in _LEGS]
        self._trunk_offset = -np.array(bullet.getDynamicsInfo(robot, -1)[3])
        for link in range(-1, bullet.getNumJoints(robot)):
            bullet.changeDynamics(robot, link, linearDamping=0, angularDamping=0)
            if link >= 0:  # by default, joints brake by themselves
                bullet.setJointMotorControl2(robot, link, bullet.VELOCITY_CONTROL, targetVelocity=0, force=0)
        for joint, angle in zip(self._joints, angles.tolist(), strict=True):
            bullet.resetJointState(robot, joint, angle)
        return robot

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> ResetResult:
        super().reset(seed=seed)
        start = self.check_start(str((options or {}).get("start", ""))) or self._terrain
        self.rebuild_world(int(self.np_random.integers(2**31)), start)
        angles = np.array([state[0] for state in self._joint_states()])
        self._place = np.array(self._base()[0])
        self._displacements = np.zeros((3, 3))
        self._attitudes = np.tile(self._attitude(), (3, 1))
        self._targets, self._angles = np.tile(_STANCE, (3, 1)), np.tile(angles, (3, 1))
        self._torques, self._contacts = np.zeros(12), np.zeros(4)
        self._untouched = np.full(len(self._trees), float(_STEPS_BETWEEN_HITS))
        return self.observe(), {}

    def step(self, action: NDArray[np.float32]) -> StepResult:
        bullet, robot = self.bullet, self.robot_id
        target = _STANCE + _ACTION_SCALE * np.clip(np.asarray(action, np.float64), -1.0, 1.0)[_DIAGONALS]
        goals, near = target.tolist(), self._near_trees()
        touched, energy = np.zeros(len(self._trees), bool), 0.0
        for substep in range(_SUBSTEPS):
            states = self._joint_states()
            if substep == _SUBSTEPS - _LATENCY:
                sensed_angles, sensed_attitude = [state[0] for state in states], self._attitude()
            torques = [_KP * (goal - now[0]) - _KD * now[1] for goal, now in zip(goals, states, strict=True)]
            energy += sum(abs(torque * now[1]) for torque, now in zip(torques, states, strict=True))
            bullet.setJointMotorControlArray(robot, self._joints, bullet.TORQUE_CONTROL, forces=torques)
            bullet.stepSimulation()
            for tree in near:
                if not touched[tree] and bullet.getContactPoints(robot, self._trees[tree]):
                    touched[tree] = True
        place = np.array(self._base()[0])
        if not np.isfinite(place).all():
            raise SimulationDiverged(f"{self.name}: the simulation diverged: its position is not finite")
        moved, self._place = place - self._place, place
        self._displacements = np.vstack([moved, self._displacements[:2]])
        self._attitudes = np.vstack([sensed_attitude, self._attitudes[:2]])
        self._targets = np.vstack([target, self._targets[:2]])
        self._angles = np.vstack([sensed_angles, self._angles[:2]])
        self._torques, self._contacts = np.array(torques), self._sense_contacts()
        cost = float((touched & (self._untouched >= _STEPS_BETWEEN_HITS)).sum())
        self._untouched = np.where(touched, 0.0, self._untouched + 1.0)
        reason = self._find_fall()
        forward = min(float(moved[0]) / self.control_dt, self._top_speed)
        reward = forward + _ALIVE_REWARD - _ENERGY_WEIGHT * energy / _SUBSTEPS - _FALL_PENALTY * bool(reason)
        return self.observe(), reward, bool(reason), False, {"cost": cost, **fall_info(reason)}

    def observe(self) -> Floats:
        return np.concatenate((self._displacements, self._attitudes, self._targets, self._angles), axis=None)

    def read_attributes(self) -> Floats:
        x, y, z = self._base()[0]
        vx, vy, _ = self.bullet.getBaseVelocity(self.robot_id)[0]
        roll, pitch, yaw, rate = self._attitude()
        motion = [vx, vy, math.hypot(vx, vy), yaw, rate, roll, pitch, z - self._ground_at(x, y), x]
        return np.array([*motion, *self._torques, *self._contacts])

    def read_poses(self) -> Floats:
        place, turn = self.bullet.multiplyTransforms(*self._base(), self._trunk_offset.tolist(), [0, 0, 0, 1])
        links = self.bullet.getLinkStates(self.robot_id, self._joints, computeForwardKinematics=True)
        poses = np.array([[*place, *turn], *([*link[4], *link[5]] for link in links)])
        return poses[:, [0, 1, 2, 6, 3, 4, 5]]

    def simulator_numbers(self) -> tuple[Any, ...]:
        joints = [state[:2] for state in self._joint_states()]
        return (self._base(), self.bullet.getBaseVelocity(self.robot_id), joints)

    def _base(self) -> Any:
        return self.bullet.getBasePositionAndOrientation(self.robot_id)

    def _joint_states(self) -> Any:
        return self.bullet.getJointStates(self.robot_id, self._joints)

    def _attitude(self) -> list[float]:
        """Return roll, pitch, yaw, and the rate of turning about the trunk's own vertical axis."""
        x, y, z, w = self._base()[1]
        wx, wy, wz = self.bullet.getBaseVelocity(self.robot_id)[1]
        rate = 2 * (x * z + w * y) * wx + 2 * (y * z - w * x) * wy + (1 - 2 * (x * x + y * y)) * wz
        return [*roll_pitch_yaw(w, x, y, z), rate]

    def _ground_at(self, x: float, y: float) -> float:
        return 0.0 if self.ground is None else self.ground.height(x, y)

    def _near_trees(self) -> list[int]:
        x, y, radius = self.scenery.cylinders.T
        return np.flatnonzero(np.hypot(x - self._place[0], y - self._place[1]) - radius < _REACH).tolist()

    def _sense_contacts(self) -> Floats:
        links = {point[3] for point in self.bullet.getContactPoints(self.robot_id) if point[9] > 0.0}
        return np.array([float(bool(links & shin)) for shin in self._shins])

    def _find_fall(self) -> str:
        (x, y, z), (qx, qy, _, _) = self._base()
        height, upright = z - self._ground_at(x, y), 1.0 - 2.0 * (qx * qx + qy * qy)
        if upright < _MIN_UPRIGHT:
            return f"fell: leans by {math.degrees(math.acos(max(-1.0, upright))):.0f}°"
        if height < _MIN_HEIGHT:
            return f"fell: trunk {height:.2f} m above the ground, under {_MIN_HEIGHT} m"
        return ""
