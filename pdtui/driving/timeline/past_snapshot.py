"""The snapshot that shows a past moment of a run."""

from __future__ import annotations

from dataclasses import replace

from pdtui.driving.drive_snapshot import DriveSnapshot, PastPosition, StimulatedUnit
from pdtui.driving.timeline.run_timeline import RunTimeline
from pdtui.sessions.episode_statistics import NO_STATISTICS


def show_past_moment(snapshot: DriveSnapshot, timeline: RunTimeline) -> DriveSnapshot:
    """Return a snapshot of the present, with its picture exchanged for the moment that the timeline shows.

    What has come since the last snapshot (history, path, keys, endings) stays, as the screen keeps it.
    """
    if timeline.viewed is None:
        return snapshot
    record, involvement, arrivals, cost = timeline.past.find(timeline.viewed)
    units = zip(record.stimulation.units, record.natural, record.stimulation.values, strict=True)
    seconds_per_step = snapshot.time / max(1, snapshot.step)
    return replace(
        snapshot,
        step=timeline.viewed,
        time=timeline.viewed * seconds_per_step,
        episode=record.episode,
        active_behaviors=record.behaviors,
        stimulated_units=tuple(StimulatedUnit(*unit) for unit in units),
        activations=record.activations,
        attributes=record.attributes,
        poses=record.poses,
        traffic=record.traffic,
        scenery=record.scenery,
        involvement=involvement,
        arrivals=None if snapshot.arrivals is None else arrivals,
        cost=cost,
        statistics=NO_STATISTICS,
        manual=(),
        past=PastPosition(timeline.present, timeline.past.oldest),
    )
