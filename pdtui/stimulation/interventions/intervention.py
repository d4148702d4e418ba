"""Interventions: what a behavior does to hidden units besides overwriting them by constants, as data."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Floats
from pdtui.stimulation.interventions.gait_clock import GaitMark

InterventionKind = Literal["overwrite", "add", "scale", "clamp", "direction", "affine", "imprint"]


@dataclass(frozen=True, eq=False)
class LayerVectors:
    """Named vectors in the space of one layer's outputs.

    Attributes:
        name: Name by which interventions of the map refer to them.
        layer: Number or name of the layer.
        rows: The k vectors, shape (k, n) for a layer of n units, float32.
    """

    name: str
    layer: str
    rows: NDArray[np.float32] = field(repr=False)


@dataclass(frozen=True)
class PhaseGate:
    """A factor that depends on the phase of the gait.

    Attributes:
        mark: What begins a cycle of the gait.
        factors: Factors at equal distances over the cycle, the first at its beginning; linear in between.
    """

    mark: GaitMark
    factors: tuple[float, ...]

    def factor(self, phase: float | None) -> float:
        """Return the factor at a phase in [0, 1); 0 while the phase is unknown."""
        if phase is None:
            return 0.0
        place = phase * len(self.factors)
        low = int(place) % len(self.factors)
        high, share = (low + 1) % len(self.factors), place - int(place)
        return (1.0 - share) * self.factors[low] + share * self.factors[high]


@dataclass(frozen=True)
class RangeGate:
    """A factor of 1 while an attribute is within a range, else 0."""

    attribute: str
    low: float
    high: float

    def factor(self, value: float) -> float:
        """Return the factor at a value of the attribute."""
        return float(self.low <= value <= self.high)


@dataclass(frozen=True)
class TimeGate:
    """A factor that depends on the time since the behavior began.

    Attributes:
        times: When each factor begins to hold, s, increasing from 0.
        factors: The factors.
        repeat: Time after which the table begins again, s; None holds the last factor.
        interpolate: Whether the factor changes linearly from one time to the next, instead of in steps.
    """

    times: tuple[float, ...]
    factors: tuple[float, ...]
    repeat: float | None = None
    interpolate: bool = False

    def factor(self, seconds: float) -> float:
        """Return the factor at a time since the behavior began."""
        # Half a microsecond, so that rounding does not move a change of the factor by a control step.
        seconds += 5e-7
        if self.repeat is not None:
            seconds %= self.repeat
        if self.interpolate:
            return float(np.interp(seconds, self.times, self.factors))
        return self.factors[int(np.searchsorted(self.times, seconds, side="right")) - 1]


@dataclass(frozen=True)
class Onset:
    """When an armed behavior begins.

    Attributes:
        mark: The moment in the gait from which the delay counts.
        delay: Time after the mark, s.
    """

    mark: GaitMark
    delay: float = 0.0


@dataclass(frozen=True)
class Intervention:
    """One change of what hidden units put out. With h for their outputs and f for the behavior's strength:

    =========  =============================================================================================
    overwrite  h ← base + f · values, the paper's stimulation
    add        h ← h + f · values
    scale      h ← h · (1 + f · (values − 1))
    clamp      h ← h, limited to values (a low and a high end) while f is not 0
    direction  h ← h + U(f · α − Uᵀh) where it sets coordinates, or h + f · Uα where it adds to them
    affine     h ← h + f · (W(Vᵀh) + b), the closed-loop edit of CLAE (arXiv 2606.11489)
    imprint    h ← what the units would put out for an observation with edits of sizes
               base + f · (values + rates · t), t seconds after the behavior began
    =========  =============================================================================================

    A strength of 0 leaves the units alone. It is the product of the operator's factor, the output of the
    controller in mode ``pid``, and the gates.

    Attributes:
        kind: What it does.
        values: Numbers by unit address; for an imprint, sizes of edits by their names.
        base: Constants by unit address, or by the edit's name.
        rates: Growth per second of the sizes of edits, by their names, for an imprint.
        ranges: Low and high end by unit address, for a clamp.
        units: Addresses of the units that an imprint patches; ``0:*`` stands for a whole layer.
        vectors: U of a direction, or W of an affine edit, by name.
        readout: V of an affine edit, by name.
        bias: b of an affine edit, by name; empty for none.
        coordinates: α of a direction, one for each vector.
        sets_coordinates: Whether a direction sets coordinates; otherwise it adds to them.
        phase_gate, range_gate, time_gate: What the strength depends on besides; None for nothing.
    """

    kind: InterventionKind
    values: dict[str, float] = field(default_factory=dict)
    base: dict[str, float] = field(default_factory=dict)
    rates: dict[str, float] = field(default_factory=dict)
    ranges: dict[str, tuple[float, float]] = field(default_factory=dict)
    units: tuple[str, ...] = ()
    vectors: str = ""
    readout: str = ""
    bias: str = ""
    coordinates: tuple[float, ...] = ()
    sets_coordinates: bool = False
    phase_gate: PhaseGate | None = None
    range_gate: RangeGate | None = None
    time_gate: TimeGate | None = None

    def marks(self) -> tuple[GaitMark, ...]:
        """Return the moments of the gait that must be tracked for it."""
        return () if self.phase_gate is None else (self.phase_gate.mark,)


def orthonormality_error(rows: Floats | NDArray[np.float32]) -> float:
    """Return the largest deviation of ``UᵀU`` from the identity, for vectors of shape (k, n)."""
    return float(np.abs(rows @ rows.T - np.eye(len(rows))).max(initial=0.0))
