"""What every robot offers, whichever simulator it lives in."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats, column_of
from pdtui.core.errors import RobotError
from pdtui.core.robot_data import NO_OBSTACLES, CommandRange, Link, RobotState
from pdtui.robots.robot_goals import WALKING_GOALS, RobotGoals
from pdtui.robots.task import Task, find_task
from pdtui.robots.training_recipe import TrainingRecipe


def is_fall(terminated: bool, info: Mapping[str, Any]) -> bool:
    """Return whether a step of a robot ended with a fall: it terminated, but not because the task is done."""
    return bool(terminated) and not info.get("finished", False)


class Robot(gymnasium.Env[Floats, NDArray[np.float32]]):
    """A Gymnasium environment with named attributes, link poses and a snapshot.

    `step` puts ``cost`` (float) into its info and, when the episode ends, ``reason`` (str). An episode that
    terminates ends with a fall, unless ``finished`` (bool) in the info says that the robot's task is done. A
    robot that has finished without terminating can go on: training and scores end there, a drive does not. An
    episode that is truncated has run out of time. Nobody steps a robot past the end of its episode.

    Attributes:
        name: as maps, sessions and the command line call it.
        title: for people.
        attributes: what `read_attributes` measures.
        links: what there is to draw.
        starts: states besides the usual one in which `reset` can start, by its option ``start``.
        commands: what a policy can be asked for and what it is asked for by default, by name; most robots
            have none.
        command_ranges: in which the policy was trained to follow them.
        goals: what a dissection looks for.
        tasks: what `pdtui pursue` can look for, and how to tell whether it was done.
        training_recipe: how `pdtui train` trains a policy for it.
        episode_steps: control steps after which training and scores end an episode.
        obstacles: upright cylinders in its way, shape (N, 3): x, y and radius, m. They stay where they are
            until the next `reset` or `restore`; other obstacles are another array.
    """

    name: str
    title: str
    attributes: tuple[Attribute, ...]
    links: tuple[Link, ...]
    starts: tuple[str, ...] = ()
    commands: Mapping[str, float] = MappingProxyType({})
    command_ranges: Mapping[str, CommandRange] = MappingProxyType({})
    goals: RobotGoals = WALKING_GOALS
    tasks: tuple[Task, ...] = ()
    training_recipe: TrainingRecipe = TrainingRecipe()
    episode_steps: int = 1000
    obstacles: Floats = NO_OBSTACLES

    @property
    @abstractmethod
    def control_dt(self) -> float:
        """Simulated time of one control step, s."""

    @abstractmethod
    def observe(self) -> Floats:
        """The observation of the present state, as `step` last returned it."""

    @abstractmethod
    def read_attributes(self) -> Floats:
        """Values of `attributes` in the present state, shape (J,)."""

    @abstractmethod
    def read_poses(self) -> Floats:
        """World pose of every body, shape (B, 7): x y z in m, then a quaternion w x y z."""

    @abstractmethod
    def snapshot(self) -> RobotState:
        """Copy the whole state."""

    @abstractmethod
    def restore(self, snapshot: RobotState) -> None:
        """Return to a snapshot, bit-exactly.

        Raises:
            RobotError: the snapshot is of another robot or has another size.
        """

    @abstractmethod
    def digest(self) -> int:
        """A 63-bit digest of the simulator's state: equal states have equal digests."""

    def set_commands(self, values: Mapping[str, float]) -> bool:
        """Ask the policy for something, from what it observes next on; returns whether that is new.

        Args:
            values: one for each of `commands`.
        """
        del values
        return False

    def check_start(self, start: str) -> str:
        """Return the name of a start state, empty for the usual one.

        Raises:
            RobotError: the robot has no such start.
        """
        if start and start not in self.starts:
            known = f"there are {', '.join(self.starts)}" if self.starts else "it has only the usual one"
            raise RobotError(f"{self.name}: no start '{start}'; {known}")
        return start

    def find_task(self, name: str) -> Task:
        """Return the task of a name.

        Raises:
            MapError: the robot has no such task.
        """
        return find_task(name, self.tasks, self.name)

    def attribute_index(self, name: str) -> int:
        """Column of an attribute in `read_attributes`.

        Raises:
            RobotError: the robot has no such attribute.
        """
        return column_of(name, self.attributes, self.name)
