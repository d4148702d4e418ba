"""From a robot's name to the robot: pdtui's own, those of other packages, and Gymnasium's environments.

A name comes from the command line, but also from a map or a session that somebody sent. Building a robot
runs code that is installed here, and nothing else: a name may choose among it. Gymnasium would import the
module in front of a colon (``package.module:Thing-v0``); here that happens only for modules that the user
named: on the command line, or in the environment variable `TRUSTED`. A module that is imported already is
only looked up.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from difflib import get_close_matches
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pdtui.core.errors import RobotError

if TYPE_CHECKING:
    from pdtui.robots.robot import Robot

GROUP = "pdtui.robots"
TRUSTED = "PDTUI_ENVIRONMENT_MODULES"


def own_robots() -> dict[str, str]:
    """Return the modules of pdtui's own robots by name. None of them is imported.

    The robot ``some-name`` is the class in ``some_name.py``, here, that assigns ``"some-name"`` to `name`.
    """
    package, robots = __package__ or "", {}
    for path in sorted(
        file for folder in sys.modules[package].__path__ for file in Path(folder).glob("*.py")
    ):
        source = path.read_text(encoding="utf-8")
        for name in (path.stem, path.stem.replace("_", "-")):
            if f'    name = "{name}"\n' in source:
                robots[name] = f"{package}.{path.stem}"
    return robots


def robot_names() -> list[str]:
    """Return the names of pdtui's own robots, then of those of other packages."""
    return [*own_robots(), *(entry.name for entry in entry_points(group=GROUP))]


def trust_module(robot: str) -> None:
    """Let the module in front of the colon of a name be imported, here and in processes started from here.

    Only for names that the user typed.
    """
    module, colon, _ = robot.rpartition(":")
    if colon:
        os.environ[TRUSTED] = ",".join([*_trusted(), module])


def check_robot(name: str) -> str:
    """Return the name of a robot that can be built here.

    Raises:
        RobotError: there is none of that name; the message has close matches.
    """
    if name not in own_robots() and _entry_of(name) is None:
        _registered(name)
    return name


def make_robot(name: str, **options: Any) -> Robot:
    """Build a robot in its own simulator.

    Args:
        name: of one of pdtui's own robots, of an entry point of group `GROUP`, or of an environment that is
            registered with Gymnasium; the first that has it.
        options: for the robot's class; environments have none.

    Raises:
        RobotError: no robot has that name, or what it needs is not installed.
    """
    if name in own_robots():
        return _own(name, options)
    entry = _entry_of(name)
    if entry is not None:
        return _from_entry(entry, options)
    return _from_environment(_registered(name), name)


@contextmanager
def open_robot(robot: str | Robot) -> Iterator[Robot]:
    """Yield a robot; one that is given by its name is built here, and closed when the block ends.

    Raises:
        RobotError: As `make_robot` does.
    """
    if not isinstance(robot, str):
        yield robot
        return
    with closing(make_robot(robot)) as built:
        yield built


def file_stem(name: str) -> str:
    """A robot's name as part of a file's name: an environment's id may hold ``/`` and ``:``."""
    return "".join(letter if letter.isalnum() or letter in "-_." else "-" for letter in name)


def _own(name: str, options: dict[str, Any]) -> Robot:
    try:
        module = import_module(own_robots()[name])
    except ImportError as error:
        raise RobotError(f"robot '{name}' needs a package that is not installed: {error}") from error
    classes = (one for one in vars(module).values() if isinstance(one, type))
    robot: Robot = next(one for one in classes if vars(one).get("name") == name)(**options)
    return robot


def _entry_of(name: str) -> EntryPoint | None:
    return next(iter(entry_points(group=GROUP, name=name)), None)


def _from_entry(entry: EntryPoint, options: dict[str, Any]) -> Robot:
    from pdtui.robots.robot import Robot

    package = f" of {entry.dist.name}" if entry.dist is not None else ""
    label = f"robot '{entry.name}' (entry point {entry.value}{package})"
    try:
        robot = entry.load()(**options)
    except RobotError:
        raise
    except Exception as error:  # whatever a third party's module raises
        raise RobotError(f"{label}: cannot be built: {type(error).__name__}: {error}") from error
    if not isinstance(robot, Robot):
        raise RobotError(f"{label}: expected a pdtui.robots.Robot, found {type(robot).__name__}")
    if robot.name != entry.name:
        raise RobotError(f"{label}: expected the class to have that name, found '{robot.name}'")
    return robot


def _from_environment(environment: str, name: str) -> Robot:
    from pdtui.robots.environments.gymnasium_robot import make_environment
    from pdtui.robots.environments.mujoco_gymnasium_robot import MujocoGymnasiumRobot, is_mujoco
    from pdtui.robots.environments.plain_gymnasium_robot import PlainGymnasiumRobot
    from pdtui.robots.simulators.mujoco_robot import ignored_warnings

    with ignored_warnings():
        env = make_environment(environment)
    kind = MujocoGymnasiumRobot if is_mujoco(env) else PlainGymnasiumRobot
    env.close()
    return kind(name, environment=environment)


def _registered(name: str) -> str:
    """The registered id behind a name, without its module.

    Raises:
        RobotError: nothing is registered by that name, or its module may not be imported.
    """
    import gymnasium

    if not name.isprintable():
        raise RobotError(f"unknown robot {name!r}")
    module, colon, environment = name.rpartition(":")
    if colon:
        _import(module, name)
    if environment in gymnasium.registry:
        return environment
    robots = robot_names()
    known = {one.lower(): one for one in [*robots, *gymnasium.registry]}
    close = [known[one] for one in get_close_matches(environment.lower(), known, 4, 0.5)]
    hint = f"close are {', '.join(close)}" if close else f"there are {', '.join(sorted(robots))}"
    raise RobotError(f"unknown robot '{name}'; {hint}, and every environment registered with Gymnasium")


def _import(module: str, name: str) -> None:
    if module in sys.modules:
        return
    if module not in _trusted():
        raise RobotError(
            f"robot '{name}': the module '{module}' is not imported because a map or a session says so; "
            f"name robot and map on the command line (drive {name} --map FILE), or the module in {TRUSTED}"
        )
    try:
        import_module(module)
    except Exception as error:  # whatever the module raises
        raise RobotError(f"module '{module}' cannot be imported: {type(error).__name__}: {error}") from error


def _trusted() -> list[str]:
    return [module for module in os.environ.get(TRUSTED, "").split(",") if module]
