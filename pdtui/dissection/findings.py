"""Everything that a dissection found about one policy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pdtui.dissection.combine import Found
from pdtui.dissection.excerpt import Excerpt
from pdtui.dissection.hold import Held
from pdtui.dissection.matching import Match
from pdtui.dissection.phase import Phase
from pdtui.dissection.probe import Sweep
from pdtui.dissection.spectrum import Preset
from pdtui.dissection.steer import Steered
from pdtui.policies.choices import NO_CHOICES, PolicyChoices
from pdtui.policies.units import format_unit
from pdtui.robots.types import Attribute, Floats, column_of
from pdtui.stimulation.mapfile import parse_map
from pdtui.stimulation.maps import StimulationMap


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
        excerpt: one monitored episode, of the units that match: what pictures show.
        screen: every unit, at a few values.
        refined: the best of them, the first matches and the controls, from other starts.
        controls: units drawn at random.
        spread: standard deviation of every attribute over the monitored steps, shape (J,).
        movable: columns of the attributes that up and down were looked for.
        steered: up and down for each attribute.
        behaviors: the best stimulation for each goal.
        holds: the best controllers.
        rollouts, control_steps, minutes: what it took.
        choices: what the weights file leaves open.
        shortened: a sentence on roll-outs shorter than asked for, because the policy falls; or empty.
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
    excerpt: Excerpt
    screen: Sweep
    refined: Sweep
    controls: tuple[int, ...]
    spread: Floats
    movable: tuple[int, ...]
    steered: tuple[Steered, ...]
    behaviors: tuple[Found, ...]
    holds: tuple[Held, ...]
    rollouts: int
    control_steps: int
    minutes: float
    choices: PolicyChoices = NO_CHOICES
    shortened: str = ""

    def __repr__(self) -> str:
        return (
            f"<Dissection of {self.policy} on {self.robot}: {sum(self.layers)} units, "
            f"{len(self.attributes)} attributes, {sum(one.reached for one in self.behaviors)} of "
            f"{len(self.behaviors)} behaviors reached; {self.rollouts} roll-outs, {self.minutes:.1f} min>"
        )

    def matches(self, attribute: str, count: int = 5) -> list[str]:
        """Addresses of the units whose spectrograms are nearest to an attribute's, the nearest first.

        Raises:
            RobotError: the robot has no such attribute.
        """
        ranked = self.matching.ranked(self.column(attribute))[:count]
        return [format_unit(int(unit), self.layers) for unit in ranked]

    def side_effects(self) -> dict[float, Floats]:
        """What the refined units do to every attribute, in parts of each attribute's usual spread.

        Returns:
            for each sign of the largest output at which every unit was screened, a matrix of the shape
            (refined units, J): means over the starts, of which one that left no number counts as no effect;
            NaN for an attribute that never varies.
        """
        largest = max(map(abs, self.screen.values))
        matrices = {}
        for value in (-largest, largest):
            if value in self.refined.values:
                effects = self.refined.effects[:, self.refined.values.index(value)]
                means = np.nan_to_num(effects).mean(axis=1)
                blank = np.full_like(means, np.nan)
                matrices[value] = np.divide(means, self.spread, out=blank, where=self.spread > 0)
        return matrices

    def to_map(self) -> StimulationMap:
        """The map that the measurements propose; its `text` is what a map's file holds."""
        from pdtui.dissection.propose import propose  # which reads dissections

        return parse_map(propose(self), f"dissection of {self.policy}")

    def column(self, attribute: str) -> int:
        """Column of an attribute.

        Raises:
            RobotError: the robot has no such attribute.
        """
        return column_of(attribute, self.attributes, self.robot)
