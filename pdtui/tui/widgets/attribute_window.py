"""Which attributes the table shows where not all have room."""

from __future__ import annotations

from pdtui.driving.drive_snapshot import DriveFacts
from pdtui.stimulation.stimulation_map import StimulationMap

_FORCES = ("N", "N m", "Nm")


def is_force_unit(unit: str) -> bool:
    """Return whether an attribute with this unit is a force or a torque, of which robots have many."""
    return unit in _FORCES


class AttributeWindow:
    """A part of a robot's attributes, which can be scrolled.

    Those that the map is about come first, forces and torques last. What is shown is in the robot's order.
    """

    def __init__(self, stimulation_map: StimulationMap) -> None:
        self._named = {primitive.attribute for primitive in stimulation_map.primitives.values()}
        for behavior in stimulation_map.behaviors.values():
            parts = (behavior.aim, behavior.pid)
            self._named |= {part.attribute for part in parts if part is not None}
        self._first, self._room, self._count = 0, 1, 0

    def choose(self, facts: DriveFacts, room: int) -> list[int]:
        """Return the indices of the attributes to show, of which so many have room."""
        attributes = facts.attributes
        self._count, self._room = len(attributes), max(room, 1)
        self._first = max(0, min(self._first, self._count - self._room))

        def rank(index: int) -> tuple[bool, bool, int]:
            one = attributes[index]
            return is_force_unit(one.unit), one.name not in self._named, index

        ranked = sorted(range(self._count), key=rank)
        return sorted(ranked[self._first : self._first + max(room, 0)])

    def scroll(self, change: int) -> bool:
        """Scroll by so many attributes, as far as there are any; return whether others are shown now."""
        before = self._first
        self._first = max(0, min(before + change, self._count - self._room))
        return self._first != before

    def scroll_page(self, direction: int) -> bool:
        """Scroll by as many attributes as are shown."""
        return self.scroll(direction * self._room)

    @property
    def hidden_count(self) -> int:
        """Number of attributes that are not shown."""
        return max(0, self._count - self._room)
