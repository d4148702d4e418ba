"""What a shell offers while a command is typed: robots, maps, behaviors, starts, tasks, policies, sessions.

A function here is called by click with the context of the command, the parameter and what was typed so far.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import wraps

from click import Context, Parameter
from click.shell_completion import CompletionItem

from pdtui.core.errors import PdtuiError

Complete = Callable[[Context, Parameter, str], list[CompletionItem]]
_MOST_SESSIONS = 100


def _completer(find_names: Callable[[Context], Iterable[tuple[str, str]]]) -> Complete:
    """Offer the names, each with what it stands for, that begin with what was typed; else files."""

    @wraps(find_names)
    def complete(context: Context, _parameter: Parameter, typed: str) -> list[CompletionItem]:
        try:
            names = [(name, says) for name, says in find_names(context) if name.startswith(typed)]
        except (PdtuiError, OSError):
            names = []  # the command will say what is wrong
        if not names:
            return [CompletionItem(typed, type="file")]
        return [CompletionItem(name, help=says) for name, says in names]

    return complete


@_completer
def complete_robots(_context: Context) -> Iterable[tuple[str, str]]:
    """Offer robots, and otherwise files, since a map's file names a robot, too."""
    from pdtui.robots.robot_registry import list_robot_names

    return [(name, "") for name in list_robot_names()]


@_completer
def complete_maps(_context: Context) -> Iterable[tuple[str, str]]:
    """Offer maps by their names."""
    from pdtui.stimulation.map_library import list_map_names

    return [(name, "") for name in list_map_names()]


@_completer
def complete_behaviors(context: Context) -> Iterable[tuple[str, str]]:
    """Offer the behaviors with a PID controller of the map that was typed before, without those named."""
    from pdtui.stimulation.map_library import find_map
    from pdtui.stimulation.map_reader import load_map

    named = context.params.get("behaviors") or ()
    behaviors = load_map(find_map(context.params["map_name"])).behaviors.values()
    return [(one.name, one.says) for one in behaviors if one.pid is not None and one.name not in named]


@_completer
def complete_starts(context: Context) -> Iterable[tuple[str, str]]:
    """Offer the states in which the robot that was typed before can start."""
    from pdtui.robots.robot_registry import list_robots

    robot = _typed_robot(context)
    return [(start, "") for one in list_robots() if one.name == robot for start in one.starts]


@_completer
def complete_tasks(context: Context) -> Iterable[tuple[str, str]]:
    """Offer the tasks of the robot that was typed before."""
    from pdtui.robots.robot_registry import list_robots

    robot = _typed_robot(context)
    return [(task, "") for one in list_robots() if one.name == robot for task in one.tasks]


def _typed_robot(context: Context) -> str:
    """Return the robot; behind an option without its value yet, click has not told arguments apart."""
    return str(context.params.get("robot") or next(iter(context.args), ""))


@_completer
def complete_policies(_context: Context) -> Iterable[tuple[str, str]]:
    """Offer the policies that come with pdtui."""
    from pdtui.policies.weights.policy_file_lookup import list_shipped_policies

    return [(name, "") for name in list_shipped_policies()]


@_completer
def complete_sessions(_context: Context) -> Iterable[tuple[str, str]]:
    """Offer the user's sessions, the newest first, then the samples that come with pdtui."""
    from pdtui.sessions.session_folders import list_sample_sessions, list_session_files

    return [(str(path), "") for path in (*list_session_files(_MOST_SESSIONS), *list_sample_sessions())]


@_completer
def complete_topics(_context: Context) -> Iterable[tuple[str, str]]:
    """Offer the pages of the guide."""
    from pdtui.guide.guide_pages import read_guide

    return [(name, page.title) for name, page in read_guide().items()]
