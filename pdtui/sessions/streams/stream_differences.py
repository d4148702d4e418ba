"""Find the first value that differs between two runs, in any stream that a session records."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pdtui.core.units import format_unit
from pdtui.sessions.drive_info import DriveInfo
from pdtui.sessions.streams.ragged_differences import (
    find_behavior_difference,
    find_stimulation_difference,
    first_takeover_difference,
)
from pdtui.sessions.streams.step_block import StepBlock
from pdtui.sessions.streams.value_differences import StreamDifference, differing_values
from pdtui.sessions.viewer.link_shape_poses import VECTOR_LENGTHS, box_links, round_links


def find_first_stream_difference(
    here: StepBlock, recorded: StepBlock, info: DriveInfo, tolerance: float | None = None
) -> StreamDifference | None:
    """Return the first difference between the same control steps of two runs; None if there is none.

    Of several in the same step, it is that of the stream that precedes the others in the control loop.

    Args:
        here, recorded: the same steps of both.
        info: the drive, which names the columns.
        tolerance: None if every bit must be the same, where NaN equals NaN. Otherwise, what rounding affects
            may differ by this much, or by this share of a value beyond ±1; digests and attributes are then
            left out.
    """
    found = [one for one in _first_differences(here, recorded, info, tolerance) if one is not None]
    return min(found, key=lambda one: one.step, default=None)


def _first_differences(
    here: StepBlock, recorded: StepBlock, info: DriveInfo, tolerance: float | None
) -> Iterator[StreamDifference | None]:
    """Yield the first difference of each stream, in the order of the control loop."""

    def dense(
        name: str, a: NDArray[Any], b: NDArray[Any], label: Callable[[int], str], steps: NDArray[np.int64]
    ) -> StreamDifference | None:
        if a.shape != b.shape and len(a):
            return StreamDifference(int(steps[0]), name, "", f"{a.shape[1]} numbers", f"{b.shape[1]} numbers")
        wrong = differing_values(a, b, tolerance)
        if not wrong.any():
            return None
        row, column = divmod(int(wrong.argmax()), wrong.shape[1])
        values = a[row, column].item(), b[row, column].item()
        return StreamDifference(int(steps[row]), name, label(column), *values)

    def each_step(name: str, a: NDArray[Any], b: NDArray[Any]) -> StreamDifference | None:
        return dense(name, a[:, None], b[:, None], lambda _: "", here.steps)

    def unit(flat: int) -> str:
        return format_unit(flat, info.layers)

    yield each_step("episodes", here.episodes, recorded.episodes)
    yield find_behavior_difference(here, recorded, tolerance)
    yield find_stimulation_difference(here, recorded, unit, tolerance)
    if here.activations is not None and recorded.activations is not None:
        both = _same_precision(here.activations, recorded.activations)
        yield dense("activations", *both, unit, here.steps)
    yield first_takeover_difference(here, recorded, tolerance)
    yield dense("actions", here.actions, recorded.actions, str, here.steps)
    yield each_step("rewards", here.rewards, recorded.rewards)
    yield each_step("costs", here.costs, recorded.costs)
    if tolerance is None:
        names = [attribute.name for attribute in info.attributes]
        yield dense("attributes", here.attributes, recorded.attributes, names.__getitem__, here.steps)
    drawn, here_rows, recorded_rows = np.intersect1d(
        here.pose_steps, recorded.pose_steps, return_indices=True
    )
    for name in (name for name in here.poses if name in recorded.poses):
        yield dense(
            "poses",
            here.poses[name][here_rows].reshape(len(drawn), -1),
            recorded.poses[name][recorded_rows].reshape(len(drawn), -1),
            _pose_label(name, info),
            drawn,
        )
    yield _ending_difference(here, recorded)
    yield _outcome_difference(here, recorded)
    if tolerance is None:
        yield each_step("digests", here.digests, recorded.digests)


def _same_precision(a: NDArray[Any], b: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Round both to float16 if one of them was recorded so."""
    if a.dtype == b.dtype:
        return a, b
    with np.errstate(over="ignore"):
        return a.astype(np.float16), b.astype(np.float16)


def _ending_difference(here: StepBlock, recorded: StepBlock) -> StreamDifference | None:
    for step in sorted(here.endings.keys() | recorded.endings.keys()):
        texts = here.endings.get(step, "none"), recorded.endings.get(step, "none")
        if texts[0] != texts[1]:
            return StreamDifference(step, "endings", "", *texts)
    return None


def _outcome_difference(here: StepBlock, recorded: StepBlock) -> StreamDifference | None:
    """Compare the outcomes that were recorded: older sessions lack some of them."""
    for step, outcome in recorded.outcomes.items():
        found = here.outcomes.get(step, "none")
        if found != outcome and not (found == "none" and step in here.endings):
            return StreamDifference(step, "outcomes", "", str(found), str(outcome))
    return None


def _pose_label(name: str, info: DriveInfo) -> Callable[[int], str]:
    links = (round_links if name.startswith("Capsules") else box_links)(info.links)
    length = VECTOR_LENGTHS[name]
    axes = ("x", "y", "z") if length == 3 else ("qx", "qy", "qz", "qw")
    return lambda column: f"{links[column // length].name} {axes[column % length]}"
