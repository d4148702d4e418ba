"""Roll-outs with an intervention instead of fixed outputs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from hashlib import blake2b

from pdtui.core.attributes import Floats
from pdtui.core.units import Stimulation
from pdtui.policies.runtime.policy import Policy
from pdtui.robots.robot import Robot
from pdtui.stimulation.interventions.bound_intervention import bind_intervention
from pdtui.stimulation.interventions.intervention import Intervention, LayerVectors

ControlStepStimulation = Callable[[int, Floats], Stimulation]
"""Returns a control step's stimulation, given the steps since the start and the attributes, shape (J,)."""


@dataclass(frozen=True, eq=False, repr=False)
class InterventionRolloutPlan:
    """An intervention that acts at full strength from the start of a roll-out on. It has no phase gate.

    Attributes:
        intervention: The intervention.
        vectors: The vectors that it names.
    """

    intervention: Intervention
    vectors: tuple[LayerVectors, ...] = ()

    def __repr__(self) -> str:
        # Journals tell plans apart by this.
        digest = blake2b(digest_size=16)
        for one in self.vectors:
            digest.update(f"{one.name} {one.layer} {one.rows.shape}".encode() + one.rows.tobytes())
        return f"InterventionRolloutPlan({self.intervention!r}, {digest.hexdigest()})"

    def bind(self, robot: Robot, policy: Policy) -> ControlStepStimulation:
        """Return what it does at each control step.

        Raises:
            PdtuiError: It does not fit the robot or the policy.
        """
        bound = bind_intervention(
            self.intervention,
            policy.layers,
            {one.name: one for one in self.vectors},
            robot.observation_edits,
            robot.attributes,
            robot.control_dt,
            "roll-out",
        )
        return lambda step, values: Stimulation(edits=bound.make_edits(1.0, step, values, {}))
