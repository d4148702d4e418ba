"""Find and build robots by name: pdtui's own, those of other packages, and Gymnasium's environments.

A name may come from the command line, but also from a map or a session that somebody sent. It can only choose
among code that is installed here; see `pdtui.robots.environments.environment_lookup`.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pdtui.core.errors import RobotError
from pdtui.robots.environments.environment_lookup import resolve_environment_id
from pdtui.robots.options.constructor_options import read_constructor_options
from pdtui.robots.options.robot_option import OptionValue, RobotOption, check_robot_options
from pdtui.robots.options.robot_spec import RobotSpec

if TYPE_CHECKING:
    from pdtui.robots.robot import Robot

GROUP = "pdtui.robots"


def find_own_robots() -> dict[str, str]:
    """Return the modules of pdtui's own robots by name, without importing them.

    A robot is any class, in a module of this package, that assigns its name to ``name``.
    """
    package = __package__ or ""
    names = {
        name: f"{package}.{stem}"
        for stem, text in _read_own_files().items()
        for name in _find_assigned("name", text)
    }
    return dict(sorted(names.items()))


def find_needed_package(name: str) -> str:
    """Return the module that a robot of pdtui's own needs and that may not be installed; empty for none."""
    _, _, stem = find_own_robots()[name].rpartition(".")
    return next(iter(_find_assigned("needed_package", _read_own_files()[stem])), "")


def _read_own_files() -> dict[str, str]:
    folders = sys.modules[__package__ or ""].__path__
    files = (file for folder in folders for file in Path(folder).glob("*.py"))
    return {file.stem: file.read_text(encoding="utf-8") for file in files}


def _find_assigned(attribute: str, text: str) -> list[str]:
    """Return what the classes of a module assign to an attribute."""
    return re.findall(rf'^    {attribute} = "([^"]+)"$', text, re.MULTILINE)


def list_robot_names() -> list[str]:
    """Return the names of pdtui's own robots, then of those of other packages."""
    return [*find_own_robots(), *(entry.name for entry in entry_points(group=GROUP))]


@dataclass(frozen=True)
class ListedRobot:
    """A robot that can be driven, or the problem that prevents it.

    Attributes:
        name: Name of the robot.
        title: Its name for people.
        starts: States besides the usual one in which it can start.
        tasks: What `pdtui pursue` can look for.
        problem: Why it cannot be built here; empty if it can.
    """

    name: str
    title: str = ""
    starts: tuple[str, ...] = ()
    tasks: tuple[str, ...] = ()
    problem: str = ""


def list_robots() -> list[ListedRobot]:
    """Return pdtui's own robots, then those of other packages, without building any."""
    own, listed = find_own_robots(), []
    for name in list_robot_names():
        entry = None if name in own else _find_entry_point(name)
        try:
            kind: Any = _load_entry(entry) if entry is not None else _import_own(name, own[name])
        except RobotError as error:
            listed.append(ListedRobot(name, problem=str(error)))
            continue
        starts, tasks = tuple(getattr(kind, "starts", ())), getattr(kind, "tasks", ())
        listed.append(
            ListedRobot(name, getattr(kind, "title", ""), starts, tuple(task.name for task in tasks))
        )
    return listed


def require_robot_name(name: str) -> str:
    """Return the name of a robot that can be built here.

    Raises:
        RobotError: There is no robot of that name; the message lists close matches.
    """
    if name not in find_own_robots() and _find_entry_point(name) is None:
        resolve_environment_id(name, list_robot_names())
    return name


def list_robot_options(name: str) -> tuple[RobotOption, ...]:
    """Return the options with which a robot can be built.

    Raises:
        RobotError: No robot has that name, or what it needs is not installed.
    """
    module = find_own_robots().get(name)
    if module is not None:
        return read_constructor_options(_import_own(name, module))
    entry = _find_entry_point(name)
    if entry is not None:
        return read_constructor_options(_load_entry(entry))
    from pdtui.robots.environments.environment_options import read_environment_options

    return read_environment_options(resolve_environment_id(name, list_robot_names()))


