"""Observations of a session, which are not recorded: a replay computes them again."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.drive_events import group_events_by_step
from pdtui.core.errors import SessionError
from pdtui.driving.loop_builder import build_control_loop
from pdtui.driving.session_replay import config_from_session
from pdtui.policies.runtime.policy import PolicyStep
from pdtui.robots import open_robot
from pdtui.sessions.session_header import SessionHeader
from pdtui.sessions.streams.step_block_reader import read_step_blocks
from pdtui.stimulation.map_robot_options import map_robot

MOST_OBSERVED = 10_000
"""Largest number of numbers in an observation that becomes columns of a table."""


def replay_observations(
    header: SessionHeader, policy: str = ""
) -> Iterator[tuple[NDArray[np.int64], NDArray[Any]]]:
    """Run a session again, and yield what the policy observed, block by block.

    Args:
        header: the session.
        policy: the policy's weights, if they are no longer where the map says.

    Yields:
        The control steps of a block, shape (n,), and the observations before them, shape (n, O).

    Raises:
        SessionError: the drive does not repeat itself here, or its observations are too large.
        PdtuiError: the robot or the policy cannot be loaded.
    """
    config = config_from_session(header, str(header.path), policy)
    events = group_events_by_step(header.events)
    with open_robot(map_robot(config.stimulation_map, config.robot)) as world:
        size = int(np.prod(world.observation_space.shape or (0,)))
        if size > MOST_OBSERVED:
            raise SessionError(
                f"{header.path}: expected observations of at most {MOST_OBSERVED} numbers, found {size}"
            )
        loop = build_control_loop(config, world)
        act, seen = loop.act, list[NDArray[Any]]()

        def record_observation_and_act(observation: NDArray[Any], *others: Any) -> PolicyStep:
            seen.append(np.array(observation).reshape(-1))
            return act(observation, *others)

        loop.act = record_observation_and_act
        for block in read_step_blocks(header):
            digests = dict(zip(block.steps.tolist(), block.digests.tolist(), strict=True))
            rows = []
            for step in range(loop.step, int(block.steps[-1]) + 1):
                record = loop.advance(events.get(step, ()))
                if record.digest != digests.get(step, record.digest):
                    raise SessionError(
                        f"{header.path}: the observations cannot be computed again: here, the drive differs "
                        f"from step {step} on"
                    )
                if step in digests:
                    rows.append(seen[-1])
                seen.clear()
            yield block.steps, np.array(rows)
