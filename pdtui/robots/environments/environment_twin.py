"""A twin of an environment that draws its picture, so that drawing cannot change the run."""

from __future__ import annotations

import os
import time
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from pdtui.robots.environments.environment_builder import make_environment
from pdtui.robots.environments.gymnasium_spaces import vector_to_action
from pdtui.robots.environments.plain_gymnasium_robot import PlainGymnasiumRobot
from pdtui.robots.simulators.python_state import copy_python_state, is_plain_data, wrapper_layers

MOST_ROWS, MOST_COLUMNS = 96, 160
"""Largest size of a picture, in pixels: twice the lines, and the columns, of a large pane."""
_CATCHING_UP = 0.01  # longest time that a call spends on repeating actions, s
_DRAWING = "rgb_array"


class EnvironmentTwin:
    """Draws the environment of a robot that shows no simulator.

    Some environments change something when they draw (Box2D's LunarLander drops its particles), and keep
    handles of the picture. Hence the twin draws, in the state of the robot's own environment. If that can be
    copied, each picture takes a copy; if it consists of a seed and actions, the twin follows them, and its
    picture stays behind where there are many to repeat.

    Args:
        robot: the robot.

    Raises:
        RobotError: the environment cannot be built for drawing.
    """

    def __init__(self, robot: PlainGymnasiumRobot) -> None:
        # An environment that draws with SDL shall open neither a window nor a loudspeaker, and print nothing.
        os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
        os.environ.setdefault("SDL_AUDIODRIVER", "dummy")
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        self._robot = robot
        self._env = self._make()
        self.observation, _ = self._env.reset(seed=0)
        """What the twin observed last; where it follows actions, as the robot unless it is behind."""
        self._followed: tuple[int, int] = (-1, 0)
        """Number of the robot's reset, and of the actions after it, that the twin has followed."""

    def _make(self) -> gymnasium.Env[Any, Any]:
        robot = self._robot
        return make_environment(robot.environment, {**robot.environment_options, "render_mode": _DRAWING})

    def draw(self) -> NDArray[np.uint8] | None:
        """Return the picture of the present state, shape (rows, columns, 3); None where there is none."""
        robot = self._robot
        if robot.twin_repeats_actions:
            self._follow_actions()
        else:
            self._take_state(robot.env)
        picture = self._env.render()
        if not isinstance(picture, np.ndarray) or picture.ndim != 3 or picture.shape[2] != 3:
            return None
        return shrink_picture(picture.astype(np.uint8))

    @property
    def steps_behind(self) -> int:
        """Number of actions that the twin has not followed yet; its picture is that much older."""
        number, done = self._followed
        actions = len(self._robot.actions_since_reset)
        return actions - done if number == self._robot.resets else actions

    def close(self) -> None:
        """Close the twin."""
        self._env.close()

    def _take_state(self, env: gymnasium.Env[Any, Any]) -> None:
        state = copy_python_state(env)
        for number, layer in enumerate(wrapper_layers(self._env)):
            own = vars(layer)
            handles = {name for name, value in own.items() if not is_plain_data(value)}
            taken = state.get(str(number), {})
            own.update({name: taken[name] for name in taken.keys() - handles - {"render_mode"}})

    def _follow_actions(self) -> None:
        robot = self._robot
        number, actions = robot.resets, robot.actions_since_reset
        if self._followed[0] != number or self._followed[1] > len(actions):
            self._env.close()
            self._env = self._make()  # as the robot does: a used world may not repeat itself
            self.observation, _ = self._env.reset(seed=robot.episode_seed)
            self._followed = number, 0
        until = time.monotonic() + _CATCHING_UP
        first = done = self._followed[1]
        while done < len(actions) and (done == first or time.monotonic() < until):
            taken = vector_to_action(self._env.action_space, actions[done].astype(np.float32), robot.name)
            self.observation = self._env.step(taken)[0]
            done += 1
        self._followed = number, done


def shrink_picture(
    picture: NDArray[np.uint8], most_rows: int = MOST_ROWS, most_columns: int = MOST_COLUMNS
) -> NDArray[np.uint8]:
    """Return a picture (rows, columns, 3) in a smaller size, by means over blocks of pixels."""
    rows, columns = picture.shape[:2]
    block = max(1, -(-rows // most_rows), -(-columns // most_columns))
    if block == 1:
        return picture
    high, wide = max(rows // block, 1), max(columns // block, 1)
    total = np.zeros((high, wide, 3), np.uint32)
    for down in range(min(block, rows)):  # much faster than a mean over two axes of a view
        for across in range(min(block, columns)):
            total += picture[down::block, across::block][:high, :wide]
    means: NDArray[np.uint8] = (total // (min(block, rows) * min(block, columns))).astype(np.uint8)
    return means
