"""`pdtui tune`: choose gains and limit of a behavior of mode ``pid`` by its step responses.

The search minimizes the integral of the absolute error over steps of the target, a common criterion for PID
tuning (Åström and Hägglund, "Advanced PID Control", 2006), plus a penalty for falls. The steps of an angle
are drawn anew for each seed, since the starts of a robot on flat ground hardly differ, and on every second
seed the limit is larger, since a search otherwise ends at gains with which the robot only just does not fall.
What it finds is compared with the map's gains and with the best proportional controller, found in the same
way, on seeds that no search saw; the best of the three is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

import numpy as np

from pdtui.core.attributes import Floats
from pdtui.core.cluster.ray_cluster import Workers
from pdtui.core.confidence_intervals import PairedRatio, paired_ratio
from pdtui.core.errors import MapError
from pdtui.core.outcome import is_failure
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.search.evolutionary_search import Deadline, SharedTimeBudget
from pdtui.search.gains.gain_search import GainSearch, TuningSettings
from pdtui.search.gains.tracking_drives import TrackingDriveJob, TrackingDriveResult, TrackingDriveRunner
from pdtui.search.gains.tracking_summary import TrackingSummary, choose_tracking_targets, summarize_tracking
from pdtui.stimulation.seed_ranges import require_search_seeds
from pdtui.stimulation.stimulation_map import Behavior, PidGains, StimulationMap

ANGLE_STEPS, FARTHEST_ANGLE = (0.2, 1.2), 1.5
"""Least and largest step of an angle's target, and its largest size, rad."""
_TARGETS = 7
MARGIN = 1.2
"""Factor of the limit on every second seed of the search."""
FALL = 2.0
"""Cost of each control step after a fall, in multiples of the targets' range."""
Progress = Callable[..., None]
GainsOrigin = Literal["map", "proportional", "found"]


@dataclass(frozen=True)
class GainsOnTrial:
    """One controller on seeds that no search saw.

    Attributes:
        pid: the controller.
        tracking: its figures; a drive counts until its end.
        ratio: its mean |error|, with failures penalized, over that of the controller that is kept, paired by
            seed; None for that one.
    """

    pid: PidGains
    tracking: TrackingSummary
    ratio: PairedRatio | None


@dataclass(frozen=True)
class TunedGains:
    """The result of tuning one behavior.

    Attributes:
        behavior: name of the behavior.
        trials: the map's controller, the best proportional one and the best one, on the same seeds.
        kept: which of them failed least, and had the least error among those.
        tried: number of controllers tried.
        ended_early: whether the search ran out of time.
    """

    behavior: str
    trials: dict[GainsOrigin, GainsOnTrial]
    kept: GainsOrigin
    tried: int
    ended_early: bool

    @property
    def better(self) -> bool:
        """Whether another controller than the map's is kept."""
        return self.kept != "map"

    @property
    def gains(self) -> PidGains:
        """The controller that is kept."""
        return self.trials[self.kept].pid

    @property
    def verdict(self) -> str:
        """The result in one or two sentences."""
        early = "; the search ran out of time" if self.ended_early else ""
        kept = {
            "map": "none is better than the map's, which remains",
            "proportional": "a proportional controller is the best",
            "found": "the best found is the best",
        }[self.kept]
        told = f"{self.tried} controllers tried; on seeds that the search did not see, {kept}{early}"
        paid = self.trials[self.kept].pid
        if self.kept != "map" and paid.ki == paid.kd == 0.0:
            return f"{told}. Integral and derivative did not pay."
        against = self.trials["proportional"].ratio
        if self.kept == "found" and against is not None and against.low <= 1.0 <= against.high:
            return f"{told}. That integral and derivative pay is within the noise."
        return told

    def as_dict(self) -> dict[str, Any]:
        """The form that ``--json`` prints."""
        return {**asdict(self), "better": self.better, "gains": asdict(self.gains)}


