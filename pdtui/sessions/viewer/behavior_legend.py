"""The behaviors of a session as the viewer shows them: their colors and the attributes of their targets."""

from __future__ import annotations

from collections.abc import Sequence

from pdtui.core.errors import MapError
from pdtui.sessions.drive_info import DriveInfo
from pdtui.stimulation.behavior_colors import behavior_color_rgb
from pdtui.stimulation.map_reader import parse_map

IDLE = (150, 150, 150)
"""The color where no behavior is active."""


class BehaviorColorLegend:
    """Assigns colors to behaviors in the order of the map; unknown behaviors get the colors after those.

    A map text that cannot be parsed, for example from another version, is no error: only colors depend on it.
    """

    def __init__(self, info: DriveInfo) -> None:
        try:
            behaviors = parse_map(info.map_text, "map").behaviors
        except MapError:
            behaviors = {}
        self._rows = {name: row for row, name in enumerate(behaviors)}
        self.target_attributes = {
            name: one.pid.attribute for name, one in behaviors.items() if one.pid is not None
        }
        """Names of the attributes that behaviors hold at a target, by behavior."""

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all behaviors that have a color."""
        return tuple(self._rows)

    def color(self, name: str) -> tuple[int, int, int]:
        """Return the color of a behavior."""
        return behavior_color_rgb(self._rows.setdefault(name, len(self._rows)))

    def color_of_state(self, names: Sequence[str]) -> tuple[int, int, int]:
        """Return the color of behaviors that are active together: that of the one latched last."""
        return self.color(names[-1]) if names else IDLE
