"""`pdtui tune`: choose gains and limit of a behavior of mode ``pid`` by its step responses.

The search minimises the integral of the absolute error over steps of the target, a common criterion for PID
tuning (Åström and Hägglund, "Advanced PID Control", 2006), plus a penalty for falls. Points of a Latin
hypercube go through successive halving, which measures the better half on twice the seeds; the Nelder-Mead
method refines the best. The result replaces the map's gains only if it is better on seeds that the search did
not see.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import minimize

from pdtui.core.attributes import Floats
from pdtui.core.errors import MapError
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.search.evolutionary_search import Deadline, PlanScoringStage, SharedTimeBudget, select_plans
from pdtui.search.pid_gain_space import gains_from_point, point_from_gains, sample_gain_points
from pdtui.search.tracking_drives import TrackingDriveJob, TrackingDriveResult, TrackingDriveRunner
from pdtui.search.tracking_summary import TrackingSummary, choose_tracking_targets, summarise_tracking
from pdtui.stimulation.seed_ranges import require_search_seeds
from pdtui.stimulation.stimulation_map import Behavior, PidGains, StimulationMap

STEPS_OF_ANGLE: tuple[float, ...] = (0.0, 0.4, 1.2, 0.3, -0.9, -0.5, 0.0, 0.9, 0.0)
"""Targets of an angle, rad: steps of 0.3 to 1.2 in both directions."""
FALL = 2.0
"""Cost of each control step after a fall, in multiples of the targets' range."""
_FIRST_SEEDS = 2
"""Seeds of the first stage of successive halving."""
Progress = Callable[..., None]


@dataclass(frozen=True)
class TuningSettings:
    """How much tuning does.

    Attributes:
        points: points of the Latin hypercube.
        refinements: controllers that the Nelder-Mead method tries.
        minutes: time after which the search ends with the best controller so far; None for no limit.
    """

    points: int = 48
    refinements: int = 24
    minutes: float | None = None


@dataclass(frozen=True)
class TunedGains:
    """The result of tuning one behavior.

    Attributes:
        behavior: name of the behavior.
        old, new: the map's controller, and the best one of the search.
        before, after: their figures on seeds that the search did not see.
        better: whether the new one has a lower cost there, and no more falls.
        tried: number of controllers tried.
        ended_early: whether the search ran out of time.
    """

    behavior: str
    old: PidGains
    new: PidGains
    before: TrackingSummary
    after: TrackingSummary
    better: bool
    tried: int
    ended_early: bool

    @property
    def verdict(self) -> str:
        """The result in one sentence."""
        early = "; the search ran out of time" if self.ended_early else ""
        what = "better than the map's" if self.better else "no better than the map's, which remains"
        return (
            f"{self.tried} controllers tried; on seeds that the search did not see, the best is {what}{early}"
        )

    def as_dict(self) -> dict[str, Any]:
        """The form that ``--json`` prints."""
        return asdict(self)


def tune_gains(
    config: DriveConfig | ControlLoop,
    names: Sequence[str],
    seeds: Sequence[int],
    *,
    settings: TuningSettings = TuningSettings(),
    workers: int = 1,
    progress: Progress | None = None,
) -> list[TunedGains]:
    """Choose gains and limits, one behavior after the other; without a time limit, in a repeatable way.

    Args:
        config: robot, map and policy, or a loop of them.
        names: names of behaviors of mode ``pid``; empty for all of the map.
        seeds: at least 2, none for judging; half for the search, half to compare its result with the map's.
        settings: how much to do.
        workers: number of processes.
        progress: called with controllers tried, controllers in all, and a note.

    Raises:
        MapError: the map has no such behavior, or it is of another mode; fewer than 2 seeds.
        PdtuiError: a seed is reserved for judging; the robot or the policy cannot be loaded.
    """
    if len(seeds) < 2:
        raise MapError(f"expected at least 2 seeds, half of them to choose by, found {len(seeds)}")
    require_search_seeds(seeds, "tuning")
    budget = SharedTimeBudget(settings.minutes)
    with TrackingDriveRunner(config, workers) as runner:
        behaviors = _find_pid_behaviors(runner.loop.map, names)
        results = []
        for number, behavior in enumerate(behaviors):
            deadline = budget.share(len(behaviors) - number)
            results.append(_GainSearch(runner, behavior, seeds, settings, deadline, progress).run())
        return results


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


class _OutOfTimeError(Exception):
    """Ends a search early."""


