"""Cuts a session into the episodes of a LeRobot dataset."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.sessions.export.lerobot.lerobot_features import LerobotFeature
from pdtui.sessions.session_header import SessionHeader
from pdtui.sessions.streams.step_block import StepBlock
from pdtui.sessions.streams.step_block_reader import read_step_blocks

ALONE = "the policy acts alone"
"""Task of the steps in which no behavior is active."""


@dataclass
class LerobotEpisode:
    """Consecutive control steps, each of which begins in the state in which the one before ended.

    Attributes:
        rows: values of each feature but those that only number the rows, by its name.
        tasks: the task of each step: the behaviors that were active.
    """

    rows: dict[str, NDArray[Any]]
    tasks: list[str]

    def __len__(self) -> int:
        return len(self.tasks)


def list_features(header: SessionHeader, observations: int) -> dict[str, LerobotFeature]:
    """Return the features of a session's steps; without observations (0), there are none of them."""
    info = header.info
    named = tuple(f"{one.name} ({one.unit})" if one.unit else one.name for one in info.attributes)
    features = {"next.attributes": LerobotFeature("float32", len(named), named)}
    if observations:
        features["observation.state"] = LerobotFeature("float32", observations)
    if info.activations != "off":
        features["activations"] = LerobotFeature("float32", sum(info.layers))
    return {**features, "next.reward": LerobotFeature("float32"), "next.done": LerobotFeature("bool")}


def read_lerobot_episodes(
    header: SessionHeader, observations: dict[int, NDArray[Any]] | None
) -> Iterator[LerobotEpisode]:
    """Yield the episodes of a session: they end where the session's own do, at rewinds and at gaps.

    Args:
        header: the session.
        observations: what the policy observed before each step; None to leave them out.
    """
    rewound = {event.step for event in header.events if event.kind == "rewind"}
    open_part: LerobotEpisode | None = None
    last = (-1, -1)
    for block in read_step_blocks(header, activations=header.info.activations != "off", block_steps=4096):
        part = _read_block(block, header, observations)
        begin = 0
        for row in range(len(block.steps)):
            step, episode = int(block.steps[row]), int(block.episodes[row])
            broken = step in rewound or last != (step - 1, episode)
            if broken and open_part is not None:
                _append(open_part, part, begin, row)
                if len(open_part):
                    yield open_part
            if broken or open_part is None:
                open_part, begin = LerobotEpisode({}, []), row
            last = (step, episode)
        if open_part is not None:
            _append(open_part, part, begin, len(block.steps))
    if open_part is not None and len(open_part):
        yield open_part


def _read_block(
    block: StepBlock, header: SessionHeader, observations: dict[int, NDArray[Any]] | None
) -> LerobotEpisode:
    steps = block.steps.tolist()
    rows = {
        "next.attributes": block.attributes.astype(np.float32),
        "action": block.actions_as_float32(),
        "next.reward": block.rewards.astype(np.float32),
        "next.done": np.array([step in block.endings for step in steps], np.bool_),
    }
    if header.info.activations != "off":
        assert block.activations is not None
        rows["activations"] = block.activations.astype(np.float32)
    if observations is not None:
        rows["observation.state"] = np.stack(
            [np.asarray(observations[step], np.float32).reshape(-1) for step in steps]
        )
    ends = np.cumsum(block.behavior_counts)
    names = list(block.behavior_names)
    tasks = [
        ", ".join(map(str, names[end - count : end])) or ALONE
        for end, count in zip(ends.tolist(), np.asarray(block.behavior_counts).tolist(), strict=True)
    ]
    return LerobotEpisode(rows, tasks)


def _append(whole: LerobotEpisode, part: LerobotEpisode, begin: int, end: int) -> None:
    if begin >= end:
        return
    for name, values in part.rows.items():
        before = whole.rows.get(name)
        added = values[begin:end]
        whole.rows[name] = added if before is None else np.concatenate([before, added])
    whole.tasks += part.tasks[begin:end]