def make_robot(robot: str | RobotSpec, **options: OptionValue) -> Robot:
    """Build a robot in its own simulator.

    Args:
        robot: Name of one of pdtui's own robots, of an entry point of group `GROUP`, or of an environment
            that is registered with Gymnasium, in this order; or a name with options.
        options: Options by name (see `list_robot_options`), in preference to those of a `RobotSpec`.

    Raises:
        RobotError: No robot has that name, it has no such option, or what it needs is not installed.
    """
    name, given = (robot, options) if isinstance(robot, str) else (robot.name, {**robot.options, **options})
    checked = check_robot_options(name, list_robot_options(name), given) if given else {}
    module = find_own_robots().get(name)
    entry = None if module is not None else _find_entry_point(name)
    if module is not None:
        built: Robot = _import_own(name, module)(**checked)
    elif entry is not None:
        built = _build_from_entry(entry, checked)
    else:
        built = _build_environment(name, checked)
    built.build_options = checked
    return built


@contextmanager
def open_robot(robot: str | RobotSpec | Robot) -> Iterator[Robot]:
    """Yield a robot; if it is given by name, it is built here and closed when the block ends.

    Raises:
        RobotError: As `make_robot` does.
    """
    if not isinstance(robot, str | RobotSpec):
        yield robot
        return
    with closing(make_robot(robot)) as built:
        yield built


def robot_file_stem(name: str) -> str:
    """Return a robot's name as part of a file name: an environment's id may contain ``/`` and ``:``."""
    return re.sub(r"[^\w.-]", "-", name)


def _import_own(name: str, module: str) -> type[Robot]:
    try:
        classes = vars(import_module(module)).values()
    except ImportError as error:
        raise RobotError(f"robot '{name}' needs a package that is not installed: {error}") from error
    kind: type[Robot] = next(
        one for one in classes if isinstance(one, type) and vars(one).get("name") == name
    )
    return kind


def _find_entry_point(name: str) -> EntryPoint | None:
    return next(iter(entry_points(group=GROUP, name=name)), None)


def _entry_label(entry: EntryPoint) -> str:
    package = f" of {entry.dist.name}" if entry.dist is not None else ""
    return f"robot '{entry.name}' (entry point {entry.value}{package})"


def _load_entry(entry: EntryPoint) -> Callable[..., Any]:
    try:
        build: Callable[..., Any] = entry.load()
    except Exception as error:  # whatever a third party's module raises
        raise RobotError(
            f"{_entry_label(entry)}: cannot be built: {type(error).__name__}: {error}"
        ) from error
    return build


def _build_from_entry(entry: EntryPoint, options: Mapping[str, OptionValue]) -> Robot:
    from pdtui.robots.robot import Robot

    label, build = _entry_label(entry), _load_entry(entry)
    try:
        robot = build(**options)
    except RobotError:
        raise
    except Exception as error:  # whatever a third party's module raises
        raise RobotError(f"{label}: cannot be built: {type(error).__name__}: {error}") from error
    if not isinstance(robot, Robot):
        raise RobotError(f"{label}: expected a pdtui.robots.Robot, found {type(robot).__name__}")
    if robot.name != entry.name:
        raise RobotError(f"{label}: expected the class to have that name, found '{robot.name}'")
    return robot


def _build_environment(name: str, options: Mapping[str, OptionValue]) -> Robot:
    from pdtui.robots.environments.environment_builder import make_environment
    from pdtui.robots.environments.mujoco_gymnasium_robot import MujocoGymnasiumRobot, is_mujoco
    from pdtui.robots.environments.plain_gymnasium_robot import PlainGymnasiumRobot
    from pdtui.robots.simulators.mujoco_robot import suppress_warnings

    environment = resolve_environment_id(name, list_robot_names())
    with suppress_warnings(), closing(make_environment(environment, options)) as env:
        kind = MujocoGymnasiumRobot if is_mujoco(env) else PlainGymnasiumRobot
    return kind(name, environment=environment, options=options)
