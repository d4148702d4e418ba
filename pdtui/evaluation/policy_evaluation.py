"""`pdtui evaluate --policy-only`: speed, return and outcomes of the policy alone, over whole episodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.core.outcome import Outcome, OutcomeCounts, count_outcomes
from pdtui.core.processes.worker_pool import StepProgress
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.headless_drive import run_episode
from pdtui.driving.loop_builder import build_control_loop


@dataclass(frozen=True)
class PolicyEvaluation:
    """The performance of a policy without stimulation.

    Attributes:
        mean_speed: mean of |v| over all steps, m/s; None for a robot without the attribute ``speed``.
        net_speed: distance between start and end over time, mean over episodes, m/s; None for a robot
            without poses.
        mean_return, std_return: mean and standard deviation of the episodes' returns.
        outcomes: how the episodes ended; those that lasted all steps are out of time.
    """

    seeds: tuple[int, ...]
    steps: int
    mean_speed: float | None
    net_speed: float | None
    mean_return: float
    std_return: float
    outcomes: OutcomeCounts


def evaluate_policy(
    config: DriveConfig | ControlLoop,
    seeds: Sequence[int],
    *,
    steps: int | None = None,
    progress: StepProgress | None = None,
) -> PolicyEvaluation:
    """Run the policy without stimulation for one episode per seed.

    Episodes begin at the start of `config`, or of a loop, whose seed is not used. They last the robot's usual
    number of control steps unless `steps` is given, and end before if the robot arrives.

    Raises:
        PdtuiError: the robot, policy or map cannot be loaded.
    """
    built = build_control_loop(config) if isinstance(config, DriveConfig) else config
    steps = steps or built.robot.episode_steps
    names = [attribute.name for attribute in built.robot.attributes]
    column = names.index("speed") if "speed" in names else None
    speeds, net_speeds, returns, outcomes = [], [], [], []
    for done, seed in enumerate(seeds, start=1):
        loop = ControlLoop(built.robot, built.policy, built.map, seed, start=built.start)
        total = 0.0
        start = loop.robot.read_poses()[:1, :2]
        for record in run_episode(loop, steps):
            total += record.reward
            if column is not None:
                speeds.append(float(record.attributes[column]))
            if record.outcome is not None:
                break
        seconds = loop.step * loop.robot.control_dt
        net_speeds += (np.linalg.norm(record.poses[:1, :2] - start, axis=1) / seconds).tolist()
        returns.append(total)
        outcomes.append(record.outcome or Outcome.OUT_OF_TIME)
        if progress is not None:
            progress(done, len(seeds))
    return PolicyEvaluation(
        tuple(seeds),
        steps,
        float(np.mean(speeds)) if speeds else None,
        float(np.mean(net_speeds)) if net_speeds else None,
        float(np.mean(returns)),
        float(np.std(returns)),
        count_outcomes(outcomes, built.robot.outcomes),
    )
