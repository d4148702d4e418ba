"""Finds the policy of a map: the one that the user names, or the one that the map names.

The screen's process imports this module, so neither PyTorch nor a simulator may come with it.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from pdtui.policies.weights.import_options import NO_NORMALIZER, NO_OPTIONS, ImportOptions
from pdtui.policies.weights.policy_file_lookup import find_file_inside_folders, is_file, policy_search_folders
from pdtui.stimulation.map_writer import compose_map, replace_policy
from pdtui.stimulation.stimulation_map import StimulationMap


def resolve_map_policy(
    stimulation_map: StimulationMap, policy: str = "", import_options: ImportOptions = NO_OPTIONS
) -> StimulationMap:
    """Put the policy and the import options of a drive into a map and its text, which the session keeps.

    A file that the map names by its path from the map's folder is named by its path from the working
    directory, so that the session finds it without the map. Comments stay.

    Args:
        stimulation_map: The map as its file has it.
        policy: Weights to use instead of the map's; empty for the map's.
        import_options: Those of the drive; the map's are used where they say nothing.

    Raises:
        PolicyError: The map names a file outside of its own folder and the working directory.
        MapError: The text of the map is not a map.
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
    """Do the same as `resolve_map_policy`, but leave the text of the map as it is."""
    source = stimulation_map.source
    name = policy or _path_from_here(stimulation_map.policy, source)
    merged = import_options.or_else(stimulation_map.import_options)
    if merged.normalizer != NO_NORMALIZER and not import_options.normalizer:
        merged = replace(merged, normalizer=_path_from_here(merged.normalizer, source))
    return replace(stimulation_map, policy=name, import_options=merged)


def relative_policy_name(
    policy: str, import_options: ImportOptions, output: Path
) -> tuple[str, ImportOptions]:
    """Return how a map names a policy and its statistics: a file by its path from the map's folder.

    Args:
        policy: The policy as the user gave it: a file, by its path from the working directory, or a name.
        import_options: As the user gave them.
        output: The map's file.
    """
    normalizer = _path_from_map(import_options.normalizer, output)
    return _path_from_map(policy, output), replace(import_options, normalizer=normalizer)


def _path_from_map(name: str, output: Path) -> str:
    path = Path(name)
    if not name or path.is_absolute() or not is_file(path):
        return name
    return os.path.relpath(path.parent.resolve() / path.name, output.parent.resolve())


def _path_from_here(name: str, source: str) -> str:
    """Return a file's name as seen from the working directory; unchanged if found that way, or nowhere."""
    found = find_file_inside_folders(name, policy_search_folders(Path(source)), source) if name else None
    if found is None or found == Path(name):
        return name
    here = Path.cwd()
    return str(found.resolve().relative_to(here) if found.resolve().is_relative_to(here) else found.resolve())
