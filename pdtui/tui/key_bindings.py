"""Bindings of the drive's screen. Each has an id, so that users can remap it."""

from __future__ import annotations

from textual.binding import Binding

from pdtui.core.key_table import FIXED_KEYS
from pdtui.stimulation.stimulation_map import StimulationMap

# A key that changes the run goes to the drive under its original name, whatever key the user gave it.
BINDINGS: list[Binding] = [
    *(Binding(row.key, row.action or f"run_key('{row.key}')", row.says, id=row.id) for row in FIXED_KEYS),
    Binding("ctrl+c", "leave", "ends the drive and quits, always", id="quit_always", priority=True),
]
HINTS = {row.id: row.hint for row in sorted(FIXED_KEYS, key=lambda row: row.hint_rank) if row.hint}
"""Words of the key line by the bindings' ids, the most useful first."""


def map_keys(stimulation_map: StimulationMap) -> frozenset[str]:
    """The keys that belong to the map; they come before the application's own."""
    behaviors = {behavior.key for behavior in stimulation_map.behaviors.values()}
    return frozenset(behaviors | {stimulation_map.default_key})
