"""Pytest plugin: recorded drives as regression tests of a policy.

Pytest finds the plugin by itself. Drive once, keep the session beside the tests, and every later run repeats
the drive and compares it step by step.

Example::

    # test_walk.py
    def test_my_policy_still_walks(pdtui_session):
        pdtui_session("sessions/walk.rrd", policy="my_policy.safetensors")

A failing test names the first step that differs, and how far each attribute is off. On the machine and with
the versions that recorded the session, every bit must be the same. Elsewhere, the attributes have to agree
in the first control steps (see `pdtui.driving.session_replay.TOLERANCE`), unless ``strict=True`` demands the
same bits.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from torch import nn

    from pdtui.driving.replays.replay_result import ReplayResult
    from pdtui.policies.runtime.policy import Policy
    from pdtui.robots.robot import Robot

_SHOWN = 8  # attributes in the report of a difference


class SessionReplayFixture:
    """Type of the fixture `pdtui_session`.

    Args:
        folders: where the relative paths of sessions and weights are looked for.
    """

    def __init__(self, *folders: Path) -> None:
        self._folders = folders

    def __call__(
        self,
        session: str | Path,
        *,
        policy: str | Path | nn.Module | Policy | None = None,
        robot: Robot | None = None,
        strict: bool = False,
        **tolerance: Any,
    ) -> ReplayResult:
        # Imported here, so that only tests that replay a drive load torch and a simulator.
        from pdtui.api import replay
        from pdtui.core.errors import PdtuiError

        path = _find(session, self._folders)
        if isinstance(policy, str | Path):
            policy = _find(policy, self._folders)
        try:
            result = replay(path, robot=robot, policy=policy, strict=strict, force=True, **tolerance)
        except PdtuiError as error:
            pytest.fail(f"{path}: cannot be replayed: {error}", pytrace=False)
        if not result.passed:
            pytest.fail(_report(path, result), pytrace=False)
        return result


@pytest.fixture
def pdtui_session(request: pytest.FixtureRequest) -> SessionReplayFixture:
    """Repeat a recorded drive, and fail the test at the first step that differs.

    The fixture is a function. Its arguments are

    - the session: a path relative to the test's folder or pytest's root folder, or absolute;
    - ``policy``: a weights file (found like the session), the name of a shipped policy, or a live network;
      by default the session's. Other weights than the session's are run and compared all the same;
    - ``robot``: the robot, if the session's cannot be built from its name;
    - ``strict``, ``tolerance``, ``required_steps``: as for `pdtui.driving.session_replay.replay_session`.

    It returns the `ReplayResult` of a drive that repeats.
    """
    return SessionReplayFixture(request.path.parent, request.config.rootpath)


def _find(name: str | Path, folders: tuple[Path, ...]) -> Path:
    """Return the file in the first folder that has it, or the name itself if none has."""
    return next((folder / name for folder in folders if (folder / name).exists()), Path(name))


def _report(path: Path, result: Any) -> str:
    lines = [f"{path}: {result.verdict}", *(f"  {line}" for line in result.deviations[:_SHOWN])]
    more = len(result.deviations) - _SHOWN
    if more > 0:
        lines.append(f"  and {more} more attributes")
    if result.stopped:
        lines.append(f"  the replay stopped at {result.stopped}")
    lines += [f"  {line}" for line in result.environment]
    return "\n".join(lines)