def tune_gains(
    config: DriveConfig | ControlLoop,
    names: Sequence[str],
    seeds: Sequence[int],
    *,
    settings: TuningSettings | None = None,
    workers: Workers = 1,
    progress: Progress | None = None,
) -> list[TunedGains]:
    """Choose gains and limits, one behavior after the other; without a time limit, in a repeatable way.

    Args:
        config: robot, map and policy, or a loop of them.
        names: names of behaviors of mode ``pid``; empty for all of the map.
        seeds: at least 2, none for judging; half for the search, half to compare what it found.
        settings: how much to do; None for the usual amount.
        workers: number of processes, or a cluster.
        progress: called with controllers tried, controllers in all, and a note.

    Raises:
        MapError: the map has no such behavior, or it is of another mode; fewer than 2 seeds.
        PdtuiError: a seed is reserved for judging; the robot or the policy cannot be loaded.
    """
    if len(seeds) < 2:
        raise MapError(f"expected at least 2 seeds, half of them to choose by, found {len(seeds)}")
    require_search_seeds(seeds, "tuning")
    settings = settings or TuningSettings()
    budget = SharedTimeBudget(settings.minutes)
    with TrackingDriveRunner(config, workers) as runner:
        behaviors = _find_pid_behaviors(runner.loop.map, names)
        results = []
        for number, behavior in enumerate(behaviors):
            left = 2 * (len(behaviors) - number)
            deadlines = budget.share(left), budget.share(left // 2)
            results.append(_tune_behavior(runner, behavior, seeds, settings, deadlines, progress))
        return results


def sample_angle_targets(seed: int) -> tuple[float, ...]:
    """Draw targets of an angle for one drive, rad: 0, and steps of `ANGLE_STEPS` either way."""
    rng, targets = np.random.default_rng(seed), [0.0]
    while len(targets) < _TARGETS:
        target = targets[-1] + rng.choice([-1.0, 1.0]) * rng.uniform(*ANGLE_STEPS)
        if abs(target) <= FARTHEST_ANGLE:
            targets.append(round(float(target), 2))
    return tuple(targets)


def _find_pid_behaviors(stimulation_map: StimulationMap, names: Sequence[str]) -> list[Behavior]:
    """Return the behaviors of mode ``pid`` with these names, or all of them if there are no names."""
    source, behaviors = stimulation_map.source, stimulation_map.behaviors
    of_mode = {name: behavior for name, behavior in behaviors.items() if behavior.pid is not None}
    known = f"of mode pid are: {', '.join(of_mode) or 'none'}"
    for name in names:
        if name not in behaviors:
            raise MapError(f"{source}: no behavior '{name}'; {known}")
        if name not in of_mode:
            raise MapError(f"{source}: behavior '{name}': expected mode pid, found fixed; {known}")
    if not of_mode:
        raise MapError(f"{source}: no behavior of mode pid, so there are no gains to choose")
    return [of_mode[name] for name in names or of_mode]


def _tune_behavior(
    runner: TrackingDriveRunner,
    behavior: Behavior,
    seeds: Sequence[int],
    settings: TuningSettings,
    deadlines: tuple[Deadline, Deadline],
    progress: Progress | None,
) -> TunedGains:
    assert behavior.pid is not None
    old, half = behavior.pid, len(seeds) // 2
    attribute = runner.attribute(old.attribute)
    if attribute.wraps:
        targets = {seed: sample_angle_targets(seed) for seed in seeds}
    else:
        targets = dict.fromkeys(seeds, choose_tracking_targets(runner, behavior, seeds[: min(3, half)]))
    spans = np.array([targets[seed] for seed in seeds[:half]])
    fall, step = FALL * float(np.ptp(spans)), float(np.abs(np.diff(spans)).mean())
    total = settings.points + settings.refinements
    best = [np.inf]

    def costs_of(pid: PidGains, on: Sequence[int]) -> list[float]:
        wider = replace(pid, limit=MARGIN * pid.limit)
        jobs = [
            TrackingDriveJob(old.attribute, behavior.name, seed, targets[seed], wider if seed % 2 else pid)
            for seed in on
        ]
        costs = [_cost(result, fall) for result in runner.run(jobs)]
        best[0] = min(best[0], float(np.mean(costs)))
        if progress is not None:
            progress(search.tried + 1, 2 * total + 2, f"{behavior.name}: {best[0]:.3g} {attribute.unit}")
        return costs

    search = GainSearch(old, step, seeds[:half], costs_of, settings)
    plain = [replace(old, ki=0.0, kd=0.0)] if old.kp else []
    proportional = search.run(plain, deadlines[0], proportional=True)
    found = search.run([old, proportional], deadlines[1])
    pids: dict[GainsOrigin, PidGains] = {"map": old, "proportional": proportional, "found": found}
    jobs = [
        TrackingDriveJob(old.attribute, behavior.name, seed, targets[seed], pid)
        for pid in pids.values()
        for seed in seeds[half:]
    ]
    driven, count = runner.run(jobs), len(seeds) - half
    results = {name: driven[row * count :][:count] for row, name in enumerate(pids)}
    costs = {name: np.array([_cost(one, fall) for one in each]) for name, each in results.items()}
    kept = min(
        pids,
        key=lambda name: (sum(is_failure(one.outcome) for one in results[name]), float(costs[name].mean())),
    )
    trials = {
        name: GainsOnTrial(
            pid,
            summarize_tracking(results[name], attribute.unit),
            None if pid == pids[kept] else paired_ratio(costs[name], costs[kept]),
        )
        for name, pid in pids.items()
    }
    return TunedGains(behavior.name, trials, kept, search.tried, search.ended_early)


def _cost(result: TrackingDriveResult, fall: float) -> float:
    """Return the mean |error|, where each step after a failure counts as `fall`."""
    errors: Floats = np.abs(result.errors)
    known = np.isfinite(errors)
    if known.any() and not is_failure(result.outcome):
        return float(errors[known].mean())
    return float(np.where(known, errors, fall).mean())
