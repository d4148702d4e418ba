"""The result of a dissection, and the episode that it keeps for its pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pdtui.core.attributes import Attribute, Floats, attribute_column
from pdtui.core.units import format_unit
from pdtui.dissection.attribute_movers import AttributeMover
from pdtui.dissection.primitive_judging import PrimitiveJudgment
from pdtui.dissection.steering.steering_results import SteeringComparison
from pdtui.policies.weights.import_options import NO_OPTIONS, ImportOptions
from pdtui.probing.measured_effects import UnitEffects
from pdtui.robots.options.robot_option import RobotOptions
from pdtui.robots.robot_goals import RobotGoals
from pdtui.search.behavior_search import BehaviorSearchResult
from pdtui.search.controller_search import ControllerSearchResult
from pdtui.search.task_search import TaskSearchResult
from pdtui.spectra.episode_monitor import MonitoredEpisode
from pdtui.spectra.matching import UnitDiscrepancies
from pdtui.spectra.matching_presets import MatchingPreset
from pdtui.spectra.phase_correlation import PhaseCorrelations
from pdtui.spectra.spectrogram import scaled_activation_series, scaled_attribute_series, usable_episodes
from pdtui.stimulation.map_reader import parse_map
from pdtui.stimulation.stimulation_map import StimulationMap

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Dissection:
    """Everything that a dissection found about one policy.

    Attributes:
        robot: Name of the robot.
        policy: Name or path of the policy, as given.
        policy_hash: SHA-256 of the weights.
        layers: Widths of the hidden layers.
        attributes: Attributes of the robot.
        goals: Goals of the robot, which the searches were for.
        dt: Simulated time per control step, s.
        preset: Preset of the spectra.
        seed: Seed of every random choice.
        matching: Discrepancies of all units and attributes.
        phase: Phase correlations of all units and attributes.
        sample_episode: One monitored episode, with the units that match best, for pictures.
        screen: Effects of every unit at a few outputs.
        refined: Effects of the best units and the first matches, from other starts.
        judgment: Which of them are confirmed, from starts that neither saw.
        spread: Standard deviation of every attribute over the monitored steps, shape (J,).
        movable: Columns of the attributes for which up and down were searched.
        attribute_movers: What moves each attribute up and down.
        steering: What units, directions and imprints do to each attribute, side by side.
        behaviors: Best stimulation for each behavior goal.
        controllers: Best controllers of attributes.
        tasks: Best stimulation for each task that the robot's goals name.
        rollouts, control_steps, minutes: What the dissection took.
        import_options: Answers to what the weights file does not state.
        shortened: A sentence on roll-outs that were shortened because walks end early; empty if none was.
        robot_options: Options that the robot was built with.
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
    matching: UnitDiscrepancies
    phase: PhaseCorrelations
    sample_episode: SampleEpisode
    screen: UnitEffects
    refined: UnitEffects
    judgment: PrimitiveJudgment
    spread: Floats
    movable: tuple[int, ...]
    attribute_movers: tuple[AttributeMover, ...]
    steering: SteeringComparison
    behaviors: tuple[BehaviorSearchResult, ...]
    controllers: tuple[ControllerSearchResult, ...]
    tasks: tuple[TaskSearchResult, ...]
    rollouts: int
    control_steps: int
    minutes: float
    import_options: ImportOptions = NO_OPTIONS
    shortened: str = ""
    robot_options: RobotOptions = field(default_factory=dict)

    def __repr__(self) -> str:
        return (
            f"<Dissection of {self.policy} on {self.robot}: {sum(self.layers)} units, "
            f"{len(self.attributes)} attributes, {sum(one.reached for one in self.behaviors)} of "
            f"{len(self.behaviors)} behaviors reached; {self.rollouts} roll-outs, {self.minutes:.1f} min>"
        )

    def _repr_html_(self) -> str:
        """Show every pair that was judged, as a table that a click on a heading sorts, in a notebook."""
        from pdtui.dissection.dissection_summary import summarize_dissection
        from pdtui.notebook.dissection_display import dissection_html

        return dissection_html(repr(self).strip("<>"), summarize_dissection(self))

    def to_pandas(self) -> pd.DataFrame:
        """Return a data frame with a row for each pair of an attribute and a unit that was judged.

        Its columns are the fields of `pdtui dissect --json` for such a pair: the output v (``value``), the
        effect with its interval (``effect``, ``low``, ``high``) in the attribute's unit, falls, p-values, and
        whether the pair is confirmed.

        Raises:
            PdtuiError: pandas is not installed.
        """
        from pdtui.dissection.dissection_summary import summarize_dissection
        from pdtui.notebook.data_frames import make_data_frame
        from pdtui.notebook.dissection_display import list_judged_pairs

        return make_data_frame(list_judged_pairs(summarize_dissection(self)), "pair")

    def matches(self, attribute: str, count: int = 5) -> list[str]:
        """Return the addresses of the units whose spectrograms are nearest to an attribute's, nearest first.

        Raises:
            RobotError: The robot has no such attribute.
        """
        ranked = self.matching.ranked_units(self.column(attribute))[:count]
        return [format_unit(int(unit), self.layers) for unit in ranked]

    def side_effects(self) -> dict[float, Floats]:
        """Return what the refined units do to every attribute, in standard deviations of the attribute.

        Returns:
            For each sign of the largest output at which units were screened, a matrix of shape (refined
            units, J) of means over the starts. A start without a number counts as no effect; an attribute
            that never varies is NaN.
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
        """Return the map that the measurements propose; its `text` is what to write into a file."""
        from pdtui.dissection.draft_map import draft_map  # which reads dissections

        return parse_map(draft_map(self), f"dissection of {self.policy}")

    def column(self, attribute: str) -> int:
        """Return the column of an attribute; a `RobotError` says that there is none of that name."""
        return attribute_column(attribute, self.attributes, self.robot)


_MATCHES = 3
"""Units that the sample episode keeps for each attribute."""


@dataclass(frozen=True)
class SampleEpisode:
    """One monitored episode, with the activations of some units only.

    Attributes:
        seed: Seed of the reset.
        units: Flat indices of the units, ascending.
        activations: Activations of these units, shape (T, len(units)).
        attributes: Attributes in their units, with angles unwrapped, shape (T, J).
        compared_activations, compared_attributes: Both, at the scale at which the preset compares them.
    """

    seed: int
    units: tuple[int, ...]
    activations: NDArray[np.float32]
    attributes: Floats
    compared_activations: Floats
    compared_attributes: Floats

    def column(self, unit: int) -> int:
        """Return the column of one of the units that were kept, given by its flat index."""
        return self.units.index(unit)


def pick_sample_episode(
    episodes: Sequence[MonitoredEpisode],
    attributes: Sequence[Attribute],
    matching: UnitDiscrepancies,
    preset: MatchingPreset,
) -> SampleEpisode:
    """Return the first episode that matching used, with the units that match each attribute best."""
    nearest = (matching.ranked_units(column)[:_MATCHES] for column in range(len(matching.discrepancy)))
    units = sorted({int(unit) for few in nearest for unit in few})
    few = [replace(one, activations=one.activations[:, units]) for one in usable_episodes(episodes, preset)]
    compared = scaled_activation_series(few, slice(None), preset)[0] if units else few[0].activations
    return SampleEpisode(
        few[0].seed,
        tuple(units),
        few[0].activations,
        few[0].attributes,
        np.asarray(compared, np.float64),
        scaled_attribute_series(few, attributes, preset)[0],
    )
