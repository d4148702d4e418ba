"""`pdtui evaluate a1 --experiment forest`: how far it gets alone, with an operator, and with eyes.

The paper's task transfer (section 4): a policy that feels only its own body is driven through trees that it
cannot sense. All conditions meet the same forests for the same time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from pdtui.errors import PdtuiError, PolicyError, SessionError
from pdtui.experiments.built import built_once, worker_pool
from pdtui.experiments.forest_results import Forest, summarise
from pdtui.experiments.forest_runs import (
    FOREST,
    ROUGH,
    ForestRun,
    drive_forest,
    operator_for,
    read_forest,
    record_forest,
    try_keys,
)
from pdtui.experiments.operator import operator_keys
from pdtui.experiments.steering import DrivenSteps, Response
from pdtui.experiments.steering_fit import fit_responses
from pdtui.policies.files import find_weights
from pdtui.robots import check_robot, file_stem
from pdtui.stimulation.maps import StimulationMap
from pdtui.teleop.drive import build_loop
from pdtui.teleop.loop import ControlLoop
from pdtui.teleop.order import DriveOrder

Condition = Literal["alone", "operator", "vision"]
CONDITIONS: dict[Condition, str] = {
    "alone": "state alone",
    "operator": "state with an operator",
    "vision": "state + vision",
}
PERSON = "state with a person"
STEPS, REPEATS = 2400, 5
"""The A1 needs some 1300 steps to the far end without a detour."""
TRIED_SEEDS, TRIED_STEPS = tuple(range(900, 908)), 900
"""Of the drives on rough ground from which the operator learns what its keys do."""


def evaluate_forest(
    order: DriveOrder,
    seeds: Sequence[int],
    *,
    conditions: Sequence[Condition] = tuple(CONDITIONS),
    sessions: Sequence[Path] = (),
    repeats: int = REPEATS,
    steps: int = STEPS,
    record: Path | None = None,
    tried: tuple[Sequence[int], int] = (TRIED_SEEDS, TRIED_STEPS),
    workers: int = 2,
    progress: Callable[[int, int], None] | None = None,
) -> Forest:
    """Measure conditions on the same forests, and score recorded drives.

    An episode ends at a fall or at the forest's far end; what it gathered up to then counts.

    Args:
        order: robot, map and policy; its seed and start are not used.
        seeds: of the forests; consecutive ones make a repeat.
        conditions: to be measured. Vision is left out where its robot or its policy is not there.
        sessions: a person's drives, each a repeat of one episode.
        repeats: into which the seeds are divided.
        steps: control steps an episode lasts at most.
        record: folder into which the operator's drives are recorded, each a session and a keystroke file.
        tried: seeds and steps of the drives from which the operator learns what its keys do.
        workers: processes.
        progress: called with episodes done and episodes in all.

    Raises:
        PdtuiError: robot, policy or map cannot be had or lack what is needed, the seeds cannot be divided, or
            a session cannot be scored.
    """
    if conditions and (not seeds or len(seeds) % repeats):
        raise PdtuiError(f"{len(seeds)} seeds cannot be divided into {repeats} equal repeats")
    order = replace(order, seed=0, start=FOREST)
    loop = build_loop(order)
    name, dt, policy = order.robot, loop.robot.control_dt, loop.policy.name
    people = [(path, *read_forest(path, name, steps)) for path in sessions]
    orders, left_out = _orders(order, conditions)
    learning = tuple(tried[0]) if "operator" in orders else ()
    keys = list(operator_keys(order.stimulation_map)) if learning else []
    if taken := sorted(set(learning) & set(seeds)):
        raise PdtuiError(f"seed {taken[0]}: on that one the operator learns what its keys do")
    if record is not None and (present := sorted(record.glob("*.rrd"))):
        raise SessionError(f"{present[0]}: exists already; drives are recorded into a new folder")
    total, done = len(learning) + len(orders) * len(seeds), 0
    responses: dict[str, Response] = {}
    runs: dict[Condition, list[ForestRun]] = {}
    with _pool(workers if total else 0) as run_all:
        drives = []
        for drive in run_all(_try_keys, [(replace(order, start=ROUGH), seed, tried[1]) for seed in learning]):
            drives.append(drive)
            done = _tell(progress, done, total)
        if drives:
            responses = fit_responses(drives, keys, dt)
        for condition, its_order in orders.items():
            with_it = responses if condition == "operator" else {}
            folder = record if with_it else None
            jobs = [(its_order, seed, steps, with_it, folder) for seed in seeds]
            runs[condition] = []
            for run in run_all(_run_episode, jobs):
                runs[condition].append(run)
                done = _tell(progress, done, total)
    measured = [summarise(CONDITIONS[one], orders[one].policy or policy, runs[one], repeats) for one in runs]
    if people:
        driven = ", ".join(sorted({session_policy for _, _, session_policy in people}))
        measured.append(summarise(PERSON, driven, [run for _, run, _ in people], len(people)))
    return Forest(
        name,
        tuple(seeds) if conditions else (),
        repeats,
        steps,
        steps * dt,
        tuple(measured),
        left_out,
        responses,
        learning,
        tuple(map(str, sessions)),
    )


_Episode = tuple[DriveOrder, int, int, dict[str, Response], Path | None]


def _try_keys(job: tuple[DriveOrder, int, int]) -> DrivenSteps:
    order, seed, steps = job
    return try_keys(_loop(order, seed), steps)


def _run_episode(job: _Episode) -> ForestRun:
    order, seed, steps, responses, folder = job
    loop = _loop(order, seed)
    operator = operator_for(loop, responses) if responses else None
    if operator is None or folder is None:
        return drive_forest(loop, steps, operator)[0]
    path = folder / f"{file_stem(order.robot)}-forest-seed{seed}.rrd"
    return record_forest(loop, steps, operator, path, order.activations)


def _loop(order: DriveOrder, seed: int) -> ControlLoop:
    built = built_once(replace(order, start=""))
    return ControlLoop(built.robot, built.policy, built.map, seed, start=order.start)


def _orders(
    order: DriveOrder, conditions: Sequence[Condition]
) -> tuple[dict[Condition, DriveOrder], dict[str, str]]:
    """How each condition is driven, and why some are not."""
    orders: dict[Condition, DriveOrder] = {}
    left_out = {}
    for condition in conditions:
        if condition != "vision":
            orders[condition] = order
            continue
        try:
            orders[condition] = _with_vision(order)
        except PdtuiError as error:
            left_out[CONDITIONS[condition]] = str(error)
    return orders, left_out


def _with_vision(order: DriveOrder) -> DriveOrder:
    """The robot that sees, with its shipped policy and no behaviors."""
    name = check_robot(f"{order.robot}-vision")
    try:
        find_weights(name)
    except PolicyError as error:
        raise PolicyError(f"'{name}' has no policy yet: {error}") from error
    nothing = StimulationMap(name, name, "", order.stimulation_map.default_key, {}, {})
    return DriveOrder(name, nothing, 0, name, start=FOREST, force=True)


@contextmanager
def _pool(workers: int) -> Iterator[Callable[..., Any]]:
    if not workers:
        yield lambda _, jobs: iter(jobs)
        return
    with worker_pool(workers) as pool:
        yield pool.imap


def _tell(progress: Callable[[int, int], None] | None, done: int, total: int) -> int:
    if progress is not None:
        progress(done + 1, total)
    return done + 1
