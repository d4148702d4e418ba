"""Compare two sessions, stream by stream."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest

import numpy as np

from pdtui.core.drive_events import DriveEvent, describe_event
from pdtui.core.errors import SessionError
from pdtui.robots.options.robot_option import format_robot_options
from pdtui.sessions.environment_versions import version_differences
from pdtui.sessions.session_header import SessionHeader
from pdtui.sessions.streams.block_pairs import pair_blocks
from pdtui.sessions.streams.run_deviations import AttributeDeviation, RunDeviationCounter
from pdtui.sessions.streams.step_block_reader import read_step_blocks
from pdtui.sessions.streams.stream_differences import find_first_stream_difference
from pdtui.sessions.streams.value_differences import StreamDifference


@dataclass(frozen=True)
class SessionComparison:
    """The differences between two sessions.

    Attributes:
        steps: number of control steps that both have.
        lengths: number of control steps of each.
        first_difference: the first step in which any stream differs; None if none does.
        deviations: the attributes that deviate from that step on, those that deviate first at the top.
        first_event: the first event that differs, in words; empty if all are equal.
        circumstances: other differences: robot, seed, policy, map, versions.
        difference: the first value that differs, and where; None if none does.
    """

    steps: int
    lengths: tuple[int, int]
    first_difference: int | None
    deviations: tuple[AttributeDeviation, ...]
    first_event: str
    circumstances: tuple[str, ...]
    difference: StreamDifference | None = None


def compare_sessions(a: SessionHeader, b: SessionHeader) -> SessionComparison:
    """Find the first value that differs in any stream, and how much the attributes deviate from there on.

    The control steps are read from both files, of which a few blocks at a time are in memory. Steps that one
    of them lacks are left out, and so are activations and poses that one of them did not record.

    Raises:
        SessionError: a file is damaged or incomplete, or the robots have different attributes.
    """
    if a.info.attributes != b.info.attributes:
        why = "cannot be compared: their robots have different attributes"
        raise SessionError(f"{a.path} and {b.path}: {why}")
    counter = RunDeviationCounter(a.info.attributes)
    steps = end = 0
    first: StreamDifference | None = None
    blocks_a, blocks_b = (
        read_step_blocks(one, activations=a.info.layers == b.info.layers, poses=a.info.links == b.info.links)
        for one in (a, b)
    )
    for one, other in pair_blocks(blocks_a, blocks_b):
        counter.add_spread(one.attributes, other.attributes)
        steps, end = steps + len(one), int(one.steps[-1]) + 1
        start = 0
        if first is None:
            first = find_first_stream_difference(one, other, a.info)
            start = len(one) if first is None else int(np.searchsorted(one.steps, first.step))
        counter.add(one.steps[start:].tolist(), one.attributes[start:], other.attributes[start:])
    return SessionComparison(
        steps,
        (a.steps, b.steps),
        None if first is None else first.step,
        counter.summarize(),
        _describe_first_event(a.events, b.events, end),
        _list_circumstances(a, b),
        first,
    )


def _describe_first_event(a: Sequence[DriveEvent], b: Sequence[DriveEvent], steps: int) -> str:
    of_a, of_b = ([event for event in events if event.step < steps] for events in (a, b))
    for number, pair in enumerate(zip_longest(of_a, of_b)):
        if pair[0] != pair[1]:
            first, second = (
                "none" if event is None else f"{describe_event(event)} before step {event.step}"
                for event in pair
            )
            return f"event {number}: {first} in the first, {second} in the second"
    return ""


def _list_circumstances(a: SessionHeader, b: SessionHeader) -> tuple[str, ...]:
    lines = [
        f"{name}: {getattr(a.info, name)} and {getattr(b.info, name)}"
        for name in ("robot", "seed", "policy", "policy_hash", "stochastic", "start", "dt", "layers")
        if getattr(a.info, name) != getattr(b.info, name)
    ]
    if a.info.robot_options != b.info.robot_options:
        one, other = (format_robot_options(x.info.robot_options) or "none" for x in (a, b))
        lines.append(f"robot options: {one} and {other}")
    if a.info.map_text != b.info.map_text:
        lines.append("map: not the same text")
    if a.info.links != b.info.links:
        lines.append("links: not the same")
    different = version_differences(a.versions, b.versions)
    lines += [f"{name}: {there} and {here}" for name, there, here in different]
    return tuple(lines)
