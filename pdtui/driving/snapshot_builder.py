"""Builds the snapshots that the screen draws."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pdtui.core.drive_events import DriveEvent, describe_event
from pdtui.core.outcome import Outcome
from pdtui.core.scenery import NO_SCENERY, Scenery
from pdtui.core.step_record import StepRecord
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_snapshot import DriveFacts, DriveSnapshot, EpisodeEnd, KeyPress, StimulatedUnit
from pdtui.driving.ghost.ghost_runner import GhostRunner
from pdtui.driving.unit_bench.natural_ranges import NaturalRangeTracker
from pdtui.driving.unit_bench.unit_searcher import UnitSearcher
from pdtui.sessions.episode_statistics import EpisodeStatisticsCounter

_LATCHING = ("behavior", "beside")
_ROWS_KEPT = 4000  # control steps between two snapshots that a stopped screen does not lose


def describe_loop(loop: ControlLoop) -> DriveFacts:
    """Return the facts of a drive that its loop knows."""
    return DriveFacts(
        title=loop.robot.full_title,
        policy=loop.policy.name,
        seed=loop.seed,
        dt=loop.robot.control_dt,
        attributes=loop.robot.attributes,
        links=loop.robot.links,
        layers=loop.policy.layers,
        manual_controls=tuple(control.name for control in loop.robot.manual_controls),
        policy_hash=loop.policy.sha256,
        output_bounds=loop.policy.output_bounds,
    )


class SnapshotBuilder:
    """Collects the steps since the last snapshot, so that skipped frames lose nothing.

    Args:
        loop: the drive.
        ghost: its ghost, if it can have one.
        searcher: its search for units, if it can have one.
    """

    def __init__(
        self, loop: ControlLoop, ghost: GhostRunner | None = None, searcher: UnitSearcher | None = None
    ) -> None:
        self._loop, self._ghost, self._searcher = loop, ghost, searcher
        self._rows = {name: row for row, name in enumerate(loop.map.behaviors)}
        self._history: list[np.ndarray] = []
        self._path: list[tuple[float, float, float]] = []
        self._key_presses: list[KeyPress] = []
        self._ends: list[EpisodeEnd] = []
        self._moved = False  # by an event, since the last control step
        self._restarted = False
        self._episode = 0
        self._involvement, self._cost = 0, 0.0
        self._arrivals = 0 if Outcome.ARRIVED in loop.robot.outcomes else None
        self._statistics = EpisodeStatisticsCounter(loop.info)
        self._scenery: Scenery = NO_SCENERY
        self._last: StepRecord | None = None
        self.natural = NaturalRangeTracker()
        self.notice = ""

    def add_step(self, record: StepRecord) -> None:
        """Add a control step."""
        is_new_run = record.episode != self._episode or any(event.jumps for event in record.events)
        if is_new_run:
            self._restarted, self._path = True, []
            self._episode = record.episode
        row = self._rows[record.behaviors[-1].name] if record.behaviors else -1
        self._history.append(record.attributes)
        if len(record.poses):
            self._path.append((float(record.poses[0, 0]), float(record.poses[0, 1]), float(row)))
        self._key_presses += [
            KeyPress(event.step, event.key, self._rows.get(event.name, -1) if event.kind in _LATCHING else -1)
            for event in record.events
            if event.key
        ]
        for rows in (self._history, self._path, self._key_presses, self._ends):
            del rows[:-_ROWS_KEPT]
        involved = record.involved
        self._involvement += involved
        self._cost += record.cost
        if record.outcome is Outcome.ARRIVED:
            self._arrivals = (self._arrivals or 0) + 1
        if record.outcome is not None:
            self._statistics.add_outcome(record.episode, record.outcome)
            self._ends.append(EpisodeEnd(record.step, record.outcome))
        self._statistics.add(
            record.episode, involved=involved, cost=record.cost, attributes=record.attributes
        )
        for event in record.events:
            if event.jumps or event.kind in ("takeover", "hand back"):
                self.notice = describe_event(event)
        if record.outcome is not None:
            self.notice = record.ended or f"{record.outcome}; the episode goes on"
        self.natural.add(record)
        self._last, self._moved = record, False
        if self._ghost is not None:
            self._ghost.add_step(record)

    def show_events(self, events: Sequence[DriveEvent]) -> None:
        """Show what events have changed before the next control step is done."""
        self._moved = self._moved or any(event.jumps for event in events)
        if events:
            self.notice = f"before step {events[0].step}: {'; '.join(map(describe_event, events))}"

    def show_other_scenery(self) -> None:
        """Send the scenery with the next snapshot, as the screen shows that of another moment."""
        self._scenery = NO_SCENERY

    def build_snapshot(
        self, *, paused: bool, speed: float, achieved_speed: float, recorded_bytes: int, finished: str
    ) -> DriveSnapshot:
        """Return the present state, with history and path since the last call."""
        loop, last = self._loop, self._last
        active = loop.latch.active
        units: tuple[StimulatedUnit, ...] = ()
        if last is not None and loop.latch.is_acting:
            stimulated = zip(last.stimulation.units, last.natural, last.stimulation.values, strict=True)
            units = tuple(StimulatedUnit(*view) for view in stimulated)
        size = len(loop.robot.attributes)
        other_scenery = loop.robot.scenery is not self._scenery
        self._scenery = loop.robot.scenery
        ghost = None if self._ghost is None else self._ghost.build_snapshot()
        if self._ghost is not None and self._ghost.notice:
            self.notice, self._ghost.notice = self._ghost.notice, ""
        snapshot = DriveSnapshot(
            step=loop.step,
            time=loop.step * loop.robot.control_dt,
            episode=loop.episode,
            active_behaviors=active,
            stimulated_units=units,
            activations=np.zeros(loop.policy.units, np.float32) if last is None else last.activations,
            attributes=loop.attributes,
            poses=last.poses if last is not None and not self._moved else loop.robot.read_poses(),
            history=np.array(self._history).reshape(-1, size),
            path=np.array(self._path).reshape(-1, 3),
            restarted=self._restarted,
            paused=paused,
            speed=speed,
            achieved_speed=achieved_speed,
            involvement=self._involvement,
            arrivals=self._arrivals,
            cost=self._cost,
            recorded_bytes=recorded_bytes,
            notice=self.notice,
            finished=finished,
            statistics=self._statistics.of(loop.episode),
            manual=tuple(loop.takeover.values.items()),
            scenery=self._scenery if other_scenery else None,
            traffic=last.traffic if last is not None and not self._moved else loop.robot.read_traffic(),
            key_presses=tuple(self._key_presses),
            ends=tuple(self._ends),
            ghost=ghost,
            stack=loop.latch.stack,
            held_units=tuple(loop.latch.held.outputs.items()),
            natural_ranges=self.natural.ranges,
            unit_search=None if self._searcher is None else self._searcher.state,
        )
        self._history, self._path, self._key_presses, self._ends = [], [], [], []
        self._restarted, self.notice = False, ""
        return snapshot
