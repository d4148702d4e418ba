"""Tasks: what counts as done, on made-up runs whose verdict is known, and on the shipped policies."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from pdtui.core.attributes import Attribute, Floats
from pdtui.core.errors import MapError
from pdtui.core.outcome import Outcome
from pdtui.core.units import Stimulation
from pdtui.policies.weights.policy_loading import load_policy
from pdtui.robots import make_robot
from pdtui.robots.task import Task, TaskRunTrace, TaskVerdict, find_task
from pdtui.robots.tasks.a1_tasks import A1_TASKS
from pdtui.robots.tasks.bipedal_walker_tasks import BIPEDAL_WALKER_TASKS
from pdtui.robots.walker import WALKER_TASKS
from pdtui.search.task_rollout import StimulationWithDuration, judge_stimulations

WALKER = ("vx", "right foot clearance", "left foot clearance")
BIPED = ("vx", "height", "pitch", "foot 1 contact", "foot 2 contact")
A1_FEET = tuple(f"{leg} contact" for leg in ("front right", "front left", "rear right", "rear left"))


def _trace(
    names: tuple[str, ...], walked: list[list[float]], values: Floats, *, fell: bool = False
) -> TaskRunTrace:
    return TaskRunTrace(
        [Attribute(name, "") for name in names], np.array(walked), values, Outcome.FELL if fell else None
    )


def _walker(vx: Floats, right: Floats, left: Floats, *, fell: bool = False) -> TaskRunTrace:
    return _trace(WALKER, [[4.0, 0.0, 0.0]] * 200, np.stack((vx, right, left), axis=1), fell=fell)


def _slow(after: float, *, steps: int = 300, fell: bool = False) -> TaskVerdict:
    vx = np.concatenate((np.full(90, 4.0), np.full(steps - 90, after)))
    trace = _walker(vx, np.zeros(steps), np.zeros(steps), fell=fell)
    return find_task("slow down", WALKER_TASKS, "walker").judge(trace)


def test_slow_is_under_a_quarter_of_the_speed_and_still_up() -> None:
    assert _slow(0.9).success
    assert _slow(-0.9).success
    assert not _slow(1.1).success
    assert not _slow(-1.1).success
    assert not _slow(0.0, steps=250, fell=True).success
    assert _slow(0.5).score > _slow(1.5).score > _slow(0.0, steps=250, fell=True).score


def _hop(right: Floats, left: Floats, vx: float = 2.0) -> TaskVerdict:
    return find_task("hop", WALKER_TASKS, "walker").judge(_walker(np.full(200, vx), right, left))


def test_a_hop_keeps_one_foot_up_in_one_stretch() -> None:
    up, down = np.full(200, 0.1), np.full(200, -0.001)
    bouncing = np.where(np.arange(200) % 20 < 5, -0.001, 0.1)
    assert _hop(up, bouncing).success
    assert _hop(bouncing, up).success
    assert not _hop(up, bouncing, vx=0.0).success
    # A runner's feet are each up for most of the time, but in turn.
    running = np.where(np.arange(200) % 40 < 6, -0.001, 0.1)
    verdict = _hop(running, np.roll(running, 20))
    assert not verdict.success
    assert verdict.figures["share of steps with one foot up"] > 0.8
    assert not _hop(down, down).success


def _biped(
    task: str, height: Floats, pitch: Floats, vx: Floats, *, fell: bool = False, airborne: int = 15
) -> TaskVerdict:
    """Both feet are off the ground for some steps, except that each touches it on its own before that."""
    steps = np.arange(len(vx))
    first, second = steps < 50, (steps >= 50 + airborne) | (steps == 20)
    values = np.stack((vx, height, pitch, first, second), axis=1)
    trace = _trace(BIPED, [[5.0, 2.0, 0.0, 1.0, 0.0]] * 80, values, fell=fell)
    return find_task(task, BIPEDAL_WALKER_TASKS, "bipedal_walker").judge(trace)


def test_a_jump_rises_half_a_meter_and_walks_on() -> None:
    flat, fast = np.zeros(200), np.full(200, 5.0)
    arc = 2.0 + 0.6 * np.sin(np.linspace(0.0, np.pi, 200))
    assert _biped("jump", arc, flat, fast).success
    assert not _biped("jump", 2.0 + (arc - 2.0) / 2, flat, fast).success
    assert not _biped("jump", arc, flat, fast, fell=True).success
    assert not _biped("jump", arc, flat, fast, airborne=14).success
    assert _biped("jump", arc, flat, fast, airborne=20).figures["in the air (s)"] == pytest.approx(0.4)
    assert not _biped("jump", arc, flat, np.linspace(5.0, 0.0, 200)).success


def test_a_flip_turns_forward() -> None:
    fast, height = np.full(200, 5.0), np.full(200, 2.0)
    over = np.linspace(0.0, 2 * np.pi, 200)
    landed = _biped("front flip", height, over, fast)
    assert landed.success
    assert landed.figures["turned (degrees)"] == pytest.approx(360.0)
    assert landed.figures["lands"] == 1.0
    fallen = _biped("front flip", height[:90], over[:190:2][:90] * 0.95, fast[:90], fell=True)
    assert fallen.figures["lands"] == 0.0
    assert not _biped("front flip", height, -over, fast).success
    assert not _biped("front flip", height, over, fast, airborne=14).success


def _a1(task: str, rate: float, speed: Floats, *, fell: bool = False, patter: int = 0) -> TaskVerdict:
    """With `patter`, one foot touches down each so many steps."""
    names = ("vx", "speed", "yaw", "pitch", *A1_FEET)
    steps = np.arange(len(speed))
    feet = np.ones((len(steps), 4))
    if patter:
        feet[steps % patter == 0, 0] = 0.0
    yaw = rate * 0.016 * steps
    values = np.column_stack((speed, np.abs(speed), yaw, np.zeros(len(steps)), feet))
    trace = _trace(names, [[2.0, 2.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]] * 90, values, fell=fell)
    return find_task(task, A1_TASKS, "a1").judge(trace)


def test_the_a1_turns_while_it_walks() -> None:
    walking = np.full(150, 1.5)
    assert _a1("left", 0.2, walking).success
    assert _a1("right", -0.2, walking).success
    assert _a1("left", 0.2, walking).figures["yaw rate (rad/s)"] == pytest.approx(0.2)
    assert not _a1("left", 0.1, walking).success
    assert not _a1("left", -0.2, walking).success
    assert not _a1("right", 0.2, walking).success
    assert not _a1("left", 0.2, np.full(150, 0.1)).success
    assert not _a1("left", 0.2, walking, fell=True).success
    assert _a1("left", 0.6, walking).score > _a1("left", 0.2, walking).score > 1.0


def test_the_a1_stops_on_its_feet_and_goes_faster() -> None:
    braking = np.concatenate((np.linspace(2.0, 0.05, 60), np.full(90, 0.05)))
    assert _a1("stop", 0.0, braking).success
    assert not _a1("stop", 0.0, braking, patter=5).success  # 12 touchdowns a second
    assert not _a1("stop", 0.0, braking + 0.06).success
    assert not _a1("stop", 0.0, braking[:100], fell=True).success
    assert not _a1("stop", 0.0, np.full(150, 0.4)).success
    assert _a1("forward", 0.0, np.full(150, 2.3)).success
    assert not _a1("forward", 0.0, np.full(150, 2.1)).success
    assert not _a1("forward", 0.0, np.full(150, 2.3), fell=True).success


def test_standing_up_is_walking_at_the_end() -> None:
    height, pitch = np.full(300, 2.0), np.zeros(300)
    assert _biped("stand up", height, pitch, np.linspace(0.0, 5.0, 300)).success
    assert not _biped("stand up", height, pitch, np.zeros(300)).success


def test_an_unknown_task_lists_the_robots_own() -> None:
    with pytest.raises(MapError, match="walker: no task 'fly'; available: slow down, stop and go, hop"):
        make_robot("walker").find_task("fly")
    with pytest.raises(MapError, match="ant: no task 'fly'; it has none"):
        make_robot("ant").find_task("fly")
    assert make_robot("ant").tasks == ()


@pytest.mark.parametrize("robot", ["walker", "bipedal_walker"])
def test_bursts_of_one_seed_begin_from_the_same_walk(robot: str) -> None:
    """Judged together or alone, a plan does the same; an empty one is the untouched policy."""
    world, policy = make_robot(robot), load_policy(robot, robot)
    task = world.tasks[0]
    plan = StimulationWithDuration(Stimulation.of({3: 5.0}), 20)
    together = judge_stimulations(
        world, policy, task, [StimulationWithDuration(), plan, StimulationWithDuration()], 5
    )
    assert together[0] == together[2]
    assert judge_stimulations(world, policy, task, [plan], 5) == [together[1]]
    assert together[0] != together[1]


def test_plans_in_lock_step_are_judged_as_one_by_one() -> None:
    """The judge sees the same walks, to rounding; a plan with a duration ends in the same step."""
    task = Task(
        name="walk",
        key="w",
        says="walks",
        wanted="nothing",
        walk=(10, 10),
        steps=25,
        judge=lambda trace: TaskVerdict(True, float(trace.values.sum()), {"steps": float(len(trace))}),
    )
    plans = [
        StimulationWithDuration(),
        StimulationWithDuration(Stimulation.of({3: 2.0})),
        StimulationWithDuration(Stimulation.of({3: 2.0}), 5),
        StimulationWithDuration(Stimulation.of({3: 2.0}), 6),
        StimulationWithDuration(Stimulation.of(dict.fromkeys(range(224), 5.0))),
    ]
    world, policy = make_robot("anymal"), load_policy("anymal", "anymal")
    alone, together = (judge_stimulations(world, policy, task, plans, 5, one) for one in (True, False))
    for one, other in zip(alone, together, strict=True):
        assert one.figures == other.figures
        assert other.score == pytest.approx(one.score, rel=1e-3)
    scores = [one.score for one in alone]
    assert min(abs(a - b) / abs(a) for a, b in itertools.combinations(scores, 2)) > 2e-3, scores
