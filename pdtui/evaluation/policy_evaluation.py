"""`pdtui evaluate --policy-only`: how the policy does by itself, over whole episodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pdtui.drive.control_loop import ControlLoop
from pdtui.drive.drive_config import DriveConfig
from pdtui.drive.headless_drive import run_episode
from pdtui.drive.loop_builder import build_loop


@dataclass(frozen=True)
class PolicyEvaluation:
    """The policy alone.

    Attributes:
        seeds: of the episodes.
        steps: control steps an episode.
        mean_speed: mean of |v| over all steps, m/s; None for a robot without the attribute ``speed``.
        net_speed: mean over episodes of the distance between start and end, over the time, m/s; None for a
            robot without a place.
        mean_return, std_return: of the episodes' sums of reward.
        finished: episodes without a fall.
    """

    seeds: tuple[int, ...]
    steps: int
    mean_speed: float | None
    net_speed: float | None
    mean_return: float
    std_return: float
    finished: int


def evaluate_policy(
    config: DriveConfig,
    seeds: Sequence[int],
    *,
    steps: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> PolicyEvaluation:
    """Drive the policy untouched, one episode a seed, as long as the robot's episodes are by default.

    Raises:
        PdtuiError: robot, policy or map cannot be had.
    """
    built = build_loop(config)
    steps = steps or built.robot.episode_steps
    names = [attribute.name for attribute in built.robot.attributes]
    column = names.index("speed") if "speed" in names else None
    speeds, net_speeds, returns, finished = [], [], [], 0
    for done, seed in enumerate(seeds, start=1):
        loop = ControlLoop(built.robot, built.policy, built.map, seed, start=config.start)
        total = 0.0
        start = loop.robot.read_poses()[:1, :2]
        for record in run_episode(loop, steps):
            total += record.reward
            if column is not None:
                speeds.append(float(record.attributes[column]))
            if record.finished:
                break
        seconds = loop.step * loop.robot.control_dt
        net_speeds += (np.linalg.norm(record.poses[:1, :2] - start, axis=1) / seconds).tolist()
        returns.append(total)
        finished += not record.ended
        if progress is not None:
            progress(done, len(seeds))
    return PolicyEvaluation(
        tuple(seeds),
        steps,
        float(np.mean(speeds)) if speeds else None,
        float(np.mean(net_speeds)) if net_speeds else None,
        float(np.mean(returns)),
        float(np.std(returns)),
        finished,
    )
