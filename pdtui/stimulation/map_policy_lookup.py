"""The map as it is driven: with the policy that was asked for, found where it lies, and every choice made."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pdtui.policies.weights.file_search import find_inside
from pdtui.policies.weights.import_options import NO_NORMALISER, NO_OPTIONS, ImportOptions
from pdtui.stimulation.map_writer import compose_map, replace_policy
from pdtui.stimulation.stimulation_map import StimulationMap


def resolve_map_policy(
    stimulation_map: StimulationMap, policy: str = "", import_options: ImportOptions = NO_OPTIONS
) -> StimulationMap:
    """Put policy and choices of this drive into the map, and into its text, which the session keeps.

    Files that the map names by their path from its own folder are named by their path from the working
    directory, so that the session finds them without the map. Comments stay.

    Args:
        stimulation_map: as its file has it.
        policy: weights to use instead of the map's; empty for those.
        import_options: of this drive; where they are silent, the map's hold.

    Raises:
        PolicyError: the map names a file outside of its own folder and the working directory.
        MapError: its text cannot be changed.
    """
    found = locate_map_policy(stimulation_map, policy, import_options)
    if (found.policy, found.import_options) == (stimulation_map.policy, stimulation_map.import_options):
        return stimulation_map
    text = stimulation_map.text or compose_map(stimulation_map)
    text = replace_policy(text, found.policy, found.import_options, stimulation_map.source)
    return replace(found, text=text)


def locate_map_policy(
    stimulation_map: StimulationMap, policy: str = "", import_options: ImportOptions = NO_OPTIONS
) -> StimulationMap:
    """As `resolve_map_policy`, but the map's text stays as it is.

    Raises:
        PolicyError: the map names a file outside of its own folder and the working directory.
    """
    source = stimulation_map.source
    folder = Path(source).parent
    name = policy or _from_here(stimulation_map.policy, folder, source)
    merged = import_options.over(stimulation_map.import_options)
    if merged.normaliser != NO_NORMALISER and not import_options.normaliser:
        merged = replace(merged, normaliser=_from_here(merged.normaliser, folder, source))
    return replace(stimulation_map, policy=name, import_options=merged)


def _from_here(name: str, folder: Path, source: str) -> str:
    """The name of a file as the working directory reaches it; as it is where it is found so, or nowhere."""
    found = find_inside(name, (folder,), source) if name else None
    if found is None or found == Path(name):
        return name
    here = Path.cwd()
    return str(found.resolve().relative_to(here) if found.resolve().is_relative_to(here) else found.resolve())
