"""How a replay compares with its session."""

from __future__ import annotations

from dataclasses import dataclass

from pdtui.sessions.streams.run_deviations import AttributeDeviation
from pdtui.sessions.streams.step_numbers import describe_step_ranges
from pdtui.sessions.streams.value_differences import StreamDifference


@dataclass(frozen=True)
class ReplayResult:
    """How a replay compares with its session.

    Attributes:
        steps: control steps that were compared.
        first_difference: the first control step in which any recorded stream differs; None if none does.
        change: difference, in that step and in its unit, of the attribute that differs most.
        detail: the first difference in words.
        environment: how machine and versions differ from the session's.
        total: control steps of the session.
        dt: simulated time of a control step, s.
        deviations: how far each attribute is off from the first difference on, worst first.
        agreed: number of first control steps in which every attribute is within the tolerance.
        tolerance: in standard deviations of each attribute; None if every bit must be the same.
        judged: number of first control steps that must be within the tolerance.
        stopped: why the replay could not go on after it differed from the session; empty if it could.
        difference: the first value that differs, and where: step, stream and column; None if none does.
        damaged: whether the difference exceeds rounding although the simulator's state is the same, so that
            the recording must have been altered.
        beyond_rounding: the first value that differs by more than rounding can explain in the judged steps.
        description: what differs between robot and policy and the session's description of them, in words;
            if anything does, no step is run.
        missing: the control steps that the session lacks, as half-open ranges.
        left: recorded control steps that were not compared because the time was over.
    """

    steps: int
    first_difference: int | None
    change: float
    detail: str
    environment: tuple[str, ...]
    total: int = 0
    dt: float = 0.0
    deviations: tuple[AttributeDeviation, ...] = ()
    agreed: int = 0
    tolerance: float | None = None
    judged: int = 0
    stopped: str = ""
    difference: StreamDifference | None = None
    damaged: bool = False
    beyond_rounding: StreamDifference | None = None
    description: tuple[str, ...] = ()
    missing: tuple[tuple[int, int], ...] = ()
    left: int = 0

    @property
    def identical(self) -> bool:
        """Whether every bit of every recorded stream is the same in every step that was compared."""
        return self.first_difference is None and not self.description

    @property
    def passed(self) -> bool:
        """Whether the session repeats: bit for bit, or on another machine within the tolerance."""
        if self.identical or self.description:
            return self.identical
        within = self.tolerance is not None and self.agreed >= self.judged
        return within and self.beyond_rounding is None

    @property
    def verdict(self) -> str:
        """The result in one line."""
        return f"{self._verdict()}{self._missing_steps()}"

    def _verdict(self) -> str:
        if self.description:
            return f"differs: description: {'; '.join(self.description)}"
        if self.identical:
            said = f"identical: {self.steps} step{'' if self.steps == 1 else 's'}"
            return f"{said}; the time was over before the other {self.left}" if self.left else said
        where = f"step {self.first_difference} of {self.total}"
        if self.damaged or self.tolerance is None:
            return f"differs: {self._damage(where)}"
        kept = (
            f"{self.agreed} steps ({self.agreed * self.dt:g} s) are within {self.tolerance:g} of the spread"
        )
        if self.passed:
            return f"repeats within tolerance: bits differ from {where} on; the first {kept}"
        if self.agreed >= self.judged and self.beyond_rounding is not None:
            found = self.beyond_rounding
            return f"differs: step {found.step} of {self.total}: {found}, which is more than rounding"
        return f"differs: {where}: {self.detail}; the first {kept}, but {self.judged} have to be"

    def _damage(self, where: str) -> str:
        if not self.damaged:
            return f"{where}: {self.detail}"
        found = self.difference if self.tolerance is None else self.beyond_rounding
        step = where if found is None else f"step {found.step} of {self.total}"
        return f"{step}: {found}; the simulator's state is the same, so the recording is damaged"

    def _missing_steps(self) -> str:
        if not self.missing:
            return ""
        return f"; {self.steps} steps compared; the session lacks {describe_step_ranges(self.missing)}"
