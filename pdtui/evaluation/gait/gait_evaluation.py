"""`pdtui evaluate --gait`: how the policy alone walks, foot by foot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from pdtui.core.errors import RobotError
from pdtui.core.outcome import Outcome, OutcomeCounts, count_outcomes
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.core.robot_links_and_state import Link
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.headless_drive import run_episode
from pdtui.driving.loop_builder import build_control_loop
from pdtui.evaluation.gait.foot_metrics import undo_contact_delays
from pdtui.evaluation.gait.quadruped_gaits import average_lags, name_gait
from pdtui.evaluation.gait.walk_metrics import WalkMetrics, compute_walk_metrics, find_foot_links

WALKED_STEPS = 1000
"""Control steps of a walk that are measured."""
STEPS_BEFORE = 100
"""Control steps before them, after which every shipped robot walks steadily."""
SHORTEST_WALK = 2.0
"""Time after these for which a robot must stay up so that its walk counts, s."""


@dataclass(frozen=True)
class MeanWithDeviation:
    """The mean over walks, and their standard deviation; NaN where no walk has the figure."""

    mean: float
    deviation: float

    @classmethod
    def of(cls, values: Sequence[float]) -> MeanWithDeviation:
        """Return mean and standard deviation of the values that are not NaN."""
        known = np.array(values)[~np.isnan(values)]
        return cls(float(known.mean()), float(known.std())) if len(known) else cls(float("nan"), float("nan"))


@dataclass(frozen=True)
class FootMetricsSummary:
    """The figures of one foot over all walks; `FootMetrics` says what they are."""

    name: str
    touchdown_rate: MeanWithDeviation
    duty_factor: MeanWithDeviation
    clearance: MeanWithDeviation
    slip: MeanWithDeviation


@dataclass(frozen=True)
class GaitEvaluation:
    """How a policy walks.

    Attributes:
        contacts_by: Whether contacts are the simulator's or are estimated from the height of the sole.
        airborne: Share of the time with no foot on the ground.
        feet_down: Share of the time on 0, 1, … and all feet, means.
        alternation: Share of touchdowns that follow one of the other foot; None for other than two feet.
        gait: Name of the nearest gait of a quadruped; empty for other robots.
        lags: Mean phase lags of a quadruped's feet in the order of `quadruped_gaits.PLACES`.
        regularity: How regular they are, from 0 to 1.
        walks: The figures of each walk that lasted long enough.
    """

    robot: str
    policy: str
    seeds: tuple[int, ...]
    steps: int
    dt: float
    contacts_by: Literal["simulator", "height"]
    outcomes: OutcomeCounts
    feet: tuple[FootMetricsSummary, ...]
    airborne: MeanWithDeviation
    feet_down: tuple[float, ...]
    alternation: MeanWithDeviation | None
    gait: str
    lags: tuple[float, ...]
    regularity: float
    speed: MeanWithDeviation
    tilt: MeanWithDeviation
    walks: tuple[WalkMetrics, ...]


def evaluate_gait(
    config: DriveConfig | ControlLoop,
    seeds: Sequence[int],
    *,
    steps: int = WALKED_STEPS,
    progress: StepProgress | None = None,
) -> GaitEvaluation:
    """Let the policy walk once per seed and measure its gait.

    Walks begin at the start of `config`, or of a loop, whose seed is not used. The first 100 control steps
    are not measured, and a walk that ends within 2 s after them does not count.

    Raises:
        PdtuiError: The robot, policy or map cannot be loaded.
        RobotError: The robot does not say which of its links are feet, or no walk lasted long enough.
    """
    built = build_control_loop(config) if isinstance(config, DriveConfig) else config
    links, walks, outcomes = find_foot_links(built.robot), [], []
    for done, seed in enumerate(seeds, start=1):
        walk, outcome = _walk(built, links, seed, steps)
        outcomes.append(outcome)
        walks += [] if walk is None else [walk]
        if progress is not None:
            progress(done, len(seeds))
    if not walks:
        raise RobotError(f"{built.robot.name}: no walk of {len(seeds)} lasted {SHORTEST_WALK:g} s")
    return _summarize(built, tuple(seeds), steps, walks, count_outcomes(outcomes, built.robot.outcomes))


def _walk(
    built: ControlLoop, links: Sequence[Link], seed: int, steps: int
) -> tuple[WalkMetrics | None, Outcome]:
    """Walk once; return the figures, unless the walk was too short, and how it ended."""
    robot, poses, touching = built.robot, [], []
    loop = ControlLoop(robot, built.policy, built.map, seed, start=built.start)
    outcome = Outcome.OUT_OF_TIME
    for record in run_episode(loop, STEPS_BEFORE + steps):
        if record.step >= STEPS_BEFORE:
            poses.append(record.poses)
            touching.append(robot.read_foot_contacts())
        outcome = record.outcome or outcome
    if len(poses) * robot.control_dt < SHORTEST_WALK:
        return None, outcome
    told = [row for row in touching if row is not None]
    if len(told) < len(poses):
        return compute_walk_metrics(robot, links, np.array(poses), None), outcome
    contacts = undo_contact_delays(np.array(told), [foot.contact_delay for foot in robot.feet])
    return compute_walk_metrics(robot, links, np.array(poses)[: len(contacts)], contacts), outcome


def _summarize(
    built: ControlLoop, seeds: tuple[int, ...], steps: int, walks: list[WalkMetrics], outcomes: OutcomeCounts
) -> GaitEvaluation:
    robot, over = built.robot, MeanWithDeviation.of
    feet = []
    for index, foot in enumerate(robot.feet):
        own = [walk.feet[index] for walk in walks]
        names = ("touchdown_rate", "duty_factor", "clearance", "slip")
        feet.append(
            FootMetricsSummary(foot.name, *(over([getattr(one, name) for one in own]) for name in names))
        )
    strides = [walk.lags for walk in walks if walk.lags is not None]
    lags = average_lags(strides) if strides else None
    return GaitEvaluation(
        robot.name,
        built.policy.name,
        seeds,
        steps,
        robot.control_dt,
        "height" if robot.read_foot_contacts() is None else "simulator",
        outcomes,
        tuple(feet),
        over([walk.feet_down[0] for walk in walks]),
        tuple(np.mean([walk.feet_down for walk in walks], axis=0).tolist()),
        over([walk.alternation for walk in walks]) if len(robot.feet) == 2 else None,
        "" if lags is None else name_gait(lags),
        () if lags is None else lags.lags,
        float("nan") if lags is None else lags.regularity,
        over([walk.speed for walk in walks]),
        over([walk.tilt for walk in walks]),
        tuple(walks),
    )
