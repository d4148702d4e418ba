"""What the screen is told of how episodes end."""

from __future__ import annotations

from pdtui.core.drive_events import DriveEvent
from pdtui.driving.drive_snapshot import DriveSnapshot
from pdtui.driving.snapshot_builder import SnapshotBuilder
from tests.obstacle_course import course_loop
from tests.road import road_loop


def _build(builder: SnapshotBuilder) -> DriveSnapshot:
    return builder.build_snapshot(paused=False, speed=1.0, achieved_speed=1.0, recorded_bytes=0, finished="")


def test_arrivals_and_cost_are_counted_as_the_drive_goes_on() -> None:
    loop = road_loop()
    builder = SnapshotBuilder(loop)
    assert (_build(builder).arrivals, _build(builder).cost) == (0, 0.0)
    for _ in range(40):
        builder.add_step(loop.advance())
    arrived = _build(builder)
    assert (arrived.arrivals, arrived.notice) == (1, "arrived at the destination")
    assert (arrived.statistics.episode, arrived.statistics.outcome) == (0, "arrived")
    for step in range(40, 50):
        braking = [DriveEvent(step, "behavior", "brake", key="b")] if step == 45 else []
        builder.add_step(loop.advance(braking))
    braked = _build(builder)
    assert (braked.arrivals, braked.cost, braked.involvement) == (1, 2.5, 1)


def test_a_robot_that_cannot_arrive_counts_no_arrivals() -> None:
    loop = course_loop()
    builder = SnapshotBuilder(loop)
    builder.add_step(loop.advance())
    assert _build(builder).arrivals is None
