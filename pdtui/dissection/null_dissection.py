"""Self-test of a dissection: the same choosing and judging where nothing is to be found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text
from scipy import stats
from torch import nn

from pdtui.core.attributes import Floats
from pdtui.core.console.text_tables import new_table
from pdtui.core.units import NO_STIMULATION
from pdtui.dissection.dissection_config import DissectionConfig, DissectionSettings
from pdtui.dissection.primitive_judging import measure_own_range
from pdtui.dissection.probe_starts import gather_probe_starts
from pdtui.policies.runtime.live_network import policy_from_network
from pdtui.probing.effect_probe import EffectProbe
from pdtui.probing.null_distributions import smallest_p_value
from pdtui.probing.null_resampling import NullResampler
from pdtui.probing.rollout_pool import RolloutPool
from pdtui.probing.unit_selection import sample_control_units
from pdtui.robots import open_robot
from pdtui.spectra.episode_monitor import MonitoredEpisode, monitor_episodes
from pdtui.spectra.matching import match_units
from pdtui.spectra.matching_presets import find_matching_preset


@dataclass(frozen=True)
class NullDraws:
    """How often a null was confirmed.

    Attributes:
        name: Which null.
        draws: Dissections that were drawn.
        with_any: Those in which anything was confirmed.
        pairs: Pairs of a unit and an attribute that were judged in all of them.
        confirmed: Pairs that were confirmed.
    """

    name: str
    draws: int
    with_any: int
    pairs: int
    confirmed: int

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the share of dissections with a confirmation (Clopper and Pearson)."""
        found = stats.binomtest(self.with_any, self.draws).proportion_ci()
        return float(found.low), float(found.high)


@dataclass(frozen=True)
class NullDissection:
    """What the self-test of a dissection found.

    Attributes:
        robot, policy: What was dissected.
        level: Share of false discoveries that a dissection accepts. As all are false here, it is the share of
            dissections that may confirm anything.
        smallest_p: The smallest p-value that a pair can have.
        nulls: How often each null was confirmed.
        rollouts: Roll-outs that it took.
    """

    robot: str
    policy: str
    level: float
    smallest_p: float
    nulls: tuple[NullDraws, ...]
    rollouts: int

    @property
    def passes(self) -> bool:
        """Whether no null is confirmed more often than stated, as far as so many draws can tell."""
        return all(one.interval[0] <= self.level for one in self.nulls)

    def as_dict(self) -> dict[str, Any]:
        """Return the form that ``--json`` prints."""
        return {
            "robot": self.robot,
            "policy": self.policy,
            "level": self.level,
            "smallest_p": self.smallest_p,
            "nulls": [
                {
                    "name": one.name,
                    "dissections": one.draws,
                    "with_a_confirmation": one.with_any,
                    "low": one.interval[0],
                    "high": one.interval[1],
                    "pairs": one.pairs,
                    "confirmed": one.confirmed,
                }
                for one in self.nulls
            ],
            "passes": self.passes,
            "rollouts": self.rollouts,
        }

    def table(self) -> RenderableType:
        """Return what the command prints."""
        table = new_table(
            f"Self-test of the dissection of {self.policy}: nothing is to be found",
            *("null", "dissections", "that confirm anything [95 %]", "pairs judged", "confirmed"),
        )
        for one in self.nulls:
            low, high = one.interval
            share = f"{one.with_any / one.draws:.1%} [{low:.1%}, {high:.1%}]"
            table.add_row(one.name, str(one.draws), share, str(one.pairs), str(one.confirmed))
        verdict = "no more is confirmed than stated" if self.passes else "MORE IS CONFIRMED THAN STATED"
        if self.smallest_p > self.level:
            verdict = f"too few starts or units to confirm anything (no p below {self.smallest_p:.2g})"
        return Group(table, Text(f"At the level of {self.level:g}: {verdict}. {self.rollouts} roll-outs."))


def count_false_confirmations(config: DissectionConfig, draws: int = 400) -> NullDissection:
    """Dissect a policy where nothing is to be found, and count what is confirmed.

    The settings for choosing and judging are those of the dissection: units, outputs, starts, level.

    Raises:
        PdtuiError: The robot or the policy cannot be had, or the policy falls too often to be dissected.
    """
    if isinstance(config.policy, nn.Module):
        with open_robot(config.robot) as world:
            policy = policy_from_network(config.policy, world.observation_space, world.action_space)
            return count_false_confirmations(replace(config, robot=world, policy=policy), draws)
    seed, settings, report = config.seed, config.settings, config.report
    preset = find_matching_preset(config.preset, config.preset_changes)
    with RolloutPool(config.robot, config.policy, config.workers, config.import_options) as pool:
        robot, network, prober = pool.robot, pool.policy, EffectProbe(pool)
        episodes = monitor_episodes(robot, network, range(seed, seed + config.episodes), settings.steps)
        matching = match_units(_shift_attributes(episodes), robot.attributes, preset)
        starts = gather_probe_starts(pool, settings, seed + 100)
        settings, units = starts.settings, range(network.units)
        both = (*starts.refine, *starts.judge)
        controls = sample_control_units(units, settings.controls, seed)
        own_range = measure_own_range(episodes)
        outputs = _all_outputs(controls, own_range, settings)
        probed = prober.measure_outputs(
            outputs,
            both,
            steps=settings.refine_steps,
            progress=None if report is None else lambda done, total: report("probe", done, total),
        )
        # More starts than the dissection has, so that draws repeat none too often.
        bank = prober.measure_plans(
            [NO_STIMULATION],
            (*both, *starts.screen, *starts.searches.search, *starts.searches.selection),
            steps=settings.refine_steps,
        )
        trials = NullResampler(
            matching, controls, own_range, len(starts.refine), settings.screen_values, settings.judge_keep,
            settings.level, probed, bank,
        )  # fmt: skip
        nulls = []
        draw_of = {"without effect": trials.draw_without_effect, "exchanged": trials.draw_exchanged}
        for name, draw in draw_of.items():
            rng, counts = np.random.default_rng(seed), []
            for number in range(draws):
                counts.append(draw(rng))
                if report is not None:
                    report(name, number + 1, draws)
            pairs, confirmed = np.array(counts).T
            nulls.append(
                NullDraws(name, draws, int((confirmed > 0).sum()), int(pairs.sum()), int(confirmed.sum()))
            )
        return NullDissection(
            robot.name,
            network.name,
            settings.level,
            smallest_p_value(len(starts.judge), len(controls) - 1),
            tuple(nulls),
            pool.rollouts,
        )


def _all_outputs(
    controls: Sequence[int], own_range: Floats, settings: DissectionSettings
) -> list[tuple[int, float]]:
    values = {*settings.refine_values, *(-value for value in settings.screen_values)} - {0.0}
    outputs = [(unit, value) for unit in controls for value in sorted(values)]
    return outputs + [(unit, float(end)) for unit in controls for end in own_range[unit]]


def _shift_attributes(episodes: Sequence[MonitoredEpisode]) -> list[MonitoredEpisode]:
    """Return episodes whose attributes are those of the next one, so that no unit matches what it caused."""
    shifted = []
    for one, other in zip(episodes, [*episodes[1:], *episodes[:1]], strict=True):
        steps = min(one.steps, other.steps)
        shifted.append(replace(one, activations=one.activations[:steps], attributes=other.attributes[:steps]))
    return shifted