class _GainSearch:
    """The search for one behavior's controller."""

    def __init__(
        self,
        runner: TrackingDriveRunner,
        behavior: Behavior,
        seeds: Sequence[int],
        settings: TuningSettings,
        deadline: Deadline,
        progress: Progress | None,
    ) -> None:
        assert behavior.pid is not None
        self._runner, self._behavior, self._old = runner, behavior, behavior.pid
        self._search, self._judge = seeds[: len(seeds) // 2], seeds[len(seeds) // 2 :]
        self._settings, self._deadline, self._progress, self._seed = settings, deadline, progress, seeds[0]
        attribute = runner.attribute(self._old.attribute)
        self._unit, self._targets = attribute.unit, STEPS_OF_ANGLE
        if not attribute.wraps:
            self._targets = choose_tracking_targets(runner, behavior, self._search[:3])
        self._range = float(np.ptp(self._targets))
        self._step = float(np.abs(np.diff(self._targets)).mean())
        self._costs: dict[PidGains, list[float]] = {}

    def run(self) -> TunedGains:
        early = False
        try:
            self._refine(self._select())
        except _OutOfTimeError:
            early = True
        new = self._best()
        before, after = (self._drive(pid, self._judge) for pid in (self._old, new))
        falls = [sum(one.fell for one in results) for results in (before, after)]
        better = falls[1] <= falls[0] and sum(map(self._cost, after)) < sum(map(self._cost, before))
        figures = [summarise_tracking(results, self._unit) for results in (before, after)]
        return TunedGains(
            self._behavior.name, self._old, new, figures[0], figures[1], better, len(self._costs), early
        )

    def _best(self) -> PidGains:
        """Return the best of the controllers that were measured on the most seeds."""
        most = max(map(len, self._costs.values()))
        measured = {pid: np.mean(costs) for pid, costs in self._costs.items() if len(costs) == most}
        return min(measured, key=measured.__getitem__)

    def _select(self) -> PidGains:
        """Return the best of the hypercube and the map's own; each stage keeps the better half."""
        points = sample_gain_points(self._settings.points, self._seed)
        drawn = (gains_from_point(point, self._old, self._step) for point in points)
        candidates = list(dict.fromkeys([self._old, *drawn]))
        ((_, best),) = select_plans(candidates, self._halving_stages(len(candidates)))
        return best

    def _halving_stages(self, left: int) -> Iterator[PlanScoringStage[PidGains]]:
        count = min(_FIRST_SEEDS, len(self._search))
        while count < len(self._search):
            left = max(2, left // 2)
            yield PlanScoringStage(partial(self._score, count=count), left)
            count = min(2 * count, len(self._search))
        yield PlanScoringStage(partial(self._score, count=count), 1)

    def _score(self, candidates: Sequence[PidGains], count: int) -> list[float]:
        return [-self._measure(pid, count) for pid in candidates]

    def _refine(self, best: PidGains) -> None:
        """Refine the best point in logarithms by the Nelder-Mead method, within the parts that it has."""
        start = point_from_gains(best, self._old, self._step)
        if start is None or not self._settings.refinements:
            return
        parts = np.isfinite(start)

        def cost(values: Floats) -> float:
            point = start.copy()
            point[parts] = values
            return self._measure(gains_from_point(point, self._old, self._step), len(self._search))

        simplex = np.vstack([start[parts], start[parts] + 0.5 * np.eye(int(parts.sum()))])
        minimize(
            cost,
            start[parts],
            method="Nelder-Mead",
            options={"maxfev": self._settings.refinements, "initial_simplex": simplex},
        )

    def _measure(self, pid: PidGains, count: int) -> float:
        """Return the cost of a controller on the first `count` seeds of the search."""
        known = self._costs.get(pid, [])
        if len(known) < count:
            if self._costs and self._deadline():
                raise _OutOfTimeError
            new = self._drive(pid, self._search[len(known) : count])
            self._costs[pid] = known + [self._cost(result) for result in new]
            if self._progress is not None:
                note = f"{self._behavior.name}: best {np.mean(self._costs[self._best()]):.3g} {self._unit}"
                self._progress(len(self._costs), self._settings.points + self._settings.refinements + 1, note)
        return float(np.mean(self._costs[pid][:count]))

    def _drive(self, pid: PidGains, seeds: Sequence[int]) -> list[TrackingDriveResult]:
        drive = partial(TrackingDriveJob, pid.attribute, self._behavior.name, targets=self._targets, pid=pid)
        return self._runner.run([drive(seed=seed) for seed in seeds])

    def _cost(self, result: TrackingDriveResult) -> float:
        """Return the mean |error|, where steps after a fall count as `FALL` times the targets' range."""
        errors = np.abs(result.errors)
        return float(np.where(np.isfinite(errors), errors, FALL * self._range).mean())
