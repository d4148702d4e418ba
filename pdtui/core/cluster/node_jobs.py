"""What the processes of a cluster run: calls with a state that each process builds once.

Ray starts these processes on its nodes and ends them. A node has none of the user's files. Those that a
state needs arrive as objects, are compared with their hash, and lie in the process's working directory under
the names that `RayCluster.add_file` returned.
"""

from __future__ import annotations

import fcntl
import os
import platform
import shutil
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from pdtui.core.errors import ClusterError
from pdtui.core.processes.call_answer import CallAnswer, answer_call
from pdtui.core.processes.installed_packages import list_package_versions

_STATES_KEPT = 2
"""States that a process keeps: jobs of two pools may alternate."""
_PREFIX = "PDTUI_"
"""What the names of pdtui's own environment variables begin with."""
_FOLDER = "pdtui-node-"
"""What the names of the processes' folders begin with."""


@dataclass(frozen=True)
class StateRecipe:
    """How a process of the cluster builds the state of its jobs.

    Attributes:
        build: Function of a module that returns the state.
        arguments: Its arguments.
        versions: Versions of Python and of the packages on the user's machine.
        environment: The user's environment variables that are pdtui's own.
        files: References to the contents of files by their names on the nodes.
    """

    build: Callable[..., Any]
    arguments: tuple[Any, ...]
    versions: Mapping[str, str]
    environment: Mapping[str, str]
    files: Mapping[str, Any]


def describe_installation() -> dict[str, str]:
    """Return the versions on which the results of jobs depend."""
    return {"python": platform.python_version(), **list_package_versions()}


def collect_environment() -> dict[str, str]:
    """Return pdtui's own environment variables."""
    return {name: value for name, value in os.environ.items() if name.startswith(_PREFIX)}


def run_job(recipe: list[Any], function: Callable[..., Any], *arguments: Any) -> CallAnswer:
    """Call a function with the state of a recipe, which is built by the first job of this process.

    Args:
        recipe: A list with the reference to a `StateRecipe`: in a list, Ray does not fetch it for every job.
        function: Function of a module.
        arguments: Its arguments after the state.
    """
    return answer_call(lambda: function(_keep_state(recipe[0]), *arguments))


@lru_cache(_STATES_KEPT)
def _keep_state(reference: Any) -> Any:
    return build_state(_fetch(reference))


def build_state(recipe: StateRecipe) -> Any:
    """Put the files of a recipe in place and build its state.

    Raises:
        ClusterError: This node has other versions than the user's machine, or a file arrived damaged.
    """
    _check_versions(recipe.versions)
    os.environ.update(recipe.environment)
    os.chdir(_own_folder())
    for name, reference in recipe.files.items():
        _put_file(Path(name), reference)
    return recipe.build(*recipe.arguments)


def _fetch(reference: Any) -> Any:
    import ray

    return ray.get(reference)


def _check_versions(wanted: Mapping[str, str]) -> None:
    here = describe_installation()
    for name in dict.fromkeys((*wanted, *here)):
        if wanted.get(name) != here.get(name):
            there, found = (versions.get(name, "none") for versions in (wanted, here))
            raise ClusterError(
                f"node {platform.node()}: expected {name} {there} as on the machine of the command, "
                f"found {found}; results would not be the same"
            )


@cache
def _own_folder() -> Path:
    """Return a new folder of this process, and remove those of dead ones, which Ray killed."""
    for old in Path(tempfile.gettempdir()).glob(f"{_FOLDER}*"):
        if (descriptor := lock_folder(old)) is not None:
            shutil.rmtree(old, ignore_errors=True)
            os.close(descriptor)
    while True:
        folder = Path(tempfile.mkdtemp(prefix=_FOLDER))
        # The lock is held for as long as this process lives. Another might have removed the folder before.
        if lock_folder(folder) is not None and folder.exists():
            return folder


def lock_folder(folder: Path) -> int | None:
    """Lock a folder and return the descriptor that holds the lock, or None if another process holds it."""
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except OSError:  # somebody else's, or just removed
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
        return None
    return descriptor


def _put_file(path: Path, reference: Any) -> None:
    if path.exists():
        return
    content = _fetch(reference)
    if sha256(content).hexdigest() != path.parent.name:
        raise ClusterError(f"{path.name}: arrived damaged at node {platform.node()}")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
