"""The magnitude c of a stimulation `v = c ρ` from a PID controller."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

from simple_pid import PID

from pdtui.core.attributes import wrap_angle
from pdtui.core.errors import KeystrokeError
from pdtui.stimulation.stimulation_map import PidGains

GainName = Literal["kp", "ki", "kd", "limit"]


class PidMagnitude:
    """Computes the magnitude c from the error between a target and an attribute.

    Angles are unwrapped: the controller sees a heading that does not jump at ±π and a setpoint on the same
    turn, so its derivative term does not jump either.

    Args:
        gains: the gains and the limit of c.
        wraps: whether the attribute is an angle.
        dt: duration of a control step, s.
    """

    def __init__(self, gains: PidGains, wraps: bool, dt: float) -> None:
        self.gains, self._wraps, self._dt = gains, wraps, dt
        self._pid = PID(
            gains.kp, gains.ki, gains.kd, sample_time=None, output_limits=(-gains.limit, gains.limit)
        )
        self._continuous: float | None = None
        self.target = 0.0
        self.value = 0.0
        self.error = 0.0
        self.magnitude = 0.0

    def start(self, value: float, target: float | None = None) -> None:
        """Start holding a target, by default the present value."""
        self._pid.reset()
        self._continuous = value
        self.value = value
        self.target = value if target is None else target

    def set_target(self, target: float) -> None:
        """Move the target; an angle is wrapped."""
        self.target = wrap_angle(target) if self._wraps else target

    def set_gain(self, name: GainName, value: float) -> None:
        """Set a gain or the limit from now on; what the integral has summed up stays, within the limit.

        A limit that is not above 0 is a `KeystrokeError`.
        """
        if name == "limit" and value <= 0.0:
            raise KeystrokeError(f"limit: expected more than 0, found {value:g}")
        changed: dict[str, Any] = {name: value}
        self.gains = replace(self.gains, **changed)
        self._pid.tunings = self.gains.kp, self.gains.ki, self.gains.kd
        self._pid.output_limits = -self.gains.limit, self.gains.limit

    def update(self, value: float) -> float:
        """Return the magnitude c for the attribute's present value; call it once per control step."""
        self.value = value
        continuous = value if self._continuous is None else self._continuous
        if self._wraps:
            continuous += wrap_angle(value - continuous)
            self.error = wrap_angle(self.target - value)
        else:
            continuous = value
            self.error = self.target - value
        self._continuous = continuous
        self._pid.setpoint = continuous + self.error
        self.magnitude = float(self._pid(continuous, dt=self._dt) or 0.0)
        return self.magnitude
