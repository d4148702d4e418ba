"""The edits of hidden units of one layer in one control step; `Intervention` has their formulas."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.core.units import UnitEdit

Outputs = NDArray[np.float32]
EditObservation = Callable[[Floats], Floats]


class OverwriteUnits(UnitEdit):
    """Overwrites units by values, shape (n,)."""

    def __init__(self, units: NDArray[np.int64], values: NDArray[np.floating[Any]]) -> None:
        self.units, self._values = units, values

    def change(self, outputs: Outputs) -> NDArray[np.floating[Any]]:
        del outputs
        return self._values


class AddToUnits(UnitEdit):
    """Adds amounts, shape (n,)."""

    def __init__(self, units: NDArray[np.int64], amounts: NDArray[np.floating[Any]]) -> None:
        self.units, self._amounts = units, amounts

    def change(self, outputs: Outputs) -> NDArray[np.floating[Any]]:
        return outputs + self._amounts


class ScaleUnits(UnitEdit):
    """Multiplies by factors, shape (n,)."""

    def __init__(self, units: NDArray[np.int64], factors: NDArray[np.floating[Any]]) -> None:
        self.units, self._factors = units, factors

    def change(self, outputs: Outputs) -> NDArray[np.floating[Any]]:
        return outputs * self._factors


class ClampUnits(UnitEdit):
    """Limits units to ranges from `low` to `high`, shape (n,) each."""

    def __init__(self, units: NDArray[np.int64], low: Floats, high: Floats) -> None:
        self.units, self._low, self._high = units, low, high

    def change(self, outputs: Outputs) -> NDArray[np.floating[Any]]:
        return np.clip(outputs, self._low, self._high)


class SetCoordinates(UnitEdit):
    """Sets the coordinates α, shape (k,), along orthonormal vectors: ``h ← h + U(α − Uᵀh)``, rows (k, n)."""

    def __init__(self, units: NDArray[np.int64], rows: Outputs, coordinates: Floats) -> None:
        self.units, self._rows, self._coordinates = units, rows, coordinates

    def change(self, outputs: Outputs) -> NDArray[np.floating[Any]]:
        return outputs + (self._coordinates - self._rows @ outputs) @ self._rows


class AddAffine(UnitEdit):
    """Adds an affine function of low rank: ``h ← h + f (W(Vᵀh) + b)``, `write` and `read` of shape (r, n)."""

    def __init__(
        self, units: NDArray[np.int64], write: Outputs, read: Outputs, bias: Outputs, strength: float
    ) -> None:
        self.units, self._write, self._read = units, write, read
        self._bias, self._strength = bias, strength

    def change(self, outputs: Outputs) -> NDArray[np.floating[Any]]:
        return outputs + self._strength * ((self._read @ outputs) @ self._write + self._bias)


class ImprintUnits(UnitEdit):
    """Overwrites units by what they would put out for an edited observation."""

    def __init__(self, units: NDArray[np.int64], edit_observation: EditObservation) -> None:
        self.units, self.edit_observation = units, edit_observation

    def after_edits(self, earlier: Sequence[EditObservation]) -> ImprintUnits:
        """Return the imprint of an observation to which other edits come first."""

        def edit_observation(observation: Floats) -> Floats:
            for edit in (*earlier, self.edit_observation):
                observation = edit(observation)
            return observation

        return ImprintUnits(self.units, edit_observation) if earlier else self

    def change(self, outputs: Outputs) -> NDArray[np.floating[Any]]:
        raise AssertionError(f"an imprint of {len(outputs)} units is bound to an observation first")

    def prepare(
        self, observation: NDArray[Any], activations: Callable[[NDArray[Any], int], Outputs]
    ) -> UnitEdit:
        imprinted = activations(self.edit_observation(observation.astype(np.float64)), int(self.units[-1]))
        return OverwriteUnits(self.units, imprinted[self.units])
