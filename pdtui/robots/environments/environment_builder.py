"""Build environments that are registered with Gymnasium, with one agent in one world."""

from __future__ import annotations

import warnings
from typing import Any

import gymnasium
from gymnasium.envs.registration import load_env_creator

from pdtui.core.errors import RobotError
from pdtui.robots.environments.environment_lookup import SINGLE_AGENT_ONLY
from pdtui.robots.options.robot_option import NO_ROBOT_OPTIONS, RobotOptions


def make_environment(name: str, options: RobotOptions = NO_ROBOT_OPTIONS) -> gymnasium.Env[Any, Any]:
    """Build a registered environment with the wrappers of its registration and options of its own.

    It has no time limit: that serves training, and would end a drive for no visible reason.

    Raises:
        RobotError: A package is missing, or the environment cannot be built, or has several agents or worlds.
    """
    cause: Exception
    with warnings.catch_warnings():
        # Advice to trainers ("there is a newer version") would be printed over the screen.
        warnings.simplefilter("ignore")
        try:
            env = gymnasium.make(name, max_episode_steps=-1, disable_env_checker=True, **options)
            several = _describe_several(env.unwrapped)
            if not several:
                return env
            env.close()
            raise RobotError(f"environment '{name}' {several}; {SINGLE_AGENT_ONLY}")
        except RobotError:
            raise
        except (ImportError, gymnasium.error.DependencyNotInstalled) as error:
            reason, cause = f"needs a package that is not installed: {error}", error
        except Exception as error:  # whatever a third party's constructor raises
            several = _describe_what_is_built(name, options) if isinstance(error, TypeError) else ""
            built = f"{several}; {SINGLE_AGENT_ONLY}" if several else ""
            reason, cause = built or f"cannot be built: {str(error) or type(error).__name__}", error
    raise RobotError(f"environment '{name}' {reason}") from cause


def _describe_what_is_built(name: str, options: RobotOptions) -> str:
    """Return what `_describe_several` says of something that Gymnasium refuses: it is no environment."""
    spec = gymnasium.spec(name)
    try:
        create = load_env_creator(spec.entry_point) if isinstance(spec.entry_point, str) else spec.entry_point
        if create is None:
            return ""
        built = create(**{**spec.kwargs, **options})
        said = _describe_several(built)
        built.close()
    except Exception:  # whatever a third party's constructor raises
        return ""
    return said


def _describe_several(world: object) -> str:
    """Return in words that a world has several agents, or is several worlds; empty for a single one."""
    if hasattr(world, "possible_agents"):
        return "is a world of PettingZoo, or one like them"
    worlds = getattr(world, "num_envs", 1)
    if (isinstance(worlds, int) and worlds != 1) or isinstance(world, gymnasium.vector.VectorEnv):
        return f"is vectorized: it runs {worlds} worlds at once"
    return ""
