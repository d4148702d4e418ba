"""Everything that a dissection found about one policy."""

from __future__ import annotations

from dataclasses import dataclass

from pdtui.dissection.combine import Found
from pdtui.dissection.hold import Held
from pdtui.dissection.matching import Match
from pdtui.dissection.phase import Phase
from pdtui.dissection.probe import Sweep
from pdtui.dissection.spectrum import Preset
from pdtui.dissection.steer import Steered
from pdtui.robots.types import Attribute, Floats, column_of


@dataclass(frozen=True)
class Dissection:
    """Everything that was found about one policy.

    Attributes:
        robot: name of the robot.
        policy: name or path as given.
        policy_hash: SHA-256 of the weights.
        layers: widths of the hidden layers.
        attributes: of the robot.
        dt: s per control step.
        preset: of the spectra.
        seed: everything random came from it.
        matching: discrepancies.
        phase: correlations.
        screen: every unit, at a few values.
        refined: the best of them, the first matches and the controls, from other starts.
        controls: units drawn at random.
        spread: standard deviation of every attribute over the monitored steps, shape (J,).
        steered: up and down for each attribute.
        behaviors: the best stimulation for each goal.
        holds: the best controllers.
        rollouts, control_steps, minutes: what it took.
    """

    robot: str
    policy: str
    policy_hash: str
    layers: tuple[int, ...]
    attributes: tuple[Attribute, ...]
    dt: float
    preset: Preset
    seed: int
    matching: Match
    phase: Phase
    screen: Sweep
    refined: Sweep
    controls: tuple[int, ...]
    spread: Floats
    steered: tuple[Steered, ...]
    behaviors: tuple[Found, ...]
    holds: tuple[Held, ...]
    rollouts: int
    control_steps: int
    minutes: float

    def column(self, attribute: str) -> int:
        """Column of an attribute.

        Raises:
            RobotError: the robot has no such attribute.
        """
        return column_of(attribute, self.attributes, self.robot)
