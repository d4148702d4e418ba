"""The options of an environment that is registered with Gymnasium: the arguments of its class."""

from __future__ import annotations

from dataclasses import replace

import gymnasium
from gymnasium.envs.registration import load_env_creator

from pdtui.core.errors import RobotError
from pdtui.robots.options.constructor_options import option_of_default, read_constructor_options
from pdtui.robots.options.robot_option import RobotOption

_TAKEN = ("render_mode", "id", "max_episode_steps", "disable_env_checker")
"""Arguments that pdtui chooses, or that `gymnasium.make` would take for its own."""


def read_environment_options(environment: str) -> tuple[RobotOption, ...]:
    """Return the options of a registered environment; the registration's arguments are their defaults.

    Raises:
        RobotError: The environment's class cannot be imported.
    """
    spec = gymnasium.spec(environment)
    if spec.entry_point is None:
        return ()
    try:
        build = load_env_creator(spec.entry_point) if isinstance(spec.entry_point, str) else spec.entry_point
    except Exception as error:  # whatever a third party's module raises
        raise RobotError(f"environment '{environment}' cannot be imported: {error}") from error
    found = {option.name: option for option in read_constructor_options(build, of_bases=False)}
    for name, value in spec.kwargs.items():
        registered = option_of_default(name, value)
        if name in found and registered is not None:
            found[name] = replace(found[name], default=registered.default)
        elif registered is not None:
            found[name] = registered
    return tuple(replace(option, takes_paths=False) for name, option in found.items() if name not in _TAKEN)
