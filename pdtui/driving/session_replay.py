"""Runs a session again and compares every step."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from pathlib import Path

from torch import nn

from pdtui.core.drive_events import group_events_by_step
from pdtui.core.errors import PdtuiError, SessionError
from pdtui.core.outcome import Outcome
from pdtui.core.step_record import StepRecord
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.loop_builder import build_control_loop
from pdtui.driving.replays.replay_comparison import ReplayComparison, describe_info_differences
from pdtui.driving.replays.replay_result import ReplayResult
from pdtui.policies.runtime.policy import Policy
from pdtui.robots import open_robot
from pdtui.robots.robot import Robot
from pdtui.sessions.environment_versions import collect_versions, list_version_differences
from pdtui.sessions.session_header import SessionHeader, read_session_header
from pdtui.sessions.streams.run_deviations import AttributeDeviation
from pdtui.sessions.streams.step_block_reader import read_step_blocks
from pdtui.sessions.streams.value_differences import StreamDifference
from pdtui.stimulation.map_policy_lookup import locate_map_policy
from pdtui.stimulation.map_reader import parse_map
from pdtui.stimulation.map_robot_options import map_robot

TOLERANCE = 5e-6
"""Tolerance in the first `REQUIRED_STEPS`, in standard deviations of each attribute over the session.

