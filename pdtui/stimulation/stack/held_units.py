"""Single units that the operator holds at outputs by hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pdtui.core.errors import KeystrokeError, PolicyError
from pdtui.core.units import parse_unit


class HeldUnits:
    """The units that are held, and their outputs v.

    Args:
        layers: Widths of the policy's hidden layers.
    """

    def __init__(self, layers: Sequence[int]) -> None:
        self._layers = layers
        self.outputs: dict[int, float] = {}
        """The outputs by flat index, in the order in which the units were first held."""

    def hold(self, address: str, output: float) -> None:
        """Hold a unit, or one that is held at another output; `KeystrokeError` if there is no such unit."""
        self.outputs[self._find(address)] = output

    def free(self, address: str) -> None:
        """Let go of a unit; one that is not held is a `KeystrokeError`."""
        if self.outputs.pop(self._find(address), None) is None:
            raise KeystrokeError(f"unit {address} is not held")

    def replace(self, outputs: Mapping[int, float]) -> None:
        """Hold these units and no others."""
        self.outputs = dict(outputs)

    def _find(self, address: str) -> int:
        try:
            return parse_unit(address, self._layers)
        except PolicyError as error:
            raise KeystrokeError(str(error)) from error
