"""What the viewer has to know of a session's behaviors: their colors, and what they hold."""

from __future__ import annotations

from collections.abc import Sequence

from pdtui.core.errors import MapError
from pdtui.sessions.drive_info import DriveInfo
from pdtui.stimulation.behavior_colors import behavior_rgb
from pdtui.stimulation.map_reader import parse_map

IDLE = (150, 150, 150)
"""Where no behavior is active."""


class BehaviorLegend:
    """Colors by the behavior's row in the map; a behavior that the map does not tell of gets the next.

    Args:
        info: with the map's text. A text that is no map, as another version may have written it, is no error:
            it determines nothing but colors here.
    """

    def __init__(self, info: DriveInfo) -> None:
        try:
            behaviors = parse_map(info.map_text, "map").behaviors
        except MapError:
            behaviors = {}
        self._rows = {name: row for row, name in enumerate(behaviors)}
        self.held = {name: one.pid.attribute for name, one in behaviors.items() if one.pid is not None}
        """The attribute that a behavior holds at a target."""

    @property
    def names(self) -> tuple[str, ...]:
        """All behaviors that have a color."""
        return tuple(self._rows)

    def color(self, name: str) -> tuple[int, int, int]:
        """Of a behavior."""
        return behavior_rgb(self._rows.setdefault(name, len(self._rows)))

    def color_of_state(self, names: Sequence[str]) -> tuple[int, int, int]:
        """Of behaviors that are active together: the color of the latest."""
        return self.color(names[-1]) if names else IDLE
