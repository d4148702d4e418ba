"""Pictures of worlds without links: they show the present state and change nothing of the run."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pdtui.driving.pictures.world_pictures import WorldPictures
from pdtui.robots import make_robot
from pdtui.robots.environments.environment_twin import EnvironmentTwin, shrink_picture
from pdtui.robots.environments.gymnasium_spaces import action_to_vector
from pdtui.robots.environments.plain_gymnasium_robot import PlainGymnasiumRobot

WORLDS = ["CartPole-v1", "LunarLander-v3"]
"""One whose state is copied, and one whose actions are repeated."""


def drive(robot: PlainGymnasiumRobot, steps: int, twin: EnvironmentTwin | None = None) -> list[int]:
    """Step with random actions, drawing each state if there is a twin; return the digests."""
    robot.reset(seed=5)
    space = robot.env.action_space
    space.seed(1)
    digests = []
    for _ in range(steps):
        _, _, terminated, truncated, _ = robot.step(action_to_vector(space, space.sample()))
        digests.append(robot.digest())
        if twin is not None:
            twin.draw()
        if terminated or truncated:
            break
    return digests


def draw_present(twin: EnvironmentTwin) -> NDArray[np.uint8]:
    """Draw until the twin has followed all actions; each call follows one at least."""
    picture = twin.draw()
    while twin.steps_behind:
        picture = twin.draw()
    assert picture is not None
    return picture


@pytest.mark.parametrize("world", WORLDS)
def test_drawing_changes_nothing_of_the_run(world: str) -> None:
    pytest.importorskip("pygame")
    robot = make_robot(world)
    assert isinstance(robot, PlainGymnasiumRobot)
    twin = EnvironmentTwin(robot)
    assert drive(robot, 30) == drive(robot, 30, twin)


def test_a_picture_shows_the_state_after_a_restored_one_too() -> None:
    pytest.importorskip("pygame")
    robot = make_robot("CartPole-v1")
    assert isinstance(robot, PlainGymnasiumRobot)
    twin = EnvironmentTwin(robot)
    drive(robot, 4)
    state, first = robot.snapshot(), draw_present(twin)
    assert first.dtype == np.uint8
    assert first.std() > 0
    drive(robot, 9)
    second = draw_present(twin)
    robot.restore(state)
    assert (first != second).any()
    assert (first == draw_present(twin)).all()


def test_a_twin_that_follows_actions_is_where_the_robot_is() -> None:
    """LunarLander drops its particles when it is drawn, so that pictures of the same state differ."""
    pytest.importorskip("pygame")
    robot = make_robot("LunarLander-v3")
    assert isinstance(robot, PlainGymnasiumRobot)
    twin = EnvironmentTwin(robot)
    drive(robot, 4)
    state = robot.snapshot()
    assert draw_present(twin).std() > 0
    np.testing.assert_array_equal(twin.observation, robot.observe())
    drive(robot, 40, twin)
    draw_present(twin)
    np.testing.assert_array_equal(twin.observation, robot.observe())
    robot.restore(state)
    draw_present(twin)
    np.testing.assert_array_equal(twin.observation, robot.observe())


def test_a_world_that_cannot_be_drawn_or_has_links_gets_no_pictures() -> None:
    ant = WorldPictures(make_robot("ant"))
    assert (ant.available, ant.notice, ant.draw(1, past=False)) == (False, "", None)


def test_pictures_of_the_past_are_kept() -> None:
    pytest.importorskip("pygame")
    robot = make_robot("CartPole-v1")
    pictures = WorldPictures(robot)
    assert pictures.available
    robot.reset(seed=1)
    shown = pictures.draw(3, past=False)
    assert pictures.draw(4, past=False) is None  # too soon
    assert pictures.draw(2, past=True) is None
    assert pictures.draw(5, past=True) is shown
    pictures.close()
    assert pictures.draw(9, past=False) is None


def test_shrinking_takes_means_and_keeps_what_is_small() -> None:
    small = np.arange(12, dtype=np.uint8).reshape(2, 2, 3)
    assert shrink_picture(small) is small
    checked = np.zeros((8, 8, 3), np.uint8)
    checked[::2, ::2] = 200
    assert (shrink_picture(checked, 4, 4) == 50).all()
    assert shrink_picture(np.zeros((5, 9, 3), np.uint8), 2, 9).shape == (1, 3, 3)
    assert shrink_picture(np.full((1, 999, 3), 7, np.uint8), 96, 160).tolist()[0][0] == [7, 7, 7]
