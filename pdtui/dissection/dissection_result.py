"""Everything that a dissection found about one policy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pdtui.core.attributes import Attribute, Floats, column_of
from pdtui.core.units import format_unit
from pdtui.dissection.attribute_movers import AttributeMover
from pdtui.dissection.sample_episode import SampleEpisode
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions
from pdtui.probing.unit_effects import UnitEffects
from pdtui.robots.robot_goals import RobotGoals
from pdtui.search.behavior_search import BehaviorSearchResult
from pdtui.search.controller_search import ControllerSearchResult
from pdtui.spectra.matching import Discrepancies
from pdtui.spectra.matching_presets import MatchingPreset
from pdtui.spectra.phase_correlation import PhaseCorrelations
from pdtui.stimulation.map_reader import parse_map
from pdtui.stimulation.stimulation_map import StimulationMap


@dataclass(frozen=True)
class Dissection:
    """Everything that was found about one policy.

    Attributes:
        robot: name of the robot.
        policy: name or path as given.
        policy_hash: SHA-256 of the weights.
        layers: widths of the hidden layers.
        attributes: of the robot.
        goals: of the robot: what was looked for.
        dt: s per control step.
        preset: of the spectra.
        seed: everything random came from it.
        matching: discrepancies.
        phase: correlations.
        sample_episode: one monitored episode, of the units that match: what pictures show.
        screen: every unit, at a few values.
        refined: the best of them, the first matches and the controls, from other starts.
        controls: units drawn at random.
        spread: standard deviation of every attribute over the monitored steps, shape (J,).
        movable: columns of the attributes that up and down were looked for.
        attribute_movers: up and down for each attribute.
        behaviors: the best stimulation for each goal.
        controllers: the best controllers.
        rollouts, control_steps, minutes: what it took.
        import_options: what the weights file leaves open.
        shortened: a sentence on roll-outs shorter than asked for, because the policy falls; or empty.
    """

    robot: str
    policy: str
    policy_hash: str
    layers: tuple[int, ...]
    attributes: tuple[Attribute, ...]
    goals: RobotGoals
    dt: float
    preset: MatchingPreset
    seed: int
    matching: Discrepancies
    phase: PhaseCorrelations
    sample_episode: SampleEpisode
    screen: UnitEffects
    refined: UnitEffects
    controls: tuple[int, ...]
    spread: Floats
    movable: tuple[int, ...]
    attribute_movers: tuple[AttributeMover, ...]
    behaviors: tuple[BehaviorSearchResult, ...]
    controllers: tuple[ControllerSearchResult, ...]
    rollouts: int
    control_steps: int
    minutes: float
    import_options: ImportOptions = NO_OPTIONS
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
        ranked = self.matching.ranked_units(self.column(attribute))[:count]
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
        from pdtui.dissection.draft_map import draft_map  # which reads dissections

        return parse_map(draft_map(self), f"dissection of {self.policy}")

    def column(self, attribute: str) -> int:
        """Column of an attribute.

        Raises:
            RobotError: the robot has no such attribute.
        """
        return column_of(attribute, self.attributes, self.robot)
