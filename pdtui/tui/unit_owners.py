"""Finding the behavior that overwrites a unit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from pdtui.core.errors import PolicyError
from pdtui.core.units import parse_unit

if TYPE_CHECKING:
    from pdtui.core.step_record import ActiveBehavior
    from pdtui.stimulation.stimulation_map import StimulationMap


def unit_owners(
    stimulation_map: StimulationMap, active: Sequence[ActiveBehavior], layers: Sequence[int]
) -> dict[int, str]:
    """Return, for each overwritten unit, the behavior that decides its value: the one latched last."""
    names: dict[int, str] = {}
    for view in active:
        behavior = stimulation_map.behaviors.get(view.name)
        for address in stimulation_map.units_of(behavior) if behavior is not None else ():
            try:
                names[parse_unit(address, layers)] = view.name
            except PolicyError:
                continue  # the drive refuses such a map with a message of its own
    return names