Another processor sums in another order. The shipped samples, recorded on an AMD EPYC and computed again on
an Intel Xeon, differ by the last bit of the policy's float32 output from the first control step on: by at
most 2.5e-6 in the first 5 steps, by 5e-5 in the first 20, and entirely after some seconds, since contacts
amplify rounding. A deliberate change is larger at once: if each weight is changed by 1e-5 of itself,
attributes are off by 2e-5 or more within 5 steps (four robots, six draws each).
"""

REQUIRED_STEPS = 5
"""Control steps in which a drive on another machine must be within the tolerance."""


def config_from_session(session: SessionHeader, source: str, policy: str = "") -> DriveConfig:
    """Return the configuration of the drive that repeats a session.

    A `MapError` means that the map inside the session is broken; a `PolicyError`, that the map names a file
    outside of the session's folder and the working directory.
    """
    info = session.info
    parts = {part.name: getattr(session, part.name) for part in fields(SessionHeader)}
    stimulation_map = parse_map(info.map_text, f"{source} (map)")
    stimulation_map = locate_map_policy(stimulation_map, policy)
    # A drive may have had other weights or another world than its map; a replay needs the session's own.
    stimulation_map = replace(
        stimulation_map, policy_hash=info.policy_hash, robot_options=dict(info.robot_options)
    )
    return DriveConfig(
        robot=info.robot,
        stimulation_map=stimulation_map,
        seed=info.seed,
        policy=policy,
        stochastic=info.stochastic,
        start=info.start,
        watched=SessionHeader(**parts),
    )


def replay_session(
    path: Path,
    *,
    policy: str | Policy | nn.Module = "",
    robot: Robot | None = None,
    strict: bool = False,
    tolerance: float = TOLERANCE,
    required_steps: int = REQUIRED_STEPS,
    force: bool = False,
    minutes: float | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> ReplayResult:
    """Run a session from its file and its policy alone, and compare every step.

    Everything that is recorded is compared: digests, attributes, actions, rewards, costs, activations,
    stimulated units with both outputs, behaviors with their controllers, episodes and their outcomes, the
    poses for the viewer, and the description of robot and policy.

    On the machine and with the versions that recorded it, every bit must be the same. Elsewhere, sums may
    be rounded differently, and a robot's contacts with the ground amplify that until nothing agrees any more;
    there, the attributes must agree within the tolerance in the first control steps; the other streams within
    `STREAM_TOLERANCE` in these steps and for as long as the simulator's state is the same; and stimulated
    units, behaviors, endings, the duration of a control step and the layers exactly.

    The session is read block by block. Steps that it lacks are run, but not compared.

    Args:
        path: the session.
        policy: the policy or its weights file, if it is no longer where the map says.
        robot: the robot, if it cannot be built from its name.
        strict: whether every digest must be the same on any machine.
        tolerance: elsewhere, in standard deviations of each attribute over the session.
        required_steps: elsewhere, number of first control steps that must be within the tolerance.
        force: run even if the policy is not the session's.
        minutes: time after which the replay ends with the steps compared so far; None for no limit.
        progress: called with the number of steps done and the total.

    Raises:
        PdtuiError: the session or its policy cannot be loaded, or an event does not fit although nothing had
            differed before it.
    """
    header = read_session_header(path)
    given = None if isinstance(policy, str) else policy
    config = config_from_session(header, str(path), policy if isinstance(policy, str) else "given")
    here = collect_versions()
    elsewhere = bool(list_version_differences(header.versions, here, numeric=True)) and not strict
    comparison = ReplayComparison(header.info, required_steps)
    with open_robot(robot or map_robot(config.stimulation_map, config.robot)) as world:
        loop = build_control_loop(replace(config, force=force), world, given)
        if world.attributes != header.info.attributes:
            raise SessionError(f"{path}: the robot has other attributes than the session")
        description = describe_info_differences(loop.info, header.info, exact=not elsewhere)
        end = math.inf if minutes is None else time.monotonic() + 60.0 * minutes
        stopped = "" if description else _compare_steps(header, loop, comparison, progress, end)
    first, deviations = comparison.difference, comparison.deviations.summarize()
    state_differs = first is not None and comparison.first_digest == first.step
    return ReplayResult(
        steps=comparison.steps,
        first_difference=None if first is None else first.step,
        change=deviations[0].first if deviations else 0.0,
        detail=_detail(first, deviations, state_differs),
        environment=tuple(list_version_differences(header.versions, here)),
        total=header.steps,
        dt=header.info.dt,
        deviations=deviations,
        agreed=comparison.rows_before + comparison.deviations.count_within(tolerance),
        tolerance=tolerance if elsewhere else None,
        judged=min(header.steps - header.missing, required_steps),
        stopped=stopped,
        difference=first,
        damaged=first is not None and _is_damage(comparison, elsewhere=elsewhere),
        beyond_rounding=comparison.beyond_rounding,
        description=description,
        missing=header.gaps,
        left=0 if description or stopped else header.steps - header.missing - comparison.steps,
    )


def _compare_steps(
    header: SessionHeader,
    loop: ControlLoop,
    comparison: ReplayComparison,
    progress: Callable[[int, int], None] | None,
    end: float,
) -> str:
    """Run the session block by block; return why the replay cannot go on before its end, or nothing.

    It ends at a time of `time.monotonic`, too.
    """
    events = group_events_by_step(header.events)
    total = header.steps - header.missing
    for block in read_step_blocks(header, activations=True, poses=True):
        records: list[StepRecord] = []
        stopped = ""
        recorded = frozenset(block.steps.tolist())
        for step in range(loop.step, int(block.steps[-1]) + 1):
            try:
                record = loop.advance(events.get(step, ()))
            except PdtuiError as error:
                comparison.add(records, block.part(0, len(records)))
                # Once the replay differs, an event of the session may no longer fit its state.
                if comparison.difference is None:
                    raise
                return f"step {step}: {error}"
            if step in recorded:
                records.append(record)
                if progress is not None:
                    progress(comparison.steps + len(records), total)
            if record.outcome is Outcome.DIVERGED and comparison.steps + len(records) < total:
                stopped = f"step {step}: {record.ended}"
            if stopped or time.monotonic() >= end:
                break
        comparison.add(records, block.part(0, len(records)))
        if stopped and comparison.difference is None:
            raise SessionError(f"{header.path}: {stopped}, but {total} steps are recorded")
        if stopped or time.monotonic() >= end:
            return stopped
    return ""


def _is_damage(comparison: ReplayComparison, *, elsewhere: bool) -> bool:
    """Return whether a recorded value is wrong by more than rounding although the state was right."""
    wrong = comparison.beyond_rounding if elsewhere else comparison.difference
    state = comparison.first_digest
    return wrong is not None and (state is None or wrong.step < state)


def _detail(
    difference: StreamDifference | None, deviations: Sequence[AttributeDeviation], state_differs: bool
) -> str:
    if difference is None:
        return ""
    if state_differs and deviations and deviations[0].first > 0.0:
        worst = deviations[0]
        return f"{worst.attribute} is off by {worst.first:.3g} {worst.unit}"
    return str(difference)
