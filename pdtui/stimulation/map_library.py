"""Finds maps: in the user's own folder first, then among those that come with pdtui."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pdtui.core.errors import MapError
from pdtui.core.settings.settings_file import own_folder
from pdtui.policies.weights.policy_file_lookup import is_file
from pdtui.stimulation.map_reader import load_map, parse_map
from pdtui.stimulation.map_writer import compose_map
from pdtui.stimulation.stimulation_map import StimulationMap


def shipped_folder(kind: str) -> Path:
    """Return the folder ``maps`` or ``sessions`` that comes with pdtui, in a checkout or as installed."""
    package = Path(__file__).parents[1]
    installed = package / "shipped" / kind
    return installed if installed.is_dir() else package.parent / kind


def search_folders(kind: Literal["maps", "sessions"]) -> tuple[Path, ...]:
    """Return the folders to look in, the user's own first."""
    own, shipped = Path.cwd() / own_folder(kind), shipped_folder(kind)
    return (own,) if own.resolve() == shipped.resolve() else (own, shipped)


def find_map(name: str) -> Path:
    """Return the path of a map, given by its file or its name.

    If there is none, a `MapError` lists those that exist.
    """
    if name.endswith(".toml"):
        if is_file(Path(name)):
            return Path(name)
        raise MapError(f"{name}: no such map")
    for folder in search_folders("maps"):
        if is_file(folder / f"{name}.toml"):
            return folder / f"{name}.toml"
    known = ", ".join(list_map_names()) or "none"
    raise MapError(f"no map '{name}'; available: {known}")


def list_map_names() -> list[str]:
    """Return the names of all maps, without reading them."""
    return sorted({path.stem for path in _all_paths()})


def user_map_path(path: Path) -> Path:
    """Return the file that a change of a map shall be written into: the map's own, or for a map that comes
    with pdtui a new one of its name in ``./maps``.

    Raises:
        MapError: the copy could not be found by its name, because there is one already.
    """
    shipped = shipped_folder("maps").resolve()
    own = own_folder("maps") / path.name
    if path.resolve().parent != shipped or own.parent.resolve() == shipped:
        return path
    if own.exists():
        raise MapError(f"{path}: comes with pdtui and is not changed, and a copy, {own}, already exists")
    return own


def map_without_behaviors(robot: str, policy: str) -> StimulationMap:
    """Return a map without behaviors, with which a policy drives alone."""
    source = f"the map of {robot} without behaviors"
    text = compose_map(StimulationMap(robot, policy, "", "space", {}, {}, source=source))
    return parse_map(text, source)


@dataclass(frozen=True)
class ListedMap:
    """A map that can be picked, or the problem that prevents it."""

    path: Path
    stimulation_map: StimulationMap | None
    problem: str = ""


def list_maps() -> list[ListedMap]:
    """Return all maps in the folders. One in the user's folder hides a shipped one of the same name."""
    listed: dict[str, ListedMap] = {}
    for path in _all_paths():
        if path.stem in listed:
            continue
        try:
            listed[path.stem] = ListedMap(path, load_map(path))
        except MapError as error:
            listed[path.stem] = ListedMap(path, None, str(error))
    return list(listed.values())


def _all_paths() -> Iterator[Path]:
    for folder in search_folders("maps"):
        yield from sorted(folder.glob("*.toml"))
