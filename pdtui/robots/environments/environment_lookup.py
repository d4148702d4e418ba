"""Find environments that are registered with Gymnasium, by names that a map or a session may give.

Gymnasium would import the module in front of a colon (``package.module:Name-v0``). Here, such a module must
be imported already, or be named by the user: on the command line, or in the environment variable `TRUSTED`.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Sequence
from difflib import get_close_matches
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from pdtui.core.errors import RobotError

TRUSTED = "PDTUI_ENVIRONMENT_MODULES"
"""Environment variable: the modules that may be imported, separated by commas."""

SINGLE_AGENT_ONLY = "pdtui drives single-agent worlds only: one agent, in one world at a time"
_PETTINGZOO_NAME = re.compile(r"(?:[\w.]+\.)?\w+_v\d+")
"""Names such as ``pistonball_v6``; those that Gymnasium registers end in ``-v6``."""


def trust_module(robot: str) -> None:
    """Allow the import of the module in front of a name's colon, here and in processes started from here.

    Call it only for names that the user typed.
    """
    module, colon, _ = robot.rpartition(":")
    if colon:
        os.environ[TRUSTED] = ",".join([*_trusted_modules(), module])


def resolve_environment_id(name: str, robots: Sequence[str]) -> str:
    """Return the id, registered with Gymnasium, behind a name, without its module.

    Args:
        name: The name, with or without its module.
        robots: Names of other robots, for the message.

    Raises:
        RobotError: No environment is registered by that name, or its module may not be imported.
    """
    import gymnasium

    if not name.isprintable():
        raise RobotError(f"unknown robot {name!r}")
    module, colon, environment = name.rpartition(":")
    if (module or name).split(".")[0] == "pettingzoo":
        raise RobotError(f"'{name}' is a world of PettingZoo; {SINGLE_AGENT_ONLY}")
    if colon and module not in sys.modules:
        _import_trusted(module, name)
    if environment in gymnasium.registry:
        spec = gymnasium.registry[environment]
        if spec.entry_point is None and spec.vector_entry_point is not None:
            raise RobotError(f"environment '{name}' is registered as vectorized only; {SINGLE_AGENT_ONLY}")
        return environment
    if _PETTINGZOO_NAME.fullmatch(environment):
        raise RobotError(
            f"unknown robot '{name}'; worlds of PettingZoo have such names, but {SINGLE_AGENT_ONLY}"
        )
    known = {one.lower(): one for one in [*robots, *gymnasium.registry]}
    close = [known[one] for one in get_close_matches(environment.lower(), known, 4, 0.5)]
    hint = f"did you mean {', '.join(close)}" if close else f"available: {', '.join(sorted(robots))}"
    raise RobotError(f"unknown robot '{name}'; {hint}, or any environment registered with Gymnasium")


def _import_trusted(module: str, name: str) -> None:
    if module not in _trusted_modules():
        raise RobotError(
            f"robot '{name}': the module '{module}' is not imported because a map or a session says so; "
            f"name robot and map on the command line (drive {name} --map FILE), or the module in {TRUSTED}"
        )
    try:
        _make_importable(module)
        import_module(module)
    except Exception as error:  # whatever the module raises
        raise RobotError(f"module '{module}' cannot be imported: {type(error).__name__}: {error}") from error


def _make_importable(module: str) -> None:
    """Let a module of the working directory be imported where no other has its name, as `python -m` does.

    Processes started from here look there, too.
    """
    here = str(Path.cwd())
    if find_spec(module.partition(".")[0]) is None and here not in sys.path:
        sys.path.append(here)


def _trusted_modules() -> list[str]:
    return [module for module in os.environ.get(TRUSTED, "").split(",") if module]
