"""`pdtui tune`: gains and limit of a behavior of mode ``pid``, by a search over real step responses.

What is minimised is the integral of the absolute error over steps of the target, a usual measure for tuning
PID controllers (e.g. Åström and Hägglund, "Advanced PID Control", 2006), with a penalty for falls. A Latin
hypercube is halved by measuring the better half on twice the seeds, as long as there are seeds; the best
point is refined by Nelder and Mead's simplex. What was found is compared with the map's gains on seeds that
the search did not see, and given up unless it is better there.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize

from pdtui.core.attributes import Floats
from pdtui.core.errors import MapError
from pdtui.drive.control_loop import ControlLoop
from pdtui.drive.drive_config import DriveConfig
from pdtui.search.gain_search_space import gains_from_point, point_from_gains, sample_gain_points
from pdtui.search.tracking_drives import TrackingDrive, TrackingDriveResult, TrackingDriveRunner
from pdtui.search.tracking_summary import TrackingSummary, choose_tracking_targets, summarise_tracking
from pdtui.stimulation.stimulation_map import Behavior, PidGains

STEPS_OF_ANGLE = (0.0, 0.4, 1.2, 0.3, -0.9, -0.5, 0.0, 0.9, 0.0)
"""Targets of the search, rad: steps of 0.4, 0.9 and 1.2 and some between them, both ways."""
FALL = 2.0
"""What each control step after a fall costs, in multiples of the targets' range."""
_FIRST_SEEDS = 2
Progress = Callable[..., None]


@dataclass(frozen=True)
class TuningSettings:
    """How much to search.

    Attributes:
        points: of the Latin hypercube.
        refinements: controllers that the simplex tries.
        minutes: the search ends, with the best so far, when these are over; None lets it finish.
    """

    points: int = 48
    refinements: int = 24
    minutes: float | None = None


