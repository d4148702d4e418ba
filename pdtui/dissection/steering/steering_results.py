"""What each way to steer does to each attribute."""

from __future__ import annotations

from dataclasses import dataclass

from pdtui.dissection.steering.linear_probes import LinearProbe
from pdtui.dissection.steering.steering_candidates import SteeringCandidate, SteeringMethod
from pdtui.stimulation.stimulation_map import MeasuredEffect


@dataclass(frozen=True)
class SteeringResult:
    """What one method does to one attribute in one direction, from starts that chose nothing.

    Attributes:
        sign: 1 for up, −1 for down.
        candidate: The source and the smallest dose that reach most of the method's largest effect.
        main: Change of the attribute, in its standard deviations.
        side: Largest change of any other attribute, in standard deviations of that one.
        largest_dose: Largest dose from this one on, of this source and sign, without a fall from a start that
            chose.
        p: P-value against flips of the signs, corrected for all results.
        p_random: P-value of the difference to the baseline, the best of a few units or directions drawn at
            random, corrected likewise; None for the baselines themselves.
        level: Share of false discoveries that is accepted.
    """

    column: int
    sign: int
    candidate: SteeringCandidate
    measured: MeasuredEffect
    main: float
    side: float
    largest_dose: float
    p: float
    p_random: float | None
    level: float

    @property
    def method(self) -> SteeringMethod:
        """The method that it is of."""
        return self.candidate.method

    @property
    def is_significant(self) -> bool:
        """Whether it moves the attribute at all."""
        return self.p <= self.level

    @property
    def beats_baseline(self) -> bool:
        """Whether it moves the attribute more than its baseline does, if it has one."""
        return self.is_significant and (self.p_random is None or self.p_random <= self.level)


@dataclass(frozen=True)
class SteeringComparison:
    """All methods on all attributes that can be moved.

    Attributes:
        probes: The linear probes.
        results: What each method does; a method without a candidate that moves an attribute from every
            choosing start without a fall has none for it.
        columns: Columns of the attributes.
        tried: Number of candidates of each method.
        choosing, judging: Number of starts that chose, and that judged.
    """

    probes: tuple[LinearProbe, ...]
    results: tuple[SteeringResult, ...]
    columns: tuple[int, ...]
    tried: dict[SteeringMethod, int]
    choosing: int
    judging: int

    def probe_of(self, column: int) -> LinearProbe | None:
        """Return the linear probe of an attribute, if there is one."""
        return next((one for one in self.probes if one.column == column), None)

    def result_of(self, column: int, sign: int, method: SteeringMethod) -> SteeringResult | None:
        """Return what a method does to an attribute in a direction, if it has a candidate."""
        wanted = column, sign, method
        found = (one for one in self.results if (one.column, one.sign, one.method) == wanted)
        return next(found, None)
