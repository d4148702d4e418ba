"""Control steps and events as columns: all that a reader needs, in few entities."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import chain
from typing import Any

import numpy as np
import pyarrow as pa
import rerun as rr
from numpy.typing import NDArray

from pdtui.core.drive_events import DriveEvent, describe_event
from pdtui.core.outcome import Outcome, is_failure
from pdtui.core.step_record import ActiveBehavior, StepRecord
from pdtui.sessions.session_schema import (
    ACTIVATIONS,
    ACTIVE_FIELDS,
    DIGEST_EPISODE,
    HALF_ACTIVATIONS,
    REWARD_COST_ACTION,
    ActivationsKept,
)
from pdtui.sessions.session_summary import SessionSummaryCounter
from pdtui.sessions.writer.arrow_columns import (
    ComponentColumn,
    nested_list_column,
    number_list_column,
    ragged_list_column,
    stack_rows,
    text_column,
)


def step_record_columns(
    records: Sequence[StepRecord], kept: ActivationsKept = "all"
) -> list[ComponentColumn]:
    """Return columns with one row per control step: a `StepRecord` except its events and poses.

    Behaviors, stimulation and takeover get no column if no step of the batch has any; `kept` decides about
    activations.
    """
    of: Any = StepRecord._make(zip(*records, strict=True))
    actions = stack_rows(of.action)
    gains = np.empty((len(records), 2 + actions.shape[1]))
    gains[:, 0], gains[:, 1], gains[:, 2:] = of.reward, of.cost, actions
    counters = np.empty((len(records), 2), np.int64)
    counters[:, 0], counters[:, 1] = of.digest, of.episode
    columns = [
        nested_list_column("attributes", stack_rows(of.attributes)),
        nested_list_column(REWARD_COST_ACTION, gains),
        number_list_column(DIGEST_EPISODE, counters),
    ]
    if kept != "off":
        activations = stack_rows(of.activations)
        columns.append(
            nested_list_column(HALF_ACTIVATIONS, _to_half(activations))
            if kept == "half"
            else nested_list_column(ACTIVATIONS, activations)
        )
    if any(stimulation.units for stimulation in of.stimulation):
        flat = [_flatten_stimulation(record) for record in records]
        columns.append(ragged_list_column("stimulation", flat, pa.float64()))
    if any(of.replaced):
        pairs = [list(chain.from_iterable(replaced)) for replaced in of.replaced]
        columns.append(ragged_list_column("takeover", pairs, pa.float64()))
    if any(of.behaviors):
        names = [[behavior.name for behavior in behaviors] for behaviors in of.behaviors]
        states = [
            [value for behavior in behaviors for value in _flatten_behavior(behavior)]
            for behaviors in of.behaviors
        ]
        columns += [
            ragged_list_column("behaviors", names, pa.utf8()),
            ragged_list_column("active", states, pa.float64()),
        ]
    return columns


def _to_half(activations: NDArray[np.float32]) -> NDArray[np.float16]:
    """Convert to float16; values beyond its range (±65504) become infinite, without a warning."""
    with np.errstate(over="ignore"):
        return activations.astype(np.float16)


def count_records(summary: SessionSummaryCounter, records: Sequence[StepRecord]) -> None:
    """Add control steps to the statistics of their session."""
    summary.add(
        attributes=stack_rows([record.attributes for record in records]),
        rewards=np.array([record.reward for record in records]),
        costs=np.array([record.cost for record in records]),
        episodes=np.array([record.episode for record in records]),
        involved=np.array([record.involved for record in records]),
        stimulated=np.array([bool(record.stimulation.units) for record in records]),
        taken_over=np.array([bool(record.replaced) for record in records]),
        outcomes=[(record.episode, record.outcome) for record in records if record.outcome is not None],
    )


def event_columns(events: Sequence[DriveEvent], first: int) -> list[ComponentColumn]:
    """Return columns with one row per event, in the order in which they were applied.

    `first` is the number of the first of them in the session.
    """
    numbers = np.arange(first, first + len(events), dtype=np.int64)
    return [
        text_column(rr.TextLog.descriptor_text(), [_log_line(event) for event in events]),
        text_column(rr.TextLog.descriptor_level(), ["INFO"] * len(events)),
        number_list_column("number", numbers),
        text_column("kind", [event.kind for event in events]),
        text_column("name", [event.name for event in events]),
        number_list_column("value", np.array([event.value for event in events], np.float64)),
        text_column("key", [event.key for event in events]),
    ]


def episode_end_columns(records: Sequence[StepRecord]) -> list[ComponentColumn]:
    """Return columns with one row per episode that ended by itself."""
    levels = [_log_level(record.outcome) for record in records]
    return [
        text_column(rr.TextLog.descriptor_text(), [record.ended for record in records]),
        text_column(rr.TextLog.descriptor_level(), levels),
    ]


def outcome_columns(outcomes: Mapping[int, Outcome], endings: Mapping[int, str]) -> list[ComponentColumn]:
    """Return columns with one row per outcome; the viewer reads of those that ended an episode elsewhere."""
    lines = [[] if step in endings else [f"{word}, and goes on"] for step, word in outcomes.items()]
    return [
        text_column("outcome", [outcome.value for outcome in outcomes.values()]),
        ragged_list_column(rr.TextLog.descriptor_text(), lines, pa.utf8()),
    ]


def _log_level(outcome: Outcome | None) -> str:
    return "ERROR" if outcome is Outcome.DIVERGED else "WARN" if is_failure(outcome) else "INFO"


def _log_line(event: DriveEvent) -> str:
    return f"[{event.key}] {describe_event(event)}" if event.key else describe_event(event)


def _flatten_stimulation(record: StepRecord) -> list[float]:
    stimulation = record.stimulation
    triples = zip(stimulation.units, stimulation.values, record.natural, strict=True)
    return [value for triple in triples for value in triple]


def _flatten_behavior(behavior: ActiveBehavior) -> list[float]:
    values = [getattr(behavior, field) for field in ACTIVE_FIELDS]
    return [math.nan if value is None else float(value) for value in values]
