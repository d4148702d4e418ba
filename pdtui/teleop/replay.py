"""Run a session again and compare, step by step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from pdtui.policies.runtime import Policy
from pdtui.robots.base import Robot
from pdtui.sessions.events import events_by_step
from pdtui.sessions.reader import Session, read_session
from pdtui.sessions.versions import differences, environment_versions
from pdtui.stimulation.mapfile import parse_map
from pdtui.teleop.drive import build_loop
from pdtui.teleop.order import DriveOrder


@dataclass(frozen=True)
class ReplayResult:
    """How a replay compares with its session.

    Attributes:
        steps: control steps that were compared.
        first_difference: the first control step whose digest differs; None if none does.
        change: by how much the attribute that differs most does so in that step, in its unit.
        detail: that attribute and its change, in words.
        environment: how machine and versions differ from the session's.
    """

    steps: int
    first_difference: int | None
    change: float
    detail: str
    environment: tuple[str, ...]


def order_of(session: Session, source: str, policy: str = "") -> DriveOrder:
    """The drive that repeats a session.

    Raises:
        MapError: the map inside the session is broken.
    """
    info = session.info
    stimulation_map = parse_map(info.map_text, f"{source} (map)")
    # A drive that was forced had other weights than its map was made for; a replay wants the session's own.
    stimulation_map = replace(stimulation_map, policy_hash=info.policy_hash)
    return DriveOrder(
        robot=info.robot,
        stimulation_map=stimulation_map,
        seed=info.seed,
        policy=policy,
        stochastic=info.stochastic,
        script=session.events,
        digests=tuple(int(digest) for digest in session.digests),
    )


def replay_session(
    path: Path,
    *,
    policy: str | Policy = "",
    robot: Robot | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> ReplayResult:
    """Run a session from its file and its policy alone, comparing the digest of every step.

    Args:
        path: the session.
        policy: the policy or its weights file, where the one that the map names is elsewhere now.
        robot: the robot, where its name is not known.
        progress: called with steps done and steps in all.

    Raises:
        PdtuiError: the session cannot be read or its policy cannot be had.
    """
    session = read_session(path)
    given = policy if isinstance(policy, Policy) else None
    order = order_of(session, str(path), policy if isinstance(policy, str) else "")
    loop = build_loop(order, robot, given)
    events = events_by_step(session.events)
    environment = tuple(differences(session.versions, environment_versions()))
    for step, digest in enumerate(order.digests):
        record = loop.advance(events.get(step, ()))
        if record.digest != digest:
            change = abs(record.attributes - session.attributes[step])
            worst = int(change.argmax())
            attribute = session.info.attributes[worst]
            detail = f"{attribute.name} is off by {change[worst]:.3g} {attribute.unit}"
            return ReplayResult(step + 1, step, float(change[worst]), detail, environment)
        if progress is not None:
            progress(step + 1, session.steps)
    return ReplayResult(session.steps, None, 0.0, "", environment)
