"""Runs a session again and compares every step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from torch import nn

from pdtui.core.attributes import Floats
from pdtui.core.drive_events import group_events_by_step
from pdtui.core.errors import PdtuiError, SessionError
from pdtui.driving.control_loop import ControlLoop
from pdtui.driving.drive_config import DriveConfig
from pdtui.driving.loop_builder import build_control_loop
from pdtui.policies.runtime.policy import Policy
from pdtui.robots import open_robot
from pdtui.robots.robot import Robot
from pdtui.sessions.environment_versions import collect_versions, list_version_differences
from pdtui.sessions.session_comparison import (
    ReplayDeviation,
    absolute_attribute_differences,
    measure_attribute_spread,
    summarise_deviations,
)
from pdtui.sessions.session_reader import Session, read_session
from pdtui.stimulation.map_policy_lookup import locate_map_policy
from pdtui.stimulation.map_reader import parse_map

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


@dataclass(frozen=True)
class ReplayResult:
    """How a replay compares with its session.

    Attributes:
        steps: control steps that were compared.
        first_difference: the first control step whose digest differs; None if none does.
        change: difference, in that step and in its unit, of the attribute that differs most.
        detail: that attribute and its difference, in words.
        environment: how machine and versions differ from the session's.
        total: control steps of the session.
        dt: simulated time of a control step, s.
        deviations: how far each attribute is off from the first difference on, worst first.
        agreed: number of first control steps in which every attribute is within the tolerance.
        tolerance: in standard deviations of each attribute; None if every bit must be the same.
        judged: number of first control steps that must be within the tolerance.
        stopped: why the replay could not go on after it differed from the session; empty if it could.
    """

    steps: int
    first_difference: int | None
    change: float
    detail: str
    environment: tuple[str, ...]
    total: int = 0
    dt: float = 0.0
    deviations: tuple[ReplayDeviation, ...] = ()
    agreed: int = 0
    tolerance: float | None = None
    judged: int = 0
    stopped: str = ""

    @property
    def identical(self) -> bool:
        """Whether every step left the same digest."""
        return self.first_difference is None

    @property
    def passed(self) -> bool:
        """Whether the session repeats: bit for bit, or on another machine within the tolerance."""
        return self.identical or (self.tolerance is not None and self.agreed >= self.judged)

    @property
    def verdict(self) -> str:
        """The result in one line."""
        if self.identical:
            return f"identical: {self.steps} steps"
        where = f"step {self.first_difference} of {self.total}"
        if self.tolerance is None:
            return f"differs: {where}: {self.detail}"
        kept = (
            f"{self.agreed} steps ({self.agreed * self.dt:g} s) are within {self.tolerance:g} of the spread"
        )
        if self.passed:
            return f"repeats within tolerance: bits differ from {where} on; the first {kept}"
        return f"differs: {where}: {self.detail}; only the first {kept}, but {self.judged} have to be"


def config_from_session(session: Session, source: str, policy: str = "") -> DriveConfig:
    """Return the configuration of the drive that repeats a session.

    A `MapError` means that the map inside the session is broken; a `PolicyError`, that the map names a file
    outside of the session's folder and the working directory.
    """
    info = session.info
    stimulation_map = parse_map(info.map_text, f"{source} (map)")
    stimulation_map = locate_map_policy(stimulation_map, policy)
    # A forced drive had other weights than its map was made for; a replay needs the session's own.
    stimulation_map = replace(stimulation_map, policy_hash=info.policy_hash)
    return DriveConfig(
        robot=info.robot,
        stimulation_map=stimulation_map,
        seed=info.seed,
        policy=policy,
        stochastic=info.stochastic,
        start=info.start,
        scripted_events=session.events,
        expected_digests=tuple(int(digest) for digest in session.digests),
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
    progress: Callable[[int, int], None] | None = None,
) -> ReplayResult:
    """Run a session from its file and its policy alone, and compare every step.

    On the machine and with the versions that recorded it, every digest must be the same. Elsewhere, sums may
    be rounded differently, and a robot's contacts with the ground amplify that until nothing agrees any more;
    there, the attributes must agree in the first control steps.

    Args:
        path: the session.
        policy: the policy or its weights file, if it is no longer where the map says.
        robot: the robot, if it cannot be built from its name.
        strict: whether every digest must be the same on any machine.
        tolerance: elsewhere, in standard deviations of each attribute over the session.
        required_steps: elsewhere, number of first control steps that must be within the tolerance.
        force: run even if the policy is not the session's.
        progress: called with the number of steps done and the total.

    Raises:
        PdtuiError: the session or its policy cannot be loaded, or an event does not fit although nothing had
            differed before it.
    """
    session = read_session(path)
    given = None if isinstance(policy, str) else policy
    config = config_from_session(session, str(path), policy if isinstance(policy, str) else "given")
    with open_robot(robot or config.robot) as world:
        loop = build_control_loop(replace(config, force=force), world, given)
        if world.attributes != session.info.attributes:
            raise SessionError(f"{path}: the robot has other attributes than the session")
        first, changes, stopped = _compare_steps(session, loop, progress)
    here = collect_versions()
    elsewhere = bool(list_version_differences(session.versions, here, numeric=True)) and not strict
    spread = measure_attribute_spread(session.attributes)
    outside = np.flatnonzero((changes > tolerance * spread).any(axis=1))
    agreed = (first or 0) + (int(outside[0]) if outside.size else len(changes))
    deviations = (
        summarise_deviations(changes, session.info.attributes, first, spread) if first is not None else ()
    )
    return ReplayResult(
        steps=session.steps if first is None else first + len(changes),
        first_difference=first,
        change=deviations[0].first if deviations else 0.0,
        detail=_detail(deviations),
        environment=tuple(list_version_differences(session.versions, here)),
        total=session.steps,
        dt=session.info.dt,
        deviations=deviations,
        agreed=session.steps if first is None else agreed,
        tolerance=tolerance if elsewhere else None,
        judged=min(session.steps, required_steps),
        stopped=stopped,
    )


def _compare_steps(
    session: Session, loop: ControlLoop, progress: Callable[[int, int], None] | None
) -> tuple[int | None, Floats, str]:
    """Return the first step that differs, how far attributes are off from there on, and why it stopped."""
    events = group_events_by_step(session.events)
    first: int | None = None
    changes = []
    stopped = ""
    for step, digest in enumerate(session.digests.tolist()):
        try:
            record = loop.advance(events.get(step, ()))
        except PdtuiError as error:
            if first is None:
                raise
            # Once the replay differs, an event of the session may no longer fit its state.
            stopped = f"step {step}: {error}"
            break
        if first is None and record.digest != digest:
            first = step
        if first is not None:
            changes.append(
                absolute_attribute_differences(
                    record.attributes, session.attributes[step], session.info.attributes
                )
            )
        if progress is not None:
            progress(step + 1, session.steps)
        if record.diverged and step + 1 < session.steps:
            if first is None:
                raise SessionError(f"{session.path}: step {step} diverges, but {session.steps} are recorded")
            stopped = f"step {step}: {record.ended}"
            break
    return first, np.array(changes).reshape(-1, len(session.info.attributes)), stopped


def _detail(deviations: tuple[ReplayDeviation, ...]) -> str:
    if not deviations:
        return "the simulator's state differs, but no attribute does"
    worst = deviations[0]
    if worst.first == 0.0:
        return f"the simulator's state differs; attributes differ later: {worst}"
    return f"{worst.attribute} is off by {worst.first:.3g} {worst.unit}"
