"""Search for the files that maps and sessions name."""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Sequence
from pathlib import Path

from pdtui.core.errors import PolicyError

POLICY_FOLDERS_VARIABLE = "PDTUI_POLICY_FOLDERS"
"""Environment variable: further folders whose files maps and sessions may name, separated as in PATH."""


SHIPPED_WEIGHTS = Path(__file__).parent / "shipped"
PACKAGE_POLICIES = {"metadrive:expert": "examples/ppo_expert/expert_weights.npz"}
"""Policies that come with another package: its name, a colon and a name of ours, and the file in it."""


def list_shipped_policies() -> list[str]:
    """Return the names of the policies that come with pdtui, and of those that come with other packages."""
    return [*sorted(path.stem for path in SHIPPED_WEIGHTS.glob("*.safetensors")), *PACKAGE_POLICIES]


def find_weights_file(name: str, folders: Sequence[Path] = ()) -> Path:
    """Return the path of a weights file: as given, in one of the folders, or a shipped one by its name.

    A name such as ``metadrive:expert`` is that of a policy that comes with another package. If there is none,
    a `PolicyError` lists the shipped policies.
    """
    own = find_file_beside(name, folders)
    if own is not None:
        return own
    if is_file(shipped := SHIPPED_WEIGHTS / f"{name}.safetensors"):
        return shipped
    if (packaged := find_package_policy(name)) is not None:
        return packaged
    known = ", ".join(sorted(path.stem for path in SHIPPED_WEIGHTS.glob("*.safetensors"))) or "none"
    raise PolicyError(f"no policy '{name}': neither a file nor a shipped policy; shipped policies: {known}")


def find_package_policy(name: str) -> Path | None:
    """Return the path of a policy in `PACKAGE_POLICIES`, None for another name.

    Raises:
        PolicyError: The package is not installed here, or its version has no such file.
    """
    if name not in PACKAGE_POLICIES:
        return None
    package = name.partition(":")[0]
    spec = importlib.util.find_spec(package)
    if spec is None or spec.origin is None:
        raise PolicyError(f"policy '{name}' comes with the package '{package}', which is not installed")
    path = Path(spec.origin).parent / PACKAGE_POLICIES[name]
    if not is_file(path):
        raise PolicyError(f"policy '{name}': expected the file {path}, found none")
    return path


def find_file_beside(name: str, folders: Sequence[Path]) -> Path | None:
    """Return the path of a file in the working directory or one of the folders, None if it is in none."""
    places = (Path(name), *(folder / name for folder in folders))
    return next((path for path in places if is_file(path)), None)


def policy_search_folders(path: Path) -> tuple[Path, ...]:
    """Return the folders in which a map or a session may name weights, besides the working directory.

    They are its own and, if that is called ``maps`` or ``sessions``, the one above: there, pdtui was run that
    wrote the file into it.
    """
    folder = path.parent
    return (folder, folder / "..") if folder.resolve().name in ("maps", "sessions") else (folder,)


def find_file_inside_folders(name: str, folders: Sequence[Path], source: str) -> Path | None:
    """Find a file in one of the folders or the working directory, for names in untrusted files.

    It is only found inside allowed folders: the working directory, `folders`, and those in the environment
    variable `POLICY_FOLDERS_VARIABLE`. A symbolic link counts as the file that it points to.

    Args:
        name: Name of the file.
        folders: Folders to search before the working directory.
        source: The map or session that names the file, for messages.

    Raises:
        PolicyError: The name leads outside of the allowed folders.
    """
    allowed = [
        Path.cwd(),
        *folders,
        *map(Path, filter(None, os.environ.get(POLICY_FOLDERS_VARIABLE, "").split(os.pathsep))),
    ]
    inside = [folder.resolve() for folder in allowed]
    outside = False
    for path in (*(folder / name for folder in folders), Path(name)):
        try:
            real = path.resolve()
        except (OSError, RuntimeError, ValueError):  # too long, a loop of links, or not a name
            continue
        if not any(real.is_relative_to(folder) for folder in inside):
            outside = True
        elif is_file(path):
            return path
    if outside:
        raise PolicyError(
            f"{source}: names the file '{name}', which lies outside of its folder and of the working "
            f"directory; name it on the command line (--policy, --normalizer), or its folder in "
            f"{POLICY_FOLDERS_VARIABLE}"
        )
    return None


def is_file(path: Path) -> bool:
    """Return whether there is such a file; a name that no file can have is none."""
    try:
        return path.is_file()
    except OSError:  # the name is too long
        return False
