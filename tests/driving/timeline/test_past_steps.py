"""The control steps that are kept of a run, and what is known of all."""

from __future__ import annotations

import pytest

from pdtui.core.drive_events import DriveEvent
from pdtui.core.errors import SessionError
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.snapshot_builder import SnapshotBuilder
from pdtui.driving.timeline.past_snapshot import show_past_moment
from pdtui.driving.timeline.past_steps import PastSteps
from pdtui.driving.timeline.run_timeline import RunTimeline
from pdtui.policies.runtime.policy import Policy
from pdtui.robots import make_robot
from pdtui.stimulation.stimulation_map import StimulationMap

EVENTS = {
    20: [DriveEvent(20, "behavior", "push", key="w")],
    75: [DriveEvent(75, "rewind", value=30.0, key="backspace")],
    85: [DriveEvent(85, "behavior", "twitch", key="t")],
}


@pytest.fixture(scope="module")
def driven(policy: Policy, small_map: StimulationMap) -> tuple[ControlLoop, RunTimeline, SnapshotBuilder]:
    """A drive of 100 steps with a rewind."""
    loop = ControlLoop(make_robot("ant"), policy, small_map, 3)
    timeline, builder = RunTimeline(), SnapshotBuilder(loop)
    while loop.step < 100:
        record = loop.advance(EVENTS.get(loop.step, ()))
        timeline.add_step(record)
        builder.add_step(record)
    return loop, timeline, builder


Drive = tuple[ControlLoop, RunTimeline, SnapshotBuilder]


def test_a_past_moment_is_shown_as_it_was_and_the_present_stays(driven: Drive) -> None:
    loop, timeline, builder = driven
    assert timeline.seek(30) == ""
    now = builder.build_snapshot(paused=True, speed=1.0, achieved_speed=0.0, recorded_bytes=0, finished="")
    then = show_past_moment(now, timeline)
    record = timeline.past.find(30).record
    assert (then.step, then.episode, record.step) == (30, 0, 29)
    assert then.time == pytest.approx(30 * loop.robot.control_dt)
    assert then.past == (100, 1)
    assert [view.name for view in then.active_behaviors] == ["push"]
    assert (then.attributes == record.attributes).all()
    assert (then.poses == record.poses).all()
    assert (then.activations == record.activations).all()
    assert {unit.unit for unit in then.stimulated_units} == {3, 23}
    assert len(then.history) == 100
    assert then.involvement == 1
    timeline.seek(100)
    assert timeline.viewed is None
    assert show_past_moment(now, timeline) is now


def test_what_lies_too_far_back_is_named(driven: Drive) -> None:
    _, timeline, _ = driven
    short = RunTimeline()
    short.past = PastSteps(most_bytes=20 * timeline.past.find(1).bytes)
    for moment in range(1, 101):
        short.add_step(timeline.past.find(moment).record)
    assert short.past.oldest == 81
    assert short.seek(5) == "step 81 is the oldest that can be looked at"
    assert short.viewed == 81
    assert short.past.find(81).record.step == 80
    assert len(short.past.digests) == 100


def test_a_stretch_does_not_reach_over_a_jump(driven: Drive) -> None:
    _, timeline, _ = driven
    assert [record.step for record in timeline.past.latest_stretch(100, 64)] == list(range(75, 100))
    assert [record.step for record in timeline.past.latest_stretch(60, 16)] == list(range(44, 60))
    assert PastSteps().latest_stretch(0, 16) == []


def test_a_branch_repeats_its_beginning_rewinds_included(driven: Drive) -> None:
    loop, timeline, _ = driven
    timeline.seek(90)
    branch = timeline.branch()
    timeline.seek(100)
    again = ControlLoop(loop.robot, loop.policy, loop.map, loop.seed)
    assert branch.runs_unpaced
    while branch.repeats:
        branch.add_step(again.advance(branch.next_events()))
    assert (branch.present, again.step, branch.runs_unpaced) == (90, 90, False)
    assert list(branch.past.digests) == list(timeline.past.digests[:90])
    assert [view.name for view in again.latch.active] == ["push", "twitch"]
    assert branch.next_events() == []


def test_a_beginning_that_does_not_repeat_itself_is_refused(driven: Drive) -> None:
    _, timeline, _ = driven
    timeline.seek(10)
    branch = timeline.branch()
    timeline.seek(100)
    record = timeline.past.find(1).record
    with pytest.raises(SessionError, match="step 0 came out differently when it was driven again"):
        branch.add_step(record._replace(digest=record.digest + 1))


def test_what_is_known_to_come_can_be_hurried_to() -> None:
    watched = RunTimeline(length=50)
    assert watched.seek(40) == ""
    assert (watched.goal, watched.runs_unpaced) == (40, True)
    watched.seek(400)
    assert watched.goal == 50
    drive = RunTimeline()
    drive.seek(40)
    assert not drive.runs_unpaced


def test_events_that_were_applied_at_once_are_part_of_the_step(
    policy: Policy, small_map: StimulationMap
) -> None:
    def drive(*, at_once: bool) -> list[tuple[int, tuple[DriveEvent, ...]]]:
        loop, found = ControlLoop(make_robot("ant"), policy, small_map, 3), []
        while loop.step < 100:
            events = EVENTS.get(loop.step, [])
            if at_once:
                loop.apply_events(events)
                if loop.step == 75:
                    assert [view.name for view in loop.latch.active] == ["push"]
            record = loop.advance(() if at_once else events)
            found.append((record.digest, record.events))
        return found

    assert drive(at_once=True) == drive(at_once=False)


def test_rewinding_twice_while_paused_goes_back_twice_as_far(
    policy: Policy, small_map: StimulationMap
) -> None:
    from pdtui.driving.keystrokes import interpret_key

    loop = ControlLoop(make_robot("ant"), policy, small_map, 3)
    places = []
    while loop.step < 150:
        places.append(loop.robot.read_poses()[0])
        loop.advance()
    targets = []
    for _ in range(2):
        event = interpret_key("backspace", loop)
        assert isinstance(event, DriveEvent)
        loop.apply_events([event])
        targets.append(int(event.value))
        assert (loop.robot.read_poses()[0] == places[targets[-1]]).all()
    assert targets == [90, 30]
    record = loop.advance()
    assert [event.value for event in record.events] == [90.0, 30.0]
