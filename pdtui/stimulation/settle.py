"""The map as it is driven: with the policy that was asked for, found where it lies, and every choice made."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, cast

import tomlkit

from pdtui.policies.choices import NO_CHOICES, NO_NORMALISER, PolicyChoices, find_beside
from pdtui.stimulation.maps import StimulationMap


def settle(
    stimulation_map: StimulationMap, policy: str = "", choices: PolicyChoices = NO_CHOICES
) -> StimulationMap:
    """Put policy and choices of this drive into the map, and into its text, which the session keeps.

    Files that the map names by their path from its own folder are named by their path from the working
    directory, so that the session finds them without the map. Comments stay.

    Args:
        stimulation_map: as its file has it.
        policy: weights to use instead of the map's; empty for those.
        choices: of this drive; where they are silent, the map's hold.
    """
    folder = Path(stimulation_map.source).parent
    name = policy or _from_here(stimulation_map.policy, folder)
    merged = choices.over(stimulation_map.choices)
    if merged.normaliser != NO_NORMALISER and not choices.normaliser:
        merged = replace(merged, normaliser=_from_here(merged.normaliser, folder))
    if (name, merged) == (stimulation_map.policy, stimulation_map.choices):
        return stimulation_map
    document = tomlkit.parse(stimulation_map.text)
    table = cast(dict[str, Any], document.setdefault("policy", tomlkit.table()))
    table["name"] = name
    table.update({field: value for field, value in asdict(merged).items() if value})
    return replace(stimulation_map, policy=name, choices=merged, text=tomlkit.dumps(document))


def _from_here(name: str, folder: Path) -> str:
    """The name of a file as the working directory reaches it; as it is where it is found so, or nowhere."""
    if not name or find_beside(name, ()) is not None:
        return name
    found = find_beside(name, (folder,))
    if found is None:
        return name
    here = Path.cwd()
    return str(found.resolve().relative_to(here) if found.resolve().is_relative_to(here) else found.resolve())
