"""The plan of the matching study: what is measured, and how it is judged, written down beforehand."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pdtui.core.errors import StudyError
from pdtui.spectra.matching_presets import MatchingPreset, find_matching_preset
from pdtui.stimulation.seed_ranges import parse_seed_range, require_search_seeds

MATCHING_STUDY_PLAN = Path(__file__).with_name("matching_study_plan.toml")


@dataclass(frozen=True)
class StudiedPolicy:
    """One policy of the study: the recipe that `pdtui train` follows.

    Attributes:
        robot, algorithm, activation, layers, seed, steps: The options of `pdtui train`.
        imitation_rounds: Rounds in which it first imitates the shipped policy of its robot; 0 for a policy
            that is trained from random actions.
        shipped: Whether it is the shipped policy of its robot, which need not be trained.
    """

    robot: str
    algorithm: str
    activation: str
    layers: tuple[int, ...]
    seed: int
    steps: int
    imitation_rounds: int
    shipped: bool = False

    @property
    def kind(self) -> str:
        """How it came about."""
        if self.shipped:
            return "shipped"
        return "imitated a shipped policy first" if self.imitation_rounds else "trained from random actions"

    @property
    def training(self) -> str:
        """What trained it, in a few words."""
        algorithm = self.algorithm.upper()
        origin = f"imitation, then {algorithm}" if self.imitation_rounds else algorithm
        return f"{origin} (shipped)" if self.shipped else origin

    @property
    def setting(self) -> str:
        """What policies of different seeds have in common."""
        return f"{self.robot}-{self.algorithm}-{self.activation}-{'x'.join(map(str, self.layers))}"

    @property
    def name(self) -> str:
        """Name of its folder."""
        return f"{self.setting}-{self.seed}"

    def command(self, folder: str) -> str:
        """Return the command line that trains it below a folder; nothing for a shipped policy."""
        if self.shipped:
            return ""
        # SAC has no choice of an activation function.
        chosen = f" --activation {self.activation}" if self.algorithm == "ppo" else ""
        if self.imitation_rounds:
            chosen += f" --initial-policy {self.robot} --imitation-rounds {self.imitation_rounds}"
        return (
            f"pdtui train {self.robot} --algorithm {self.algorithm}{chosen} "
            f"--layers {','.join(map(str, self.layers))} --seed {self.seed} --steps {self.steps} "
            f"--folder {folder}/{self.name}"
        )


@dataclass(frozen=True)
class WalkingRule:
    """When a policy walks; one that does not is left out.

    Attributes:
        seeds, steps: Episodes without stimulation, and their control steps.
        most_failures: Largest share of them that may end in a failure.
        least_speed: Least mean net speed in m/s for each robot.
    """

    seeds: range
    steps: int
    most_failures: float
    least_speed: Mapping[str, float]


@dataclass(frozen=True)
class MatchingStudySettings:
    """How one policy is measured.

    Attributes:
        monitored: Seeds of the monitored episodes.
        monitored_steps: Most control steps of each.
        values: Outputs at which each unit is held; the dose.
        probed_steps: Control steps of a stimulated roll-out, the second half of which is measured.
        start_steps: Steps of a walk from which starts are drawn.
        choosing_starts, choosing_seed: Number of the starts on which probing chooses, and their first seed.
        held_out_starts, held_out_seed: The same for the starts that decide. Their number is even.
        reference_units: Units drawn at random; a unit is a hit if it is stronger than most of them.
        random_units: Further units drawn at random, which are compared with them.
        best: Number of the first matches that are measured.
        seed: Seed of the draws.
    """

    monitored: range
    monitored_steps: int
    values: tuple[float, ...]
    probed_steps: int
    start_steps: range
    choosing_starts: int
    choosing_seed: int
    held_out_starts: int
    held_out_seed: int
    reference_units: int
    random_units: int
    best: int
    seed: int


@dataclass(frozen=True)
class MatchingStudyPlan:
    """The whole plan.

    Attributes:
        text: The file's text, which the data carry along.
        policies: The policies that are wanted.
        walking: Which of them count.
        settings: How each is measured.
        variants: The ways to match by name: a preset with its changes.
        primary: Name of the variant that decides.
        quantile: Share of the reference units that a hit is stronger than.
        level: Level of all tests.
        enough: Hit rate of the first match from which the answer is yes.
        resamples: Draws of the bootstrap.
    """

    text: str
    policies: tuple[StudiedPolicy, ...]
    walking: WalkingRule
    settings: MatchingStudySettings
    variants: Mapping[str, MatchingPreset]
    primary: str
    quantile: float
    level: float
    enough: float
    resamples: int


def load_matching_study_plan(path: Path = MATCHING_STUDY_PLAN) -> MatchingStudyPlan:
    """Read a plan.

    Raises:
        StudyError: The file cannot be read, or is not a plan.
    """
    try:
        text = path.read_text()
    except (OSError, UnicodeDecodeError) as error:
        raise StudyError(f"{path}: expected the plan of a study: {error}") from error
    return parse_matching_study_plan(text, str(path))


def parse_matching_study_plan(text: str, source: str) -> MatchingStudyPlan:
    """Return the plan that a TOML text states; `source` names it in messages.

    Raises:
        StudyError: The text is not a plan.
        SeedError: A matched or choosing seed is one of those that judge.
    """
    try:
        data: dict[str, Any] = tomllib.loads(text)
        walking, monitoring, probing = data["walking"], data["monitoring"], data["probing"]
        matching, statistics = data["matching"], data["statistics"]
        variants = {
            f"{preset}, {name}": find_matching_preset(preset, changes)
            for preset in matching["presets"]
            for name, changes in matching["variants"].items()
        }
        plan = MatchingStudyPlan(
            text,
            tuple(one for row in data["policies"] for one in _policies_of_setting(**row)),
            WalkingRule(
                parse_seed_range(walking["seeds"]),
                walking["steps"],
                walking["most_failures"],
                walking["least_speed"],
            ),
            MatchingStudySettings(
                monitored=parse_seed_range(monitoring["seeds"]),
                monitored_steps=monitoring["steps"],
                values=tuple(probing["values"]),
                probed_steps=probing["steps"],
                start_steps=range(probing["earliest_start"], probing["latest_start"] + 1),
                **{name: probing[name] for name in _PROBING},
            ),
            variants,
            matching["primary"],
            **{name: statistics[name] for name in _STATISTICS},
        )
    except (tomllib.TOMLDecodeError, KeyError, TypeError, ValueError) as error:
        raise StudyError(f"{source}: expected the plan of a matching study: {error!r}") from error
    if plan.primary not in variants:
        raise StudyError(f"{source}: primary: expected one of {', '.join(variants)}, found '{plan.primary}'")
    if plan.settings.held_out_starts % 2:
        raise StudyError(f"{source}: held_out_starts: expected an even number, to compare halves")
    require_search_seeds(plan.settings.monitored, f"{source}: monitoring")
    require_search_seeds([plan.settings.choosing_seed], f"{source}: probing")
    return plan


_PROBING = (
    *("choosing_starts", "choosing_seed", "held_out_starts", "held_out_seed"),
    *("reference_units", "random_units", "best", "seed"),
)
_STATISTICS = ("quantile", "level", "enough", "resamples")


def _policies_of_setting(seeds: list[int], layers: list[int], **options: Any) -> list[StudiedPolicy]:
    return [StudiedPolicy(**options, layers=tuple(layers), seed=seed) for seed in seeds]