@dataclass(frozen=True)
class TunedGains:
    """What tuning one behavior came to.

    Attributes:
        behavior: its name.
        old, new: the map's controller, and the best that was found.
        before, after: their figures on the seeds that the search did not see.
        better: whether the new one is better there: no more falls, and a lower cost.
        tried: controllers.
        ended_early: whether the minutes were over before the search was.
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
        """One sentence."""
        early = "; the minutes were over before the search was" if self.ended_early else ""
        what = "better than the map's" if self.better else "no better than the map's, which stay"
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
    """Choose gains and limits of behaviors, one after the other.

    Without `Effort.minutes` the result is a function of the other arguments.

    Args:
        config: robot, map and policy, or a loop of them.
        names: of behaviors of mode ``pid``; empty for all that the map has.
        seeds: half of them for the search, the others to judge what it found; at least 2.
        settings: how much to search.
        workers: processes.
        progress: called with controllers tried, controllers in all, and a note.

    Raises:
        MapError: the map has no such behavior, or one of another mode; fewer than 2 seeds.
        PdtuiError: robot or policy cannot be had.
    """
    if len(seeds) < 2:
        raise MapError(f"expected at least 2 seeds, half of them to judge by, found {len(seeds)}")
    deadline = None if settings.minutes is None else time.monotonic() + 60.0 * settings.minutes
    with TrackingDriveRunner(config, workers) as runner:
        behaviors = pid_behaviors(runner.loop.map.source, runner.loop.map.behaviors, names)
        results = []
        for number, behavior in enumerate(behaviors, start=1):
            share = None if deadline is None else _share(deadline, len(behaviors) - number + 1)
            results.append(_Search(runner, behavior, seeds, settings, share, progress).run())
        return results


def pid_behaviors(source: str, behaviors: Mapping[str, Behavior], names: Sequence[str]) -> list[Behavior]:
    """The behaviors of mode ``pid`` of these names, all for none.

    Raises:
        MapError: there is no such behavior, or none at all.
    """
    holding = {name: behavior for name, behavior in behaviors.items() if behavior.pid is not None}
    known = ", ".join(holding) or "none"
    for name in names:
        if name not in behaviors:
            raise MapError(f"{source}: no behavior '{name}'; of mode pid are: {known}")
        if name not in holding:
            raise MapError(
                f"{source}: behavior '{name}': expected mode pid, found fixed; of mode pid are: {known}"
            )
    if not holding:
        raise MapError(f"{source}: no behavior of mode pid, so there are no gains to choose")
    return [holding[name] for name in names or holding]


def _share(deadline: float, left: int) -> float:
    now = time.monotonic()
    return now + max(0.0, deadline - now) / left


class _TimeIsUp(Exception):  # noqa: N818 - it names what happened
    pass


class _Search:
    """For the controller of one behavior."""

    def __init__(
        self,
        runner: TrackingDriveRunner,
        behavior: Behavior,
        seeds: Sequence[int],
        settings: TuningSettings,
        deadline: float | None,
        progress: Progress | None,
    ) -> None:
        assert behavior.pid is not None
        self._runner, self._behavior, self._old = runner, behavior, behavior.pid
        self._search, self._judge = seeds[: len(seeds) // 2], seeds[len(seeds) // 2 :]
        self._settings, self._deadline, self._progress, self._seed = settings, deadline, progress, seeds[0]
        attribute = runner.attribute(self._old.attribute)
        self._unit = attribute.unit
        if attribute.wraps:
            self._targets: tuple[float, ...] = STEPS_OF_ANGLE
        else:
            self._targets = choose_tracking_targets(runner, behavior, self._search[:3])
        self._range = float(np.ptp(self._targets))
        self._step = float(np.abs(np.diff(self._targets)).mean())
        self._costs: dict[PidGains, list[float]] = {}

    def run(self) -> TunedGains:
        early = False
        try:
            self._refine(self._halve())
        except _TimeIsUp:
            early = True
        new = self._best()
        before, after = (self._drive(pid, self._judge) for pid in (self._old, new))
        falls = [sum(one.fell for one in followed) for followed in (before, after)]
        better = falls[1] <= falls[0] and sum(map(self._cost, after)) < sum(map(self._cost, before))
        figures = [summarise_tracking(followed, self._unit) for followed in (before, after)]
        return TunedGains(
            self._behavior.name, self._old, new, figures[0], figures[1], better, len(self._costs), early
        )

    def _best(self) -> PidGains:
        """Of the controllers that were measured on most seeds."""
        most = max(map(len, self._costs.values()))
        return min((pid for pid, costs in self._costs.items() if len(costs) == most), key=self._mean)

    def _mean(self, pid: PidGains) -> float:
        return float(np.mean(self._costs[pid]))

    def _halve(self) -> PidGains:
        """The best of the hypercube and the map's own: each round the better half, on twice the seeds."""
        points = sample_gain_points(self._settings.points, self._seed)
        left = list(dict.fromkeys([self._old, *(gains_from_point(p, self._old, self._step) for p in points)]))
        count = min(_FIRST_SEEDS, len(self._search))
        while True:
            costs = {pid: self._measure(pid, count) for pid in left}
            left.sort(key=costs.__getitem__)
            if count == len(self._search):
                return left[0]
            left = left[: max(2, len(left) // 2)]
            count = min(2 * count, len(self._search))

    def _refine(self, best: PidGains) -> None:
        """Nelder and Mead's simplex in the logarithms, from the best point, with the parts that it has."""
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
        """Cost of a controller on the first so many seeds of the search."""
        known = self._costs.get(pid, [])
        if len(known) < count:
            if self._costs and self._deadline is not None and time.monotonic() > self._deadline:
                raise _TimeIsUp
            new = self._drive(pid, self._search[len(known) : count])
            self._costs[pid] = known + [self._cost(followed) for followed in new]
            if self._progress is not None:
                note = f"{self._behavior.name}: best {self._mean(self._best()):.3g} {self._unit}"
                self._progress(len(self._costs), self._settings.points + self._settings.refinements + 1, note)
        return float(np.mean(self._costs[pid][:count]))

    def _drive(self, pid: PidGains, seeds: Sequence[int]) -> list[TrackingDriveResult]:
        name, targets = self._behavior.name, tuple(self._targets)
        return self._runner.run([TrackingDrive(pid.attribute, name, seed, targets, pid) for seed in seeds])

    def _cost(self, followed: TrackingDriveResult) -> float:
        """Mean |error|; after a fall, `FALL` times the targets' range."""
        errors = np.abs(followed.errors)
        return float(np.where(np.isfinite(errors), errors, FALL * self._range).mean())
