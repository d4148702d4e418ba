"""The base class of all robots, whatever their simulator, and how their policies are trained."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from contextlib import AbstractContextManager
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import gymnasium
import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats, attribute_column
from pdtui.core.errors import RobotError
from pdtui.core.outcome import Outcome, outcome_of_step
from pdtui.core.robot_links_and_state import CommandRange, Foot, Link, ManualControl, RobotState
from pdtui.core.scenery import NO_SCENERY, NO_TRAFFIC, Scenery, Traffic
from pdtui.robots.legged.foot_contacts import read_contact_attributes
from pdtui.robots.observation_edits.observation_edit import ObservationEdit
from pdtui.robots.options.robot_option import NO_ROBOT_OPTIONS, RobotOptions, format_robot_options
from pdtui.robots.robot_goals import WALKING_GOALS, RobotGoals
from pdtui.robots.task import Task, find_task
from pdtui.robots.training_recipe import TrainingRecipe

if TYPE_CHECKING:
    from pdtui.robots.lockstep.lockstep_robots import LockstepRobots

ResetResult = tuple[Floats, dict[str, Any]]
StepResult = tuple[Floats, float, bool, bool, dict[str, Any]]


class RewardlessStepResult(NamedTuple):
    """What a control step leads to, but for its reward.

    Attributes:
        observation: The observation after it.
        outcome: How the episode ended, or that its task is done; None for neither.
        ends: Whether the episode is over.
    """

    observation: Floats
    outcome: Outcome | None
    ends: bool


class Robot(gymnasium.Env[Floats, NDArray[np.float32]]):
    """A Gymnasium environment with named attributes, link poses and snapshots.

    `step` puts ``cost`` (float) into its info and, when the episode ends, ``reason`` (str) and ``outcome``,
    one of the words of `pdtui.core.outcome.Outcome`. A robot whose task is done says ``arrived`` although it
    may go on: training and scores end there, a drive does not. `outcome_of` says what counts if there is no
    word. Nobody steps a robot past the end of its episode.

    Attributes:
        name: Name in maps, in sessions and on the command line.
        title: Name for people.
        attributes: What `read_attributes` measures.
        links: Shapes to draw.
        feet: The links that it walks on; empty for a robot that does not walk, or does not say.
        starts: States besides the usual one in which `reset` can start, by its option ``start``.
        commands: What a policy can be commanded, and its default, by name; empty for most robots.
        command_ranges: Ranges in which the policy was trained to follow the commands.
        manual_controls: Components of the action that an operator can take over; empty for most robots.
        observation_edits: Edits of an observation that imprints can use.
        goals: What a dissection looks for.
        tasks: What `pdtui pursue` can look for, with the judge that tells whether it was done.
        training_recipe: How `pdtui train` trains a policy for the robot.
        episode_steps: Control steps after which training and scores end an episode.
        scenery: What stands still around the robot: roads, tree trunks, cones. The object stays the same as
            long as the world does, and another replaces it when that changes, as in `reset` and `restore`.
        outcomes: How its episodes can end by themselves. Tables say so even if none ended that way.
        state_arrays: Names of the Python attributes, all of them arrays, that belong to a robot's state.
        repeats_actions: Whether `restore` repeats the actions since the reset, which takes time.
        needed_package: Module that a robot of pdtui's own needs and that may not be installed. It is written
            out in the robot's class, where `find_needed_package` reads it without importing anything.
        build_options: Options with which `make_robot` built it; those that it does not name have defaults.
    """

    name: str
    title: str
    attributes: tuple[Attribute, ...]
    links: tuple[Link, ...]
    feet: tuple[Foot, ...] = ()
    starts: tuple[str, ...] = ()
    commands: Mapping[str, float] = MappingProxyType({})
    command_ranges: Mapping[str, CommandRange] = MappingProxyType({})
    manual_controls: tuple[ManualControl, ...] = ()
    observation_edits: tuple[ObservationEdit, ...] = ()
    goals: RobotGoals = WALKING_GOALS
    tasks: tuple[Task, ...] = ()
    training_recipe: TrainingRecipe = TrainingRecipe()
    episode_steps: int = 1000
    scenery: Scenery = NO_SCENERY
    outcomes: tuple[Outcome, ...] = (Outcome.FELL,)
    state_arrays: tuple[str, ...] = ()
    repeats_actions: bool = False
    needed_package: str = ""
    build_options: RobotOptions = NO_ROBOT_OPTIONS

    @property
    def full_title(self) -> str:
        """The name for people, with the options that the robot was built with."""
        return ", ".join(filter(None, (self.title, format_robot_options(self.build_options))))

    @property
    @abstractmethod
    def control_dt(self) -> float:
        """Simulated time of one control step, s."""

    @abstractmethod
    def observe(self) -> Floats:
        """Return the observation of the current state, as `step` last returned it."""

    @abstractmethod
    def read_attributes(self) -> Floats:
        """Return the values of `attributes` in the current state, shape (J,)."""

    @abstractmethod
    def read_poses(self) -> Floats:
        """Return the world pose of every body, shape (B, 7): x y z in m, then a quaternion w x y z."""

    def read_foot_contacts(self) -> list[bool] | None:
        """Return whether each of `feet` touches the ground; None if neither simulator nor attributes tell."""
        return read_contact_attributes(self)

    def read_traffic(self) -> Traffic:
        """Return the boxes around the robot that may move, appear and vanish; a drive asks once per step."""
        return NO_TRAFFIC

    @abstractmethod
    def snapshot(self) -> RobotState:
        """Copy the whole state."""

    @abstractmethod
    def restore(self, snapshot: RobotState) -> None:
        """Return to a snapshot, bit-exactly; one of another robot or size is a `RobotError`."""

    def allow_near_restores(self) -> float:
        """Let `restore` be as fast as it can be from now on, and return how far it may be off.

        A simulator that cannot restore its state repeats the actions since the reset, for which it may have
        to start anew. Where many roll-outs are compared, it need not be the last bit.

        Returns:
            Largest deviation of an attribute 100 steps after a `restore`, in its unit; 0 if there is none.
        """
        return 0.0

    def make_lockstep_robots(self, count: int) -> LockstepRobots | None:
        """Return copies of the robot that are stepped together; None where that gains too little."""
        del count
        return None

    @abstractmethod
    def digest(self) -> int:
        """Return a 63-bit digest of the simulator's state: equal states have equal digests."""

    def step_without_reward(self, action: NDArray[np.float32]) -> RewardlessStepResult:
        """Take a control step that leads where `step` does, to the last bit, for those who need no reward."""
        observation, _, terminated, truncated, info = self.step(action)
        outcome = self.outcome_of(terminated, truncated, info)
        return RewardlessStepResult(observation, outcome, terminated or truncated)

    def outcome_of(self, terminated: bool, truncated: bool, info: Mapping[str, Any]) -> Outcome | None:
        """Return the outcome of the episode after a step that returned this; None while there is none.

        A word in the info that is no outcome is a `RobotError`.
        """
        return outcome_of_step(terminated, truncated, info, self.name)

    def set_commands(self, values: Mapping[str, float]) -> bool:
        """Command the policy, from its next observation on, and return whether that is new.

        Args:
            values: A value for each of `commands`.
        """
        del values
        return False

    @property
    def offers_pushes(self) -> bool:
        """Whether the robot can be pushed."""
        return False

    def push_trunk(self, vx: float, vy: float) -> None:
        """Change the velocity of the trunk in the world, m/s, and with it that of all that hangs on it.

        Joints keep their speeds, and a robot that moves in a plane takes its part. The policy has not yet
        observed the push when it acts next, as with one that comes from outside.

        Raises:
            RobotError: The robot cannot be pushed.
        """
        del vx, vy
        raise RobotError(f"{self.name}: expected a robot whose trunk can be pushed, which this one's cannot")

    @property
    def offers_scaled_physics(self) -> bool:
        """Whether the robot's friction and masses can be scaled."""
        return False

    def scaled_physics(self, friction: float, mass: float) -> AbstractContextManager[None]:
        """Multiply the friction of every contact, and all masses and inertias, while the block runs.

        It counts for episodes that begin within the block. The first reset after the block has the robot's
        own world again, to the last bit.

        Raises:
            RobotError: The robot's friction and masses cannot be scaled.
        """
        del friction, mass
        raise RobotError(
            f"{self.name}: expected a robot whose friction and masses can be scaled, which this one's cannot"
        )

    def check_start(self, start: str) -> str:
        """Return the name of a start state, empty for the usual one.

        Raises:
            RobotError: The robot has no such start.
        """
        if start and start not in self.starts:
            known = f"available: {', '.join(self.starts)}" if self.starts else "it has only the usual one"
            raise RobotError(f"{self.name}: no start '{start}'; {known}")
        return start

    def find_task(self, name: str) -> Task:
        """Return the task of a name; one that the robot does not have is a `MapError`."""
        return find_task(name, self.tasks, self.name)

    def attribute_index(self, name: str) -> int:
        """Return the column of an attribute in `read_attributes`.

        Raises:
            RobotError: The robot has no such attribute.
        """
        return attribute_column(name, self.attributes, self.name)

    def _check_snapshot(self, snapshot: RobotState) -> None:
        if snapshot.robot != self.name:
            raise RobotError(f"{self.name}: expected a snapshot of {self.name}, got one of {snapshot.robot}")

    def _copy_arrays(self) -> tuple[Floats, ...]:
        return tuple(getattr(self, name).copy() for name in self.state_arrays)

    def _restore_arrays(self, arrays: tuple[Floats, ...]) -> None:
        for name, array in zip(self.state_arrays, arrays, strict=True):
            setattr(self, name, array.copy())
